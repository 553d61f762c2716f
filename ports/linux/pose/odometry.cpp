#include "ports/linux/pose/odometry.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace gpomd
{

namespace
{

/// Larger values are an error of the sender: no robot that uses the map moves so fast.
constexpr double kSpeedMax_mps = 150.0;
constexpr double kYawRateMax_radps = 50.0;

/// Larger innovations are not caused by the modelled errors: 99.9 % of chi-squared, 3 degrees of
/// freedom.
constexpr double kGate = 16.3;

using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using Matrix32 = Eigen::Matrix<double, 3, 2>;

/// a = F A F^T with F = [1 0 -dy; 0 1 dx; 0 0 1]: covariance of a pose after a step (dx, dy).
void step_on(PoseCov &a, double dx_m, double dy_m)
{
    const double xt = a[2], yt = a[5], tt = a[8];
    a[0] += -2.0 * dy_m * xt + dy_m * dy_m * tt;
    a[1] += dx_m * xt - dy_m * yt - dx_m * dy_m * tt;
    a[4] += 2.0 * dx_m * yt + dx_m * dx_m * tt;
    a[2] -= dy_m * tt;
    a[5] += dx_m * tt;
    a[3] = a[1];
    a[6] = a[2];
    a[7] = a[5];
}

/// a += variance v v^T.
void add_direction(PoseCov &a, const double (&v)[3], double variance)
{
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            a[3 * i + j] += variance * v[i] * v[j];
        }
    }
}

} // namespace

/// State of travel(): pose so far, and how errors have grown on the way.
struct Odometry::Way {
    double x_m, y_m, yaw_rad; ///< Pose so far.
    double elapsed_s;
    double bias_x, bias_y; ///< - d place / d bias of the yaw rate [m s / rad].
    PoseCov white;         ///< Covariance added by white errors so far.

    /// Derivative of the pose with respect to scale and bias, to first order.
    Matrix32 jacobian(const StampedPose &from) const
    {
        Matrix32 J;
        J << from.x_m - x_m, -bias_x, from.y_m - y_m, -bias_y, 0.0, -elapsed_s;
        return J;
    }
};

/// Advance by one step. Uses the mean of the motions at both ends and the middle heading.
void Odometry::advance(Way &way, const Motion &a, const Motion &b) const
{
    const double dt_s = 1e-6 * static_cast<double>(b.stamp_us - a.stamp_us);
    const double length_m = 0.5 * (a.speed_mps + b.speed_mps) * (1.0 - errors_.scale) * dt_s;
    const double turn_rad =
        (0.5 * (a.yaw_rate_radps + b.yaw_rate_radps) - errors_.bias_radps) * dt_s;
    const double heading_rad = way.yaw_rad + 0.5 * turn_rad;
    const double along[3] = {std::cos(heading_rad), std::sin(heading_rad), 0.0};
    const double dx_m = length_m * along[0], dy_m = length_m * along[1];
    const double middle_s = way.elapsed_s + 0.5 * dt_s;
    step_on(way.white, dx_m, dy_m);
    add_direction(way.white, along, config_.speed_noise * config_.speed_noise * dt_s);
    way.white[8] += config_.yaw_rate_noise * config_.yaw_rate_noise * dt_s;
    way.bias_x -= middle_s * dy_m;
    way.bias_y += middle_s * dx_m;
    way.x_m += dx_m;
    way.y_m += dy_m;
    way.yaw_rad += turn_rad;
    way.elapsed_s += dt_s;
}

void Odometry::init(const OdometryConfig &config)
{
    config_ = config;
    errors_ = {0.0, 0.0, config.speed_scale_sd * config.speed_scale_sd, 0.0,
               config.yaw_rate_bias_sd * config.yaw_rate_bias_sd};
}

bool Odometry::is_sane(const Motion &motion)
{
    return std::fabs(motion.speed_mps) <= kSpeedMax_mps && // NaN fails
           std::fabs(motion.yaw_rate_radps) <= kYawRateMax_radps;
}

bool Odometry::push(const Motion &motion)
{
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::int64_t last_us = n_ > 0 ? nth(n_ - 1).stamp_us : INT64_MIN;
    if (n_ > 0 && motion.stamp_us == last_us) {
        motions_[(first_ + n_ - 1) % kMotions] = motion;
        return true;
    }
    if (motion.stamp_us < last_us) {
        n_behind_ = motion.stamp_us > behind_us_ ? n_behind_ + 1 : 1;
        behind_us_ = motion.stamp_us;
        if (n_behind_ < PoseRing::kSetBack) {
            return false;
        }
        n_ = 0;
        learnt_us_ = INT64_MIN;
    }
    n_behind_ = 0;
    if (n_ == kMotions) {
        first_ = (first_ + 1) % kMotions;
        --n_;
    }
    motions_[(first_ + n_) % kMotions] = motion;
    ++n_;
    return true;
}

bool Odometry::newest(std::int64_t &stamp_us) const
{
    const std::lock_guard<std::mutex> lock(mutex_);
    stamp_us = n_ > 0 ? nth(n_ - 1).stamp_us : 0;
    return n_ > 0;
}

std::size_t Odometry::first_not_before(std::int64_t stamp_us) const
{
    return first_stamp_not_before(stamp_us, n_, [this](std::size_t i) { return nth(i).stamp_us; });
}

