#include "tools/slam/starts.hpp"

#include <cmath>
#include <random>

namespace gpom_tools
{

namespace
{

constexpr double kDegree = M_PI / 180.0;

Start try_start(const DrivenScan &scan, std::size_t i_scan, const StartOffset &off,
                double direction_rad, Matcher &matcher)
{
    const Pose right = *scan.corrected;
    const Pose start =
        right * Pose{std::abs(off.place_m) * std::cos(direction_rad),
                     std::abs(off.place_m) * std::sin(direction_rad), off.yaw_deg * kDegree};
    const Matched found =
        matcher.match(scan.scan, {start, std::abs(off.place_m), std::abs(off.yaw_deg) * kDegree});
    const Pose error = between_poses(right, found.pose);
    Start result = {i_scan, off, found, error.distance_m(), std::abs(error.yaw_rad) / kDegree};
    const Eigen::Vector3d e(found.pose.x_m - right.x_m, found.pose.y_m - right.y_m, error.yaw_rad);
    if (!found.cov.isZero(0.0)) {
        result.nees = e.dot(found.cov.ldlt().solve(e));
    }
    return result;
}

} // namespace

std::vector<Start> try_starts(const std::vector<DrivenScan> &log, Matcher &matcher,
                              const StartOptions &options)
{
    std::vector<Start> starts;
    std::mt19937 bits(options.seed);
    std::size_t n_corrected = 0;
    for (std::size_t i = 0; i < log.size(); ++i) {
        if (!log[i].corrected) {
            continue;
        }
        if (n_corrected > options.skip && n_corrected % options.every == 0) {
            for (StartOffset off : kOffsets) {
                const double direction_rad =
                    2.0 * M_PI * static_cast<double>(bits() >> 8) * 0x1p-24;
                off.yaw_deg *= (bits() & 1u) != 0 ? 1.0 : -1.0;
                starts.push_back(try_start(log[i], i, off, direction_rad, matcher));
            }
        }
        Matched at;
        at.pose = *log[i].corrected;
        matcher.insert(log[i].scan, at);
        ++n_corrected;
    }
    return starts;
}

} // namespace gpom_tools
