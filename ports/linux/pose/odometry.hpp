// Dead reckoning: carries poses on from the last known pose by speed and yaw rate, and computes
// their covariance. Each new pose improves the estimates of the constant errors of speed and yaw
// rate.
#ifndef GPOM_LINUX_ODOMETRY_HPP
#define GPOM_LINUX_ODOMETRY_HPP

#include "ports/linux/pose/pose_ring.hpp"

#include <cstddef>
#include <cstdint>
#include <mutex>

namespace gpomd
{

/// How good the odometry is, and for how long it may be used.
struct OdometryConfig {
    std::int64_t timeout_us; ///< Longest time between two samples, and largest age of the last
                             ///< sample. Beyond it, odometry is absent.
    std::int64_t carry_us;   ///< A pose is carried on for this time at most.
    double speed_scale_sd;   ///< Constant relative error of the speed, standard deviation [1].
    double yaw_rate_bias_sd; ///< Constant error of the yaw rate, standard deviation [rad/s].
    double speed_noise;      ///< White error of the speed [m / sqrt(s)].
    double yaw_rate_noise;   ///< White error of the yaw rate [rad / sqrt(s)].
};

/// Constant errors may change over this time. Their learnt variances grow back to the configured
/// values over this time.
constexpr double kErrorLife_s = 300.0;

/// Estimates of the constant errors. True speed = (1 - scale) speed. True yaw rate = yaw rate -
/// bias.
struct OdometryErrors {
    double scale, bias_radps;
    double scale_var, cross, bias_var; ///< Their covariance.
};

/// Motion that the wheels report at one time.
struct Motion {
    std::int64_t stamp_us;
    double speed_mps;      ///< Along the robot's x axis.
    double yaw_rate_radps; ///< Counter-clockwise.
};

/// Covariance of x, y, yaw by rows [m2, m rad, rad2].
using PoseCov = double[9];

/// A bounded ring of motions, ordered by stamp. One thread pushes. Other threads may call carry().
class Odometry {
public:
    static constexpr std::size_t kMotions = 4096; ///< 20 s at 200 Hz.

    void init(const OdometryConfig &config);

    /// True if a motion is finite and within the limits of speed and yaw rate that any robot has.
    static bool is_sane(const Motion &motion);

    /// Add a sane motion. A motion with the last stamp replaces the last motion. False: the motion
    /// is older than the last one. After PoseRing::kSetBack older motions in a row the ring begins
    /// anew.
    bool push(const Motion &motion);

    /// Get the newest stamp. False: there is no motion yet.
    bool newest(std::int64_t &stamp_us) const;

    /// Carry an earlier pose on to stamp_us. On entry `cov` is the covariance of `from`, on return
    /// that of the carried pose. Motion changes linearly between samples.
    /// not_yet: the newest sample is older than stamp_us. gap: two samples on the way are further
    /// apart than timeout_us, or `from` is too old, or later than stamp_us. In both cases `cov` is
    /// unchanged.
    ///
    /// Let d be the way, s the constant error of the speed and b that of the yaw rate. To first
    /// order the error of the pose is J_from e + (d, 0) s + J_b b, plus what white errors add on
    /// the way (Thrun, Burgard and Fox 2005, sec. 5.4; the yaw error is a random walk, and F of
    /// each step gives its effect on the place). The learnt part of the constant errors is
    /// subtracted. Their remaining uncertainty stays in the covariance.
    /// Cost: 60 operations a sample on the way, at most kMotions samples.
    PoseMatch carry(const StampedPose &from, std::int64_t stamp_us, StampedPose &pose,
                    PoseCov &cov) const;

    /// Learn the constant errors from two poses, each with covariance `cov`. The earlier pose is
    /// carried on to the time of the later one. The difference between the two is the innovation of
    /// a Kalman update. A pair is left out if it begins before the end of the last pair used, or if
    /// its innovation is too large for the errors (chi-squared over 16.3, one pair in a thousand).
    /// False: odometry up to the later pose has not come yet.
    bool learn(const StampedPose &from, const StampedPose &to, const float *cov);

    OdometryErrors errors() const;

private:
    struct Way;
    PoseMatch travel(const StampedPose &from, std::int64_t stamp_us, Way &way) const;
    void advance(Way &way, const Motion &a, const Motion &b) const;
    void update(const StampedPose &from, const StampedPose &to, const float *cov, const Way &way);
    const Motion &nth(std::size_t i) const { return motions_[(first_ + i) % kMotions]; }
    std::size_t first_not_before(std::int64_t stamp_us) const;
    Motion between(std::size_t i_after, std::int64_t stamp_us) const;

    OdometryConfig config_ = {};
    mutable std::mutex mutex_; ///< Guards the members below.
    Motion motions_[kMotions] = {};
    std::size_t first_ = 0;
    std::size_t n_ = 0;
    OdometryErrors errors_ = {};
    std::int64_t learnt_us_ = INT64_MIN; ///< Stamp of the later pose of the last pair used by
                                         ///< learn().
    std::int64_t behind_us_ = 0;
    std::uint32_t n_behind_ = 0;
};

} // namespace gpomd

#endif
