// The only thread that changes the map: inserts scans, steps the map, answers queries.
#ifndef GPOM_LINUX_MAPPING_HPP
#define GPOM_LINUX_MAPPING_HPP

#include "ports/linux/base/counts.hpp"
#include "ports/linux/config/config.hpp"
#include "ports/linux/config/problems.hpp"
#include "ports/linux/lcm/scan_queue.hpp"
#include "ports/linux/lcm/sender.hpp"
#include "ports/linux/map/answers.hpp"
#include "ports/linux/map/snapshots.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>

namespace gpomd
{

/// A summary of the map, copied for other threads.
struct MapState {
    bool has_map;              ///< A scan was inserted, or a snapshot restored.
    std::int64_t stamp_us;     ///< Of the newest scan inserted.
    std::int64_t fresh_us;     ///< Time of the last scan with a usable reading. Monotonic, 0: none
                               ///< so far.
    double pose[3];            ///< Robot at stamp_us, in the map frame [m, m, rad]. NaN: not known.
    std::uint32_t frame_epoch; ///< Frame epoch of `pose`, as in gpom_lowres_info_t.
    std::int64_t lag_us;       ///< Time from stamp_us to the insertion of the scan.
    std::int64_t lag_us_max;   ///< Largest lag_us since MapThread::state() was last asked to reset
                               ///< it.
    std::uint32_t n_beams;
    gpom_stats_t stats;
    double jump_from[3], jump_to[3]; ///< Robot before and after the last jump. NaN before: not
                                     ///< known.
};

/// The parts that the thread works with. All of them outlive the thread.
struct MapLinks {
    Sender *sender; ///< Used by this thread only.
    ScanQueue *scans;
    QueryQueue *queries;
    Snapshots *snapshots;
    Counts *counts;
    Problems *problems;
};

class MapThread {
public:
    static std::size_t need(const Config &config);
    /// NULL, or one sentence that says why the library refuses the configuration, in static
    /// storage.
    const char *init(const Config &config, Memory &memory, const MapLinks &links);

    /// Read the newest snapshot, before the thread runs. False: there is none.
    bool restore(gpom_snapshot_report_t &report);

    /// Work until `stop`. Then insert the scans that are still queued, and take a last snapshot.
    void run(const std::atomic<bool> &stop);

    MapState state(bool reset_lag_max = false);
    /// For those library functions that any thread may call.
    const gpom_map_t *map() const { return map_; }
    /// Increases as long as the thread runs.
    std::uint64_t pulse() const { return pulse_.load(std::memory_order_relaxed); }

private:
    void insert(const ScanSlot &slot);
    bool can_begin_frame(const gpom_pose_t &pose, gpom_jump_t &rule) const;
    void begin_frame(const ScanSlot &slot, gpom_jump_t rule);
    void note_refused(const ScanSlot &slot, gpom_status_t status);
    void note_unusable(const ScanSlot &slot, const gpom_stats_t &before, const gpom_stats_t &after);
    gpom_stats_t stats() const;
    void note_inserted(const ScanSlot &slot, bool is_fresh);
    bool step();
    std::uint32_t frame_epoch() const;
    void answer_one(std::uint32_t i_slot);

    const Config *config_ = nullptr;
    MapLinks links_ = {};
    gpom_map_t *map_ = nullptr;
    gpom_scratch_t scratch_ = {};
    std::uint32_t n_jumps_ = 0; ///< ScanSlot::n_jumps of the frame that the map is in.
    std::mutex mutex_;
    MapState state_ = {}; ///< Guarded by mutex_. Only this thread writes it.
    std::atomic<std::uint64_t> pulse_{0};
};

} // namespace gpomd

#endif
