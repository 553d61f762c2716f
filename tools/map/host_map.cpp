#include "tools/map/host_map.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace gpom_tools
{

namespace
{

void require(gpom_status_t status, const std::string &what)
{
    if (status != GPOM_OK) {
        throw std::runtime_error(what + ": " + gpom_status_str(status));
    }
}

/// Throw if a query failed. Bad pivots and cut searches are flags of single answers, not a failure
/// of the query.
void require_answers(gpom_status_t status)
{
    if (status != GPOM_ERR_PIVOT && status != GPOM_ERR_CUT) {
        require(status, "query");
    }
}

} // namespace

gpom_config_t whole_config(const gpom_params_t &params, std::size_t beam_max, gpom_point_t origin)
{
    gpom_config_t config;
    gpom_config_init(&config);
    config.params = params;
    config.beam_max = static_cast<std::uint32_t>(
        std::min<std::size_t>(beam_max, static_cast<std::size_t>(UINT32_MAX)));
    config.origin_x_m = origin.x_m;
    config.origin_y_m = origin.y_m;
    return config;
}

gpom_config_t live_config(const gpom_params_t &params, const LiveConfig &live, gpom_point_t origin)
{
    gpom_config_t config = whole_config(params, live.beam_max, origin);
    config.keep_m = live.keep_m;
    config.clear_scans = live.clear_scans;
    return config;
}

HostMap::HostMap(const gpom_config_t &config, float late_m) : map_bytes_(gpom_map_bytes(&config))
{
    const char *problem = nullptr;
    if (gpom_config_check(&config, &problem) != GPOM_OK) {
        throw std::runtime_error("map: " +
                                 std::string(problem != nullptr ? problem : "bad parameters"));
    }
    memory_ = std::make_unique<std::uint64_t[]>((map_bytes_ + 7) / 8);
    require(gpom_map_init(&map_, &config, memory_.get(), map_bytes_), "map");
    require(gpom_map_begin_late(map_, late_m), "late starts");
    scratch_ = std::make_unique<std::uint8_t[]>(gpom_scratch_bytes(map_));
}

void HostMap::insert(const Scan &scan, const float *pose_cov)
{
    gpom_sensor_t sensor;
    gpom_sensor_init(&sensor);
    sensor.range_min_m = 0.0f; // read_scans() has already handled near readings
    sensor.range_max_m = static_cast<float>(scan.range_max_m);
    const gpom_pose_t pose = {scan.x_m, scan.y_m, scan.theta_rad, pose_cov};
    const gpom_scan_t readings = {stamp_us(scan), scan.angle_min_rad, scan.angle_step_rad,
                                  scan.ranges_m.data(),
                                  static_cast<std::uint32_t>(scan.ranges_m.size())};
    const gpom_status_t status = gpom_scan_insert(map_, &readings, &sensor, &pose);
    if (status != GPOM_OK) { // the text is made only then: insertion is measured through here
        require(status, "scan at t = " + std::to_string(scan.t_s) + " s");
    }
}

void HostMap::insert(const std::vector<Scan> &scans)
{
    for (const Scan &scan : scans) {
        insert(scan);
    }
    build();
}

void HostMap::build() { require(gpom_map_build(map_), "build"); }

gpom_repose_report_t HostMap::repose(const std::vector<gpom_correction_t> &corrections)
{
    gpom_repose_report_t report;
    require(gpom_map_repose(map_, corrections.data(), corrections.size(), &report), "repose");
    return report;
}

gpom_import_report_t HostMap::import(const std::vector<gpom_beam_t> &beams, const gpom_pose_t &from,
                                     const gpom_pose_t &to)
{
    const gpom_frames_t frames = {from, to};
    gpom_import_report_t report;
    require(gpom_map_import_beams(map_, beams.data(), beams.size(), &frames, &report), "import");
    return report;
}

void HostMap::jump(gpom_jump_t rule) { require(gpom_map_jump(map_, rule, nullptr), "jump"); }

std::uint64_t HostMap::step(std::uint64_t budget)
{
    std::uint64_t used = 0;
    const gpom_scratch_t memory = scratch();
    require(gpom_map_step(map_, budget, &memory, &used), "step");
    return used;
}

std::vector<gpom_answer_t> HostMap::query(const std::vector<gpom_point_t> &points) const
{
    std::vector<gpom_answer_t> answers(points.size());
    const gpom_scratch_t memory = scratch();
    require_answers(gpom_query_points(map_, points.data(), points.size(), answers.data(), &memory));
    return answers;
}

std::vector<gpom_answer_t> HostMap::query(const gpom_raster_t &raster) const
{
    std::vector<gpom_answer_t> answers(static_cast<std::size_t>(raster.nx) * raster.ny);
    const gpom_scratch_t memory = scratch();
    require_answers(gpom_query_raster(map_, &raster, answers.data(), &memory));
    return answers;
}

std::vector<gpom_gradient_t> HostMap::gradients(const std::vector<gpom_point_t> &points) const
{
    std::vector<gpom_gradient_t> gradients(points.size());
    std::vector<std::uint8_t> memory(gpom_gradient_bytes(map_));
    const gpom_scratch_t scratch = {memory.data(), memory.size()};
    require_answers(
        gpom_query_gradients(map_, points.data(), points.size(), gradients.data(), &scratch));
    return gradients;
}

std::vector<double> HostMap::probabilities(const std::vector<gpom_point_t> &points) const
{
    std::vector<double> probabilities;
    for (const gpom_answer_t &answer : query(points)) {
        probabilities.push_back(double{answer.probability});
    }
    return probabilities;
}

gpom_path_result_t HostMap::query(const gpom_path_t &path) const
{
    gpom_path_result_t result;
    const gpom_scratch_t memory = scratch();
    require_answers(gpom_path_query(map_, &path, &result, &memory));
    return result;
}

gpom_stats_t HostMap::stats() const
{
    gpom_stats_t stats;
    require(gpom_map_stats(map_, &stats), "stats");
    return stats;
}

std::vector<gpom_cell_t> HostMap::cells() const
{
    gpom_lowres_info_t info;
    require(gpom_lowres_info(map_, GPOM_LAYER_COARSE, &info), "cells");
    const std::uint32_t n_cells = info.raster.nx * info.raster.ny;
    std::vector<gpom_cell_t> cells(n_cells);
    require(gpom_lowres_copy(map_, GPOM_LAYER_COARSE, cells.data(), n_cells, &info), "cells");
    return cells;
}

std::vector<gpom_beam_t> HostMap::kept() const
{
    std::vector<gpom_beam_t> beams;
    for (std::uint32_t i = 0; i < gpom_map_slot_count(map_); ++i) {
        gpom_beam_t beam;
        require(gpom_map_beam(map_, i, &beam), "beam");
        if (beam.is_hit != 0 || beam.is_free != 0) {
            beams.push_back(beam);
        }
    }
    return beams;
}

gpom_scratch_t HostMap::scratch() const { return {scratch_.get(), gpom_scratch_bytes(map_)}; }

std::int64_t stamp_us(const Scan &scan)
{
    return static_cast<std::int64_t>(std::llround(scan.t_s * 1e6));
}

std::size_t beam_count(const std::vector<Scan> &scans)
{
    std::size_t n = 0;
    for (const Scan &scan : scans) {
        n += scan.ranges_m.size();
    }
    return n;
}

gpom_point_t middle_of(const std::vector<Scan> &scans)
{
    const auto by_x = [](const Scan &a, const Scan &b) { return a.x_m < b.x_m; };
    const auto by_y = [](const Scan &a, const Scan &b) { return a.y_m < b.y_m; };
    const auto x = std::minmax_element(scans.begin(), scans.end(), by_x);
    const auto y = std::minmax_element(scans.begin(), scans.end(), by_y);
    return {std::round(0.5 * (x.first->x_m + x.second->x_m)),
            std::round(0.5 * (y.first->y_m + y.second->y_m))};
}

} // namespace gpom_tools
