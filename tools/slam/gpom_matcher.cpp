#include "tools/slam/gpom_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace gpom_tools
{

GpomMatcher::GpomMatcher(const gpom_config_t &config, const GpomMatcherOptions &options)
    : map_(config), options_(options), scratch_(GPOM_ALIGN_BYTES(options.align.n_returns_max))
{
}

Matched GpomMatcher::match(const Scan &scan, const PredictedPose &predicted)
{
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    sensor.range_min_m = 0.2f;
    sensor.range_max_m = static_cast<float>(scan.range_max_m);
    const MotionModel &motion = options_.motion;
    const auto var_of = [&](const double(&sd)[3]) {
        const double sum =
            sd[0] + sd[1] * predicted.moved_m + sd[2] * std::abs(predicted.turned_rad);
        return static_cast<float>(sum * sum);
    };
    const float place_var = var_of(motion.place);
    const float cov[9] = {place_var, 0, 0, 0, place_var, 0, 0, 0, var_of(motion.yaw)};
    const gpom_align_task_t task = {
        &sensor,
        {predicted.pose.x_m, predicted.pose.y_m, predicted.pose.yaw_rad, cov},
        &options_.align};
    const gpom_scan_t readings = {0, scan.angle_min_rad, scan.angle_step_rad, scan.ranges_m.data(),
                                  static_cast<std::uint32_t>(scan.ranges_m.size())};
    const gpom_scratch_t scratch = {scratch_.data(), scratch_.size()};
    gpom_alignment_t found;
    const gpom_status_t status = gpom_scan_align(map_.get(), &readings, &task, &found, &scratch);
    if (status != GPOM_OK) {
        throw std::runtime_error("align: " + std::string(gpom_status_str(status)));
    }
    Matched matched;
    matched.pose = {found.x_m, found.y_m, found.yaw_rad};
    matched.flags = found.flags;
    matched.is_doubtful = (found.flags & GPOM_ALIGN_DOUBTFUL) != 0;
    matched.residual_m = double{found.residual_m};
    matched.n_returns = found.n_returns;
    matched.n_matched = found.n_matched;
    matched.n_new = found.n_new;
    matched.weak_sd_m = double{found.weak_sd_m};
    matched.weak_sd_rad = double{found.weak_sd_rad};
    matched.n_searches = found.n_searches;
    for (int i = 0; i < 9; ++i) {
        matched.cov(i / 3, i % 3) = double{found.cov[i]};
    }
    return matched;
}

void GpomMatcher::insert(const Scan &scan, const Matched &at)
{
    Scan placed = scan;
    placed.x_m = at.pose.x_m;
    placed.y_m = at.pose.y_m;
    placed.theta_rad = at.pose.yaw_rad;
    const Eigen::Matrix3f by_rows = at.cov.cast<float>(); // symmetric
    map_.insert(placed, options_.inserts_cov ? by_rows.data() : nullptr);
    map_.step(options_.step_ops);
}

std::size_t GpomMatcher::n_beams() const { return gpom_map_beam_count(map_.get()); }

} // namespace gpom_tools
