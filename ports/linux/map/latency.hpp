// Estimates how late the stamps of scans are against those of poses: compares how the robot turns
// in both.
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
    /// Add a pose. A pose that is not later than the last one, or long after it, begins a new
    /// track.
    void push(std::int64_t stamp_us, double yaw_rad);
    bool has_reached(std::int64_t stamp_us) const;
    /// Interpolated yaw. False: the time is outside the track.
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

/// Ranges by bearing, in bins of half a degree. NaN: not known.
struct Panorama {
    static constexpr int kBins = 720;

    float range_m[kBins];

    void take(const ScanSlot &slot, const gpom_sensor_t &sensor);
    /// How far the sensor turned from this scan to the next one, counter-clockwise. False: not
    /// clear.
    bool turn_to(const Panorama &next, double &turn_rad) const;

private:
    double difference(const Panorama &next, int shift) const;
};

/// The estimate for one sensor. All bytes 0 is a valid start value. Used by one thread. The turn
/// between two scans is found by shifting one scan over the other. The latency is the lag at which
/// the poses turn in the same way.
/// Cost: 60,000 operations a scan, for at most 20 scans a second.
class Latency {
public:
    void init(const gpom_sensor_t &sensor) { sensor_ = &sensor; }

    void take_pose(std::int64_t stamp_us, double yaw_rad) { track_.push(stamp_us, yaw_rad); }
    void take_scan(const ScanSlot &slot);
    /// The frame of the poses jumped.
    void begin_frame();

    /// Get how late the stamps of the scans are [s]. Negative: early. False: not yet known to 10
    /// ms, because the robot did not turn enough or sees too little.
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
    std::int64_t stamp_us_ = 0;  ///< Stamp of the newest panorama.
    Pair pairs_[kPairsMax] = {}; ///< Pairs that wait for later poses, in order.
    std::size_t n_pairs_ = 0;
    double squares_[kLags] = {}; ///< Sum of squared differences of turns [rad2], for each lag.
    double n_compared_ = 0.0;    ///< Number of pairs in `squares_`. Older pairs count less.
};

} // namespace gpomd

#endif
