// Maps to measure on, each in its own memory, and places in them.
#ifndef GPOM_BENCH_PLACE_HPP
#define GPOM_BENCH_PLACE_HPP

#include "gpom/gpom.h"
#include "ports/host/params_toml.hpp"
#include "src/map/map.hpp"
#include "tools/sim/street.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace gpom_bench
{

using gpom_tools::Scan;

inline void require(gpom_status_t status)
{
    if (status != GPOM_OK) {
        throw std::runtime_error(gpom_status_str(status));
    }
}

/// Hyperparameters of a kernel with n neighbours. Half of them are hits.
inline gpom_params_t params_of(const std::string &kernel, std::size_t n)
{
    gpom_params_t params = gpom_tools::read_params("tests/golden/params_" + kernel + "_query.toml");
    params.n_hits = params.n_free = static_cast<std::uint16_t>(n / 2);
    return params;
}

/// Contents of a map: the street repeated `tiles` times in each direction, with scans of `n_beams`.
struct Data {
    const char *name;
    int tiles, n_scans, n_beams;
    double step_m;
    float keep_m; ///< 0: every beam is kept.
    const char *kernel = "matern12";
    float late_m = 0.0f; ///< Cells of gpom_map_begin_late(). 0: no beam begins late.
};

constexpr Data kSparse = {"sparse", 1, 28, 17, 8.0, 0.0f};
constexpr Data kPaper = {"sparse-nn", 1, 28, 17, 8.0, 0.0f, "nn"};
constexpr Data kWide[] = {{"wide-12k", 5, 28, 17, 8.0, 0.0f}, {"wide-500k", 33, 28, 17, 8.0, 0.0f}};
constexpr Data kDense = {"dense-50k", 1, 280, 181, 0.8, 0.0f};
constexpr Data kDenseLate = {"dense-50k-late", 1, 280, 181, 0.8, 0.0f, "matern12", 0.05f};
constexpr Data kThinned = {"thinned-50k", 1, 280, 181, 0.8, 0.5f};

inline std::vector<Scan> scans_of(const Data &data, gpom_tools::StreetConfig &street)
{
    street.n_scans = data.n_scans;
    street.n_beams = data.n_beams;
    street.step_m = data.step_m;
    const std::vector<Scan> one =
        gpom_tools::simulate_scans(gpom_tools::make_street_world(street), street, {});
    std::vector<Scan> all;
    for (int tile = 0; tile < data.tiles * data.tiles; ++tile) {
        for (Scan scan : one) {
            scan.x_m += (tile % data.tiles) * street.width_m;
            scan.y_m += (tile / data.tiles) * street.height_m;
            all.push_back(scan);
        }
    }
    return all;
}

/// A map in the caller's memory, and places in its middle tile.
class Place {
public:
    Place(const Data &data, const gpom_params_t &params)
        : scans_(scans_of(data, street_)), params_(params), late_m_(data.late_m)
    {
        gpom_config_init(&config_);
        config_.params = params_;
        config_.keep_m = data.keep_m;
        config_.beam_max =
            static_cast<std::uint32_t>(scans_.size()) * static_cast<std::uint32_t>(street_.n_beams);
        middle_ = {street_.width_m * (data.tiles / 2), street_.height_m * (data.tiles / 2)};
        memory_.resize(gpom_map_bytes(&config_) / 8 + 1);
        clear();
        for (std::size_t i = 0; i < scans_.size(); ++i) {
            insert(i);
        }
        require(gpom_map_build(map_));
        scratch_memory_.resize(gpom_scratch_bytes(map_));
    }

    void clear()
    {
        require(gpom_map_init(&map_, &config_, memory_.data(), 8 * memory_.size()));
        require(gpom_map_begin_late(map_, late_m_));
    }

    void insert(std::size_t i)
    {
        const Scan &scan = scans_[i];
        gpom_sensor_t sensor;
        gpom_sensor_init(&sensor);
        sensor.range_max_m = static_cast<float>(scan.range_max_m);
        const gpom_pose_t pose = {scan.x_m, scan.y_m, scan.theta_rad, nullptr};
        const gpom_scan_t readings = {static_cast<std::int64_t>(i) * 100000, scan.angle_min_rad,
                                      scan.angle_step_rad, scan.ranges_m.data(),
                                      static_cast<std::uint32_t>(scan.ranges_m.size())};
        require(gpom_scan_insert(map_, &readings, &sensor, &pose));
    }

    /// Corner of the i-th patch. The patches are spread over the middle tile.
    gpom_point_t corner(std::size_t i) const
    {
        const double k = static_cast<double>(i % 64);
        return {middle_.x_m + std::fmod(5.5 + 37.0 * k, street_.width_m - 10.0),
                middle_.y_m + std::fmod(3.5 + 53.0 * k, street_.height_m - 10.0)};
    }

    gpom::Offset<float> offset(const gpom_point_t &p) const
    {
        return {static_cast<float>(p.x_m), static_cast<float>(p.y_m)};
    }

    gpom_map_t *map() { return map_; }
    const gpom::Index &index() const { return map_->index; }
    const gpom_params_t &params() const { return params_; }
    std::size_t n_scans() const { return scans_.size(); }
    gpom_scratch_t scratch() { return {scratch_memory_.data(), scratch_memory_.size()}; }
    double bytes_per_beam() const
    {
        return static_cast<double>(gpom_map_bytes(&config_)) / config_.beam_max;
    }

private:
    gpom_tools::StreetConfig street_;
    std::vector<Scan> scans_;
    gpom_params_t params_;
    float late_m_;
    gpom_config_t config_;
    gpom_point_t middle_ = {};
    std::vector<std::uint64_t> memory_;
    std::vector<std::uint8_t> scratch_memory_;
    gpom_map_t *map_ = nullptr;
};

} // namespace gpom_bench

#endif
