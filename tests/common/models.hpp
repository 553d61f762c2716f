/// \file models.hpp
/// A map of the yard, places in it, and hyperparameters of every kind, for tests of queries.
#pragma once

#include "tests/common/reference.hpp"

namespace reference
{

constexpr int kScans = 5;

/// A map of 250 beams of the yard, built, half built or not built at all.
enum class Built { no, half, yes };

inline void fill(TestMap &map, Built built)
{
    Random random(110);
    for (int i = 0; i < kScans; ++i) {
        if (built == Built::half && i == 3) {
            REQUIRE(gpom_map_build(map.get()) == GPOM_OK);
        }
        REQUIRE(yard_scan(random, i, {0, 0}).insert_into(map.get()) == GPOM_OK);
    }
    if (built == Built::yes) {
        REQUIRE(gpom_map_build(map.get()) == GPOM_OK);
    }
}

/// Random places in the yard, on its sensors and its hits, and far from it.
inline std::vector<gpom_point_t> yard_points(const TestMap &map, std::size_t n)
{
    std::vector<gpom_point_t> points = random_points(111, n, 16.0, {6.0, 0.0});
    const std::vector<gpom_beam_t> beams = map.beams();
    for (std::size_t i = 0; i < beams.size(); i += 29) {
        points.push_back({beams[i].x_m, beams[i].y_m});
        points.push_back({beams[i].x_m + static_cast<double>(beams[i].range_m * beams[i].dir_x),
                          beams[i].y_m + static_cast<double>(beams[i].range_m * beams[i].dir_y)});
    }
    points.push_back({400.0, -300.0});
    return points;
}

template <class Fn> void for_all_kernels_and_frames(Fn f)
{
    GPOM_TELL_SEED();
    for (const gpom_kernel_t which : kKernels) {
        for (const gpom_frame_t frame : kFrames) {
            INFO("kernel ", std::string(kKernelNames[which]));
            CAPTURE(frame);
            f(params_of(which, frame));
        }
    }
}

/// With all that goes beyond the paper's model.
inline gpom_params_t with_additions(gpom_params_t p)
{
    p.scan_points_max = 2;
    p.depth_m = 0.4f;
    p.anisotropy = p.frame == GPOM_FRAME_MAP ? 0.0f : 0.6f;
    p.vote = 0.5f;
    p.log_hit_first = -0.1f;
    p.log_hit_last = 0.05f;
    p.log_free_first = 0.1f;
    p.log_free_last = -0.05f;
    p.fade_m = p.frame == GPOM_FRAME_MAP ? 0.0f : 9.0f;
    p.beta_far = p.frame == GPOM_FRAME_MAP ? 0.0f : 0.2f;
    p.n_fading = 3;
    return p;
}

/// The above, each setting plain and with all additions.
template <class Fn> void for_all_models(Fn f)
{
    for_all_kernels_and_frames([&f](const gpom_params_t &p) {
        f(p);
        f(with_additions(p));
    });
}

} // namespace reference
