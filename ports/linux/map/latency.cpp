#include "ports/linux/map/latency.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gpomd
{

namespace
{

constexpr std::int64_t kLagStep_us = 20000;
constexpr std::int64_t kLagMax_us = 1000000;

/// Yaw is not interpolated over a longer gap between poses.
constexpr std::int64_t kPoseGap_us = 500000;

/// Two scans nearer in time turn too little. Two scans further apart see different things.
constexpr std::int64_t kPairMin_us = 45000;
constexpr std::int64_t kPairMax_us = 500000;

constexpr double kBin_rad = 2.0 * M_PI / Panorama::kBins;

/// Largest turn of a sensor between two scans, in bins.
constexpr int kShiftMax = 40;

/// Two scans must have this many bins in common.
constexpr int kCommonMin = 60;

/// Larger differences are limited to this value. They come from things that only one scan sees.
constexpr double kDifferenceMax_m = 0.5;

/// Two beams this near see one surface, so that ranges between them can be interpolated.
constexpr double kNeighbours_rad = 0.13;
constexpr float kSurface_m = 0.5f;

/// The difference of a pair's two turns is limited to this value [rad].
constexpr double kTurnOffMax_rad = 0.1;

/// kMemory: weight of a pair after each newer pair. kPairsMin: number of pairs before the estimate
/// is believed. kSure_s: standard deviation that the estimate must have [s].
constexpr double kMemory = 0.998;
constexpr double kPairsMin = 40.0;
constexpr double kSure_s = 0.01;

/// The poses must turn at least this far at some lag, or the pair says nothing.
constexpr double kTurnMin_rad = 0.01;

double seconds(std::int64_t time_us) { return 1e-6 * static_cast<double>(time_us); }

int wrapped(int bin)
{
    const int rest = bin % Panorama::kBins;
    return rest < 0 ? rest + Panorama::kBins : rest;
}

/// Position of the minimum of a parabola through three values one step apart, in steps from the
/// middle one.
double vertex(double before, double middle, double after)
{
    const double bend = before - 2.0 * middle + after;
    return bend > 0.0 ? 0.5 * (before - after) / bend : 0.0;
}

} // namespace

void YawTrack::push(std::int64_t stamp_us, double yaw_rad)
{
    if (n_ > 0) {
        const Turned &last = nth(n_ - 1);
        if (stamp_us <= last.stamp_us || stamp_us - last.stamp_us > kPoseGap_us) {
            n_ = 0;
        } else {
            yaw_rad = last.yaw_rad + std::remainder(yaw_rad - last.yaw_rad, 2.0 * M_PI);
        }
    }
    if (n_ == kMax) {
        first_ = (first_ + 1) % kMax;
        --n_;
    }
    ring_[(first_ + n_) % kMax] = {stamp_us, yaw_rad};
    ++n_;
}

bool YawTrack::has_reached(std::int64_t stamp_us) const
{
    return n_ > 0 && nth(n_ - 1).stamp_us >= stamp_us;
}

bool YawTrack::at(std::int64_t stamp_us, double &yaw_rad) const
{
    const std::size_t i =
        first_stamp_not_before(stamp_us, n_, [this](std::size_t k) { return nth(k).stamp_us; });
    if (i == n_ || (i == 0 && nth(0).stamp_us != stamp_us)) {
        return false;
    }
    const Turned &after = nth(i);
    const Turned &before = nth(i == 0 ? 0 : i - 1);
    const std::int64_t span_us = after.stamp_us - before.stamp_us;
    const double part = span_us > 0 ? seconds(stamp_us - before.stamp_us) / seconds(span_us) : 0.0;
    yaw_rad = before.yaw_rad + part * (after.yaw_rad - before.yaw_rad);
    return true;
}

void Panorama::take(const ScanSlot &slot, const gpom_sensor_t &sensor)
{
    std::fill_n(range_m, kBins, std::numeric_limits<float>::quiet_NaN());
    float last_m = 0.0f; // 0: the beam before had no return
    double last_rad = 0.0;
    for (std::uint32_t i = 0; i < slot.n_ranges; ++i) {
        const double bearing_rad = slot.is_per_beam ? static_cast<double>(slot.bearings_rad[i])
                                                    : slot.angle_min_rad + i * slot.angle_step_rad;
        const float reading_m = slot.ranges_m[i];
        const bool is_return = reading_m > 0.0f && reading_m >= sensor.range_min_m &&
                               reading_m < sensor.range_max_m; // false for NaN
        const int bin = static_cast<int>(std::lround(bearing_rad / kBin_rad));
        if (is_return) {
            range_m[wrapped(bin)] = reading_m;
        }
        if (is_return && last_m > 0.0f && std::fabs(reading_m - last_m) < kSurface_m &&
            std::fabs(bearing_rad - last_rad) < kNeighbours_rad) {
            const int last_bin = static_cast<int>(std::lround(last_rad / kBin_rad));
            const int step = bin > last_bin ? 1 : -1;
            for (int k = last_bin; k != bin; k += step) {
                const float part =
                    static_cast<float>(k - last_bin) / static_cast<float>(bin - last_bin);
                range_m[wrapped(k)] = last_m + part * (reading_m - last_m);
            }
        }
        last_m = is_return ? reading_m : 0.0f;
        last_rad = bearing_rad;
    }
}

/// Mean square of the differences, each at most kDifferenceMax_m. Infinite: too few bins in common.
double Panorama::difference(const Panorama &next, int shift) const
{
    double sum_m2 = 0.0;
    int n_common = 0;
    for (int i = 0; i < kBins; ++i) {
        const double off_m = static_cast<double>(range_m[i] - next.range_m[wrapped(i + shift)]);
        if (std::isfinite(off_m)) {
            sum_m2 += std::min(off_m * off_m, kDifferenceMax_m * kDifferenceMax_m);
            ++n_common;
        }
    }
    return n_common < kCommonMin ? std::numeric_limits<double>::infinity() : sum_m2 / n_common;
}

bool Panorama::turn_to(const Panorama &next, double &turn_rad) const
{
    double by_shift[2 * kShiftMax + 1];
    double sum = 0.0;
    for (int i = 0; i <= 2 * kShiftMax; ++i) {
        by_shift[i] = difference(next, i - kShiftMax);
        sum += by_shift[i];
    }
    const auto best =
        static_cast<int>(std::min_element(by_shift, by_shift + 2 * kShiftMax + 1) - by_shift);
    const double mean = sum / (2 * kShiftMax + 1);
    const bool is_inside = best > 0 && best < 2 * kShiftMax;
    if (!is_inside || !(by_shift[best] < 0.5 * mean) || !std::isfinite(mean)) {
        return false; // round walls look the same at each turn of the sensor
    }
    const double shift =
        best - kShiftMax + vertex(by_shift[best - 1], by_shift[best], by_shift[best + 1]);
    turn_rad = -shift * kBin_rad; // the view turns in the direction opposite to the sensor
    return true;
}

void Latency::begin_frame()
{
    track_.clear();
    n_pairs_ = 0;
}

void Latency::take_scan(const ScanSlot &slot)
{
    const std::int64_t since_us = slot.stamp_us - stamp_us_;
    if (has_panorama_ && since_us >= 0 && since_us < kPairMin_us) {
        return;
    }
    Panorama &next = panoramas_[1 - i_newest_];
    next.take(slot, *sensor_);
    double turn_rad = 0.0;
    if (has_panorama_ && since_us > 0 && since_us <= kPairMax_us && n_pairs_ < kPairsMax &&
        panoramas_[i_newest_].turn_to(next, turn_rad)) {
        const double sign = sensor_->upside_down != 0 ? -1.0 : 1.0;
        pairs_[n_pairs_++] = {stamp_us_, slot.stamp_us, sign * turn_rad};
    }
    has_panorama_ = true;
    stamp_us_ = slot.stamp_us;
    i_newest_ = 1 - i_newest_;
    settle_pairs();
}

/// Compare the pairs for which there are poses at all lags.
void Latency::settle_pairs()
{
    std::size_t n_settled = 0;
    while (n_settled < n_pairs_ && track_.has_reached(pairs_[n_settled].to_us + kLagMax_us)) {
        compare(pairs_[n_settled++]);
    }
    if (n_settled == 0 && n_pairs_ == kPairsMax) {
        n_settled = 1; // no poses come
    }
    std::copy(pairs_ + n_settled, pairs_ + n_pairs_, pairs_);
    n_pairs_ -= n_settled;
}

void Latency::compare(const Pair &pair)
{
    double turns_rad[kLags];
    double most_rad = 0.0;
    for (int i = 0; i < kLags; ++i) {
        const std::int64_t lag_us = i * kLagStep_us - kLagMax_us;
        double from_rad = 0.0, to_rad = 0.0;
        if (!track_.at(pair.from_us - lag_us, from_rad) ||
            !track_.at(pair.to_us - lag_us, to_rad)) {
            return;
        }
        turns_rad[i] = to_rad - from_rad;
        most_rad = std::max(most_rad, std::fabs(turns_rad[i]));
    }
    if (most_rad < kTurnMin_rad) {
        return;
    }
    n_compared_ = kMemory * n_compared_ + 1.0;
    for (int i = 0; i < kLags; ++i) {
        const double off_rad = std::min(std::fabs(pair.turn_rad - turns_rad[i]), kTurnOffMax_rad);
        squares_[i] = kMemory * squares_[i] + off_rad * off_rad;
    }
}

/// Take the lag with the least sum of squares. Its variance is the variance of the differences over
/// half of the second derivative of the sum, as for any least-squares estimate.
bool Latency::find(double &latency_s) const
{
    const auto best = static_cast<int>(std::min_element(squares_, squares_ + kLags) - squares_);
    if (n_compared_ < kPairsMin || best == 0 || best == kLags - 1) {
        return false;
    }
    const double before = squares_[best - 1], middle = squares_[best], after = squares_[best + 1];
    const double step_s = seconds(kLagStep_us);
    const double half_bend = 0.5 * (before - 2.0 * middle + after) / (step_s * step_s);
    const double variance_s2 = middle / n_compared_ / half_bend;
    const double worst = *std::max_element(squares_, squares_ + kLags);
    latency_s = seconds(best * kLagStep_us - kLagMax_us) + step_s * vertex(before, middle, after);
    return half_bend > 0.0 && variance_s2 < kSure_s * kSure_s && middle < 0.5 * worst;
}

} // namespace gpomd
