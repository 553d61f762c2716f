// Gradients and rays on a log or a simulated street: how near rays come to brute force, how well
// they predict scans that are held out, and what both cost beside plain queries.
//
// usage: rays PARAMS.toml SCANS|street N_RAYS [live]
#include "ports/host/params_toml.hpp"
#include "tools/map/host_map.hpp"
#include "tools/sim/street.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>

using namespace gpom_tools;

namespace
{

constexpr double kPi = 3.14159265358979323846;
constexpr double kLength_m = 20.0;
constexpr std::size_t kHeldOutOf = 10;

struct Split {
    std::vector<Scan> mapped, held_out;
};

/// Every tenth scan of a log is held out; of a street, which has few, none.
Split split_scans(const char *name)
{
    if (std::strcmp(name, "street") == 0) {
        const StreetConfig street;
        return {simulate_scans(make_street_world(street), street, {}), {}};
    }
    Split split;
    const std::vector<Scan> all = read_scans(name, ReadOptions{});
    for (std::size_t i = 0; i < all.size(); ++i) {
        (i % kHeldOutOf == kHeldOutOf / 2 ? split.held_out : split.mapped).push_back(all[i]);
    }
    return split;
}

HostMap map_of(const gpom_params_t &params, const std::vector<Scan> &scans, bool is_live)
{
    const gpom_point_t origin = middle_of(scans);
    if (!is_live) {
        HostMap map(params, beam_count(scans), origin);
        map.insert(scans);
        return map;
    }
    const LiveConfig live;
    HostMap map(live_config(params, live, origin));
    for (const Scan &scan : scans) {
        map.insert(scan);
        map.step(live.step_ops);
    }
    map.build();
    return map;
}

std::vector<gpom_ray_t> follow(const HostMap &map, const gpom_fan_t &fan)
{
    std::vector<std::uint8_t> memory(gpom_ray_bytes(map.get()));
    const gpom_scratch_t scratch = {memory.data(), memory.size()};
    std::vector<gpom_ray_t> rays(fan.n_rays);
    const gpom_status_t status = gpom_ray_fan(map.get(), &fan, rays.data(), nullptr, &scratch);
    if (status == GPOM_ERR_ARG || status == GPOM_ERR_MEM) {
        std::fprintf(stderr, "rays: %s\n", gpom_status_str(status));
        std::exit(1);
    }
    return rays;
}

gpom_fan_t fan_of(double x_m, double y_m, double bearing_rad, std::uint32_t n_rays)
{
    return {x_m, y_m, bearing_rad, 2.0 * kPi / n_rays, n_rays, 0.5f, kLength_m, 0.0f, nullptr, 0};
}

/// First sample of a ray, each centimetre, at or above the threshold; else the length.
double brute_force_range(const HostMap &map, const gpom_fan_t &ray)
{
    std::vector<gpom_point_t> points;
    for (int i = 0; i <= 2000; ++i) {
        points.push_back({ray.x_m + 0.01 * i * std::cos(ray.bearing_rad),
                          ray.y_m + 0.01 * i * std::sin(ray.bearing_rad)});
    }
    const std::vector<gpom_answer_t> answers = map.query(points);
    for (std::size_t i = 0; i < answers.size(); ++i) {
        if (answers[i].probability >= ray.threshold) {
            return 0.01 * static_cast<double>(i);
        }
    }
    return kLength_m;
}

/// Rays from within half a metre of the scans' places, in any direction.
void compare_with_brute_force(const HostMap &map, const std::vector<Scan> &scans, int n)
{
    std::mt19937_64 bits(1);
    const auto uniform = [&bits](double low, double high) {
        return low + (high - low) * std::ldexp(static_cast<double>(bits() >> 11), -53);
    };
    int n_late = 0, n_early = 0, n_cut = 0;
    long n_evaluated = 0;
    for (int i = 0; i < n; ++i) {
        const Scan &scan = scans[bits() % scans.size()];
        const double x_m = scan.x_m + uniform(-0.5, 0.5);
        const double y_m = scan.y_m + uniform(-0.5, 0.5);
        const gpom_fan_t fan = fan_of(x_m, y_m, uniform(-kPi, kPi), 1);
        const gpom_ray_t ray = follow(map, fan)[0];
        const double late_m = static_cast<double>(ray.range_m) - brute_force_range(map, fan);
        n_late += late_m > 0.0101 ? 1 : 0;
        n_early += late_m < -0.0101 ? 1 : 0;
        n_cut += (ray.flags & GPOM_RAY_CUT) != 0 ? 1 : 0;
        n_evaluated += ray.n_evaluated;
    }
    std::printf("%d rays: %d more than 1 cm behind brute force, %d before it, %d cut; %.1f points "
                "a ray\n",
                n, n_late, n_early, n_cut, static_cast<double>(n_evaluated) / n);
}

void predict_held_out(const HostMap &map, const std::vector<Scan> &scans)
{
    std::vector<double> errors_m;
    for (const Scan &scan : scans) {
        gpom_fan_t fan = fan_of(scan.x_m, scan.y_m, scan.theta_rad + scan.angle_min_rad, 1);
        fan.bearing_step_rad = scan.angle_step_rad;
        fan.n_rays = static_cast<std::uint32_t>(scan.ranges_m.size());
        fan.length_m = scan.range_max_m;
        const std::vector<gpom_ray_t> rays = follow(map, fan);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const double range_m = static_cast<double>(scan.ranges_m[i]);
            if (range_m > 0.0 && range_m < scan.range_max_m) {
                errors_m.push_back(std::abs(static_cast<double>(rays[i].range_m) - range_m));
            }
        }
    }
    if (errors_m.empty()) {
        return;
    }
    std::sort(errors_m.begin(), errors_m.end());
    std::printf("%zu held-out scans, %zu ranges: median error %.4f m, 90 %% below %.3f m\n",
                scans.size(), errors_m.size(), errors_m[errors_m.size() / 2],
                errors_m[errors_m.size() * 9 / 10]);
}

