// Dead reckoning: poses carried on from the last one by speed and yaw rate, with what is then not
// known of them. Each pose that comes teaches the constant errors of either.
#ifndef GPOM_LINUX_ODOMETRY_HPP
#define GPOM_LINUX_ODOMETRY_HPP

#include "ports/linux/pose/pose_ring.hpp"

#include <cstddef>
#include <cstdint>
#include <mutex>

namespace gpomd
{

/// How good the odometry is, and for how long.
struct OdometryConfig {
    std::int64_t timeout_us; ///< Samples further apart, or a last one older, are no odometry.
    std::int64_t carry_us;   ///< No pose is carried on for longer.
    double speed_scale_sd;   ///< Constant relative error of the speed, standard deviation [1].
    double yaw_rate_bias_sd; ///< Constant error of the yaw rate, standard deviation [rad/s].
    double speed_noise;      ///< White error of the speed [m / sqrt(s)].
    double yaw_rate_noise;   ///< White error of the yaw rate [rad / sqrt(s)].
};

/// Time in which a constant error may become another one: what is learnt of it fades so.
constexpr double kErrorLife_s = 300.0;

/// Constant errors as they are believed to be: true speed = (1 - scale) speed, true yaw rate =
/// yaw rate - bias.
struct OdometryErrors {
    double scale, bias_radps;
    double scale_var, cross, bias_var; ///< Their covariance.
};

/// What wheels say at a time.
struct Motion {
    std::int64_t stamp_us;
    double speed_mps;      ///< Along the robot's x axis.
    double yaw_rate_radps; ///< Counter-clockwise.
};

/// Covariance of x, y, yaw by rows [m2, m rad, rad2].
using PoseCov = double[9];

/// A bounded ring of motions in the order of their stamps. One thread pushes, others may carry.
class Odometry {
public:
    static constexpr std::size_t kMotions = 4096; ///< 20 s at 200 Hz.

    void init(const OdometryConfig &config);

    /// Finite, and not faster than anything that the map is for.
    static bool is_sane(const Motion &motion);

    /// Take a sane motion; one of the last stamp replaces the last. False: it is older than the
    /// last. After PoseRing::kSetBack older ones in a row the ring begins anew.
    bool push(const Motion &motion);

    /// Newest stamp; false: none yet.
    bool newest(std::int64_t &stamp_us) const;

    /// The pose at stamp_us, carried on from an earlier one, and its covariance; `cov` is that of
    /// `from` before and the carried pose's after. Between samples motion changes linearly.
    /// not_yet: the newest sample is older; gap: some samples on the way are further apart than
    /// timeout_us, or `from` is too long ago, or later than stamp_us. `cov` is unchanged then.
    ///
    /// With d the way, s and b the constant errors of speed and yaw rate, the error is to first
    /// order J_from e + (d, 0) s + J_b b plus what white errors add on the way (Thrun, Burgard and
    /// Fox 2005, sec. 5.4; a random walk in yaw, its effect on the place through F of each step).
    /// Errors that were learnt are taken out; what is not known of them stays.
    /// Cost: 60 operations a sample on the way, at most kMotions.
    PoseMatch carry(const StampedPose &from, std::int64_t stamp_us, StampedPose &pose,
                    PoseCov &cov) const;

    /// Learn the constant errors from two poses, each with covariance `cov`: a Kalman update by how
    /// far the earlier one, carried on, is from the later one. Pairs that do not begin after the
    /// last one learnt from, and such as the errors cannot explain (chi-squared over 16.3, one in
    /// a thousand), are left out. False: odometry up to the later pose has not come yet.
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
    mutable std::mutex mutex_; ///< Guards what follows.
    Motion motions_[kMotions] = {};
    std::size_t first_ = 0;
    std::size_t n_ = 0;
    OdometryErrors errors_ = {};
    std::int64_t learnt_us_ = INT64_MIN; ///< Stamp of the last pose learnt from.
    std::int64_t behind_us_ = 0;
    std::uint32_t n_behind_ = 0;
};

} // namespace gpomd

#endif