/// Motion at a time between samples i_after - 1 and i_after.
Motion Odometry::between(std::size_t i_after, std::int64_t stamp_us) const
{
    const Motion &after = nth(i_after);
    if (after.stamp_us == stamp_us) {
        return after;
    }
    const Motion &before = nth(i_after - 1);
    const double part = static_cast<double>(stamp_us - before.stamp_us) /
                        static_cast<double>(after.stamp_us - before.stamp_us);
    return {stamp_us, before.speed_mps + part * (after.speed_mps - before.speed_mps),
            before.yaw_rate_radps + part * (after.yaw_rate_radps - before.yaw_rate_radps)};
}

PoseMatch Odometry::travel(const StampedPose &from, std::int64_t stamp_us, Way &way) const
{
    if (n_ == 0 || stamp_us > nth(n_ - 1).stamp_us) {
        return PoseMatch::not_yet;
    }
    if (from.stamp_us > stamp_us || stamp_us - from.stamp_us > config_.carry_us ||
        from.stamp_us < nth(0).stamp_us) {
        return PoseMatch::gap;
    }
    const std::size_t i_first = first_not_before(from.stamp_us);
    const std::size_t i_last = first_not_before(stamp_us);
    const bool is_at_first = nth(i_first).stamp_us == from.stamp_us;
    for (std::size_t i = is_at_first ? i_first + 1 : i_first; i <= i_last; ++i) {
        if (nth(i).stamp_us - nth(i - 1).stamp_us > config_.timeout_us) {
            return PoseMatch::gap;
        }
    }
    way = {from.x_m, from.y_m, from.yaw_rad, 0.0, 0.0, 0.0, {}};
    Motion last = between(i_first, from.stamp_us);
    for (std::size_t i = i_first; i < i_last; ++i) {
        advance(way, last, nth(i));
        last = nth(i);
    }
    advance(way, last, between(i_last, stamp_us));
    return PoseMatch::found;
}

PoseMatch Odometry::carry(const StampedPose &from, std::int64_t stamp_us, StampedPose &pose,
                          PoseCov &cov) const
{
    const std::lock_guard<std::mutex> lock(mutex_);
    Way way;
    const PoseMatch match = travel(from, stamp_us, way);
    if (match != PoseMatch::found) {
        return match;
    }
    Eigen::Matrix2d errors;
    errors << errors_.scale_var, errors_.cross, errors_.cross, errors_.bias_var;
    const Matrix32 J = way.jacobian(from);
    step_on(cov, way.x_m - from.x_m, way.y_m - from.y_m);
    Eigen::Map<Matrix3> sum(cov);
    sum += J * errors * J.transpose() + Eigen::Map<const Matrix3>(way.white);
    pose = {stamp_us, way.x_m, way.y_m, way.yaw_rad};
    return PoseMatch::found;
}

bool Odometry::learn(const StampedPose &from, const StampedPose &to, const float *cov)
{
    const std::lock_guard<std::mutex> lock(mutex_);
    Way way;
    if (from.stamp_us < learnt_us_ || from.stamp_us >= to.stamp_us) {
        return true;
    }
    const PoseMatch match = travel(from, to.stamp_us, way);
    if (match == PoseMatch::not_yet) {
        return false;
    }
    learnt_us_ = to.stamp_us;
    if (match == PoseMatch::found) {
        update(from, to, cov, way);
    }
    return true;
}

/// Update a Kalman filter whose state is the two constant errors (Thrun, Burgard and Fox 2005, sec.
/// 3.3). The measurement is the later pose. Its prediction is the earlier pose, carried on.
void Odometry::update(const StampedPose &from, const StampedPose &to, const float *cov,
                      const Way &way)
{
    const double fade = way.elapsed_s / kErrorLife_s;
    const double scale_var = config_.speed_scale_sd * config_.speed_scale_sd;
    const double bias_var = config_.yaw_rate_bias_sd * config_.yaw_rate_bias_sd;
    Eigen::Matrix2d P;
    P << std::min(errors_.scale_var + fade * scale_var, scale_var), errors_.cross, errors_.cross,
        std::min(errors_.bias_var + fade * bias_var, bias_var);
    PoseCov carried;
    std::copy_n(cov, 9, carried);
    step_on(carried, way.x_m - from.x_m, way.y_m - from.y_m);
    const Matrix32 H = way.jacobian(from);
    const Matrix3 S =
        H * P * H.transpose() + Eigen::Map<const Matrix3>(carried) +
        Eigen::Map<const Matrix3>(way.white) +
        Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(cov).cast<double>() +
        1e-9 * Matrix3::Identity(); // for poses whose covariance is given as 0
    const Matrix3 S_inverse = S.inverse();
    const Eigen::Vector3d y(to.x_m - way.x_m, to.y_m - way.y_m,
                            std::remainder(to.yaw_rad - way.yaw_rad, 2.0 * M_PI));
    if (!(y.dot(S_inverse * y) <= kGate)) {
        return;
    }
    const Eigen::Matrix<double, 2, 3> K = P * H.transpose() * S_inverse;
    const Eigen::Vector2d step = K * y;
    const Eigen::Matrix2d posterior = P - K * H * P;
    errors_ = {errors_.scale + step(0), errors_.bias_radps + step(1),
               std::max(posterior(0, 0), 0.0), 0.5 * (posterior(0, 1) + posterior(1, 0)),
               std::max(posterior(1, 1), 0.0)};
}

OdometryErrors Odometry::errors() const
{
    const std::lock_guard<std::mutex> lock(mutex_);
    return errors_;
}

} // namespace gpomd