template <class Call> double time_us(const Call &call)
{
    const auto begin = std::chrono::steady_clock::now();
    call();
    const std::chrono::duration<double, std::micro> taken =
        std::chrono::steady_clock::now() - begin;
    return taken.count();
}

/// Shortest of 100 interleaved runs each.
void compare_times(const HostMap &map, const std::vector<Scan> &scans)
{
    std::vector<gpom_point_t> points;
    const Scan &middle = scans[scans.size() / 2];
    for (int i = 0; i < 4096; ++i) {
        points.push_back({middle.x_m + 0.2 * (i % 64 - 32), middle.y_m + 0.2 * (i / 64 - 32)});
    }
    const gpom_fan_t fan = fan_of(middle.x_m, middle.y_m, 0.0, 180);
    double query_us = 1e12, gradient_us = 1e12, fan_us = 1e12;
    for (int i = 0; i < 100; ++i) {
        query_us = std::min(query_us, time_us([&] { (void)map.query(points); }));
        gradient_us = std::min(gradient_us, time_us([&] { (void)map.gradients(points); }));
        fan_us = std::min(fan_us, time_us([&] { (void)follow(map, fan); }));
    }
    long n_evaluated = 0;
    for (const gpom_ray_t &ray : follow(map, fan)) {
        n_evaluated += ray.n_evaluated;
    }
    std::printf(
        "4096 points: %.0f us; with derivatives %.2f of it; a fan of 180 rays: %.0f us, %ld "
        "points\n",
        query_us, gradient_us / query_us, fan_us, n_evaluated);
}

} // namespace

int main(int argc, char **argv)
{
    if (argc != 4 && argc != 5) {
        std::fprintf(stderr, "usage: rays PARAMS.toml SCANS|street N_RAYS [live]\n");
        return 2;
    }
    const Split split = split_scans(argv[2]);
    const HostMap map = map_of(read_params(argv[1]), split.mapped, argc == 5);
    std::printf("%u beams, %u lanes\n", gpom_map_beam_count(map.get()), gpom_lanes());
    compare_with_brute_force(map, split.mapped, std::atoi(argv[3]));
    predict_held_out(map, split.held_out);
    compare_times(map, split.mapped);
    return 0;
}
