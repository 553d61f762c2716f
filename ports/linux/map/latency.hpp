// How late the stamps of scans are against those of poses, told by how the robot turns in both.
#ifndef GPOM_LINUX_LATENCY_HPP
#define GPOM_LINUX_LATENCY_HPP

#include "ports/linux/config/config.hpp"
#include "ports/linux/lcm/scan_queue.hpp"
#include "ports/linux/pose/pose_ring.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// Yaw over time, without the jumps at +-pi.
class YawTrack {
public:
    void clear() { n_ = 0; }
    /// A pose that is not later than the last one, or long after it, begins a new track.
    void push(std::int64_t stamp_us, double yaw_rad);
    bool has_reached(std::int64_t stamp_us) const;
    /// Interpolated; false: outside of the track.
    bool at(std::int64_t stamp_us, double &yaw_rad) const;

private:
    static constexpr std::size_t kMax = 1024; ///< 5 s at 200 Hz.
    struct Turned {
        std::int64_t stamp_us;
        double yaw_rad;
    };
    const Turned &nth(std::size_t i) const { return ring_[(first_ + i) % kMax]; }

    Turned ring_[kMax] = {};
    std::size_t first_ = 0, n_ = 0;
};

/// Ranges by bearing, half a degree a bin; NaN where nothing is known.
struct Panorama {
    static constexpr int kBins = 720;

    float range_m[kBins];

    void take(const ScanSlot &slot, const gpom_sensor_t &sensor);
    /// How far the sensor turned from here to the next scan, counter-clockwise; false: not clear.
    bool turn_to(const Panorama &next, double &turn_rad) const;

private:
    double difference(const Panorama &next, int shift) const;
};

/// Of one sensor; may begin as zeros. Used by one thread. A turn between two scans is found by
/// shifting one over the other; the latency is the one at which the poses turn alike. Cost: 60,000
/// operations a scan, of 20 scans a second at most.
class Latency {
public:
    void init(const gpom_sensor_t &sensor) { sensor_ = &sensor; }

    void take_pose(std::int64_t stamp_us, double yaw_rad) { track_.push(stamp_us, yaw_rad); }
    void take_scan(const ScanSlot &slot);
    /// The frame of the poses jumped.
    void begin_frame();

    /// How late the scans' stamps are [s], negative: early. False: not known to 10 ms, since the
    /// robot did not turn enough so far, or sees too little.
    bool find(double &latency_s) const;

private:
    static constexpr int kLags = 101; ///< From -1 s to 1 s.
    static constexpr std::size_t kPairsMax = 64;

    struct Pair {
        std::int64_t from_us, to_us;
        double turn_rad;
    };

    void settle_pairs();
    void compare(const Pair &pair);

    const gpom_sensor_t *sensor_ = nullptr;
    YawTrack track_;
    Panorama panoramas_[2] = {};
    int i_newest_ = 0;
    bool has_panorama_ = false;
    std::int64_t stamp_us_ = 0;  ///< Of the newest panorama.
    Pair pairs_[kPairsMax] = {}; ///< That wait for the poses after them, in their order.
    std::size_t n_pairs_ = 0;
    double squares_[kLags] = {}; ///< Sums of squared differences of turns [rad2], by lag.
    double n_compared_ = 0.0;    ///< Pairs in them; older ones count less.
};

} // namespace gpomd

#endif
