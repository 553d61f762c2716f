// The library's map with memory from the heap, for programs on a host.
#ifndef GPOM_TOOLS_MAP_HOST_MAP_HPP
#define GPOM_TOOLS_MAP_HOST_MAP_HPP

#include "gpom/gpom.h"
#include "ports/host/scan_log.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace gpom_tools
{

/// Settings of a map that is kept as a vehicle keeps it (live.h).
struct LiveConfig {
    std::uint32_t beam_max = 16384;
    float keep_m = 0.05f;
    std::uint32_t clear_scans = 3;
    float late_m = 0.0f;              ///< Cells of gpom_map_begin_late(). 0: no beam begins late.
    std::uint64_t step_ops = 1000000; ///< Budget of the step after each scan.
};

/// Configuration of a map that keeps all beams.
gpom_config_t whole_config(const gpom_params_t &params, std::size_t beam_max, gpom_point_t origin);

/// Configuration of a map that keeps only useful beams.
gpom_config_t live_config(const gpom_params_t &params, const LiveConfig &live, gpom_point_t origin);

/// Owns the arena and the scratch of one map. Every failure throws std::runtime_error.
class HostMap {
public:
    /// late_m: as in LiveConfig.
    explicit HostMap(const gpom_config_t &config, float late_m = 0.0f);
    HostMap(const gpom_params_t &params, std::size_t beam_max, gpom_point_t origin)
        : HostMap(whole_config(params, beam_max, origin))
    {
    }

    /// Insert one scan. Its pose is the laser's pose. `pose_cov` is its covariance as in
    /// gpom_pose_t, or NULL: the pose is exact.
    void insert(const Scan &scan, const float *pose_cov = nullptr);
    /// Insert all scans and index them.
    void insert(const std::vector<Scan> &scans);

    void build();

    /// Move the beams with their corrected poses.
    gpom_repose_report_t repose(const std::vector<gpom_correction_t> &corrections);

    /// Put beams of another map into this one. `from` and `to`: the same pose in both frames.
    gpom_import_report_t import(const std::vector<gpom_beam_t> &beams, const gpom_pose_t &from,
                                const gpom_pose_t &to);

    /// The map frame jumps; nothing or all is forgotten.
    void jump(gpom_jump_t rule);

    /// Do one slice of the work that scans leave behind. Returns the number of operations done.
    std::uint64_t step(std::uint64_t budget);

    /// Answer points. If the matrix of a point is not positive definite, its answer is the prior,
    /// with a flag. If the search of a point was cut, its answer has a flag. A point out of reach
    /// throws.
    std::vector<gpom_answer_t> query(const std::vector<gpom_point_t> &points) const;
    std::vector<gpom_answer_t> query(const gpom_raster_t &raster) const;
    /// query() with derivatives.
    std::vector<gpom_gradient_t> gradients(const std::vector<gpom_point_t> &points) const;
    /// Only the probabilities of query().
    std::vector<double> probabilities(const std::vector<gpom_point_t> &points) const;
    /// Answer a path. Its flags report bad matrices and cut searches.
    gpom_path_result_t query(const gpom_path_t &path) const;

    /// The cells of the coarse low-resolution map, row by row from the lowest y.
    std::vector<gpom_cell_t> cells() const;

    gpom_stats_t stats() const;
    std::vector<gpom_beam_t> kept() const; ///< By slot, without vacant slots.
    std::size_t bytes() const { return map_bytes_; }
    const gpom_map_t *get() const { return map_; }

private:
    gpom_scratch_t scratch() const;

    std::size_t map_bytes_;
    std::unique_ptr<std::uint64_t[]> memory_;
    std::unique_ptr<std::uint8_t[]> scratch_;
    gpom_map_t *map_ = nullptr;
};

/// The stamp with which a scan is inserted.
std::int64_t stamp_us(const Scan &scan);

/// Most beams that scans can give. A map of this capacity takes them all.
std::size_t beam_count(const std::vector<Scan> &scans);

/// Middle of the scans' positions, rounded to metres: an origin from which all scans are in reach.
gpom_point_t middle_of(const std::vector<Scan> &scans);

} // namespace gpom_tools

#endif
