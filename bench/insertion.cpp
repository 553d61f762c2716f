// Times insertion into a live map that keeps 20,000 beams. After each scan nanoflann searches the 8
// nearest of as many hits, once for each beam of the scan, so that both times come from the same
// run.
#include "ports/host/file_error.hpp"
#include "ports/host/params_toml.hpp"
#include "src/map/map.hpp"
#include "tools/live/drive.hpp"

#include <nanoflann.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>

using namespace gpom_tools;

namespace
{

using Clock = std::chrono::steady_clock;

constexpr std::size_t kNearest = 8;

/// The kept hits in the form that nanoflann needs.
struct Cloud {
    std::vector<gpom::Point> points;

    std::size_t kdtree_get_point_count() const { return points.size(); }
    float kdtree_get_pt(std::size_t i, std::size_t axis) const
    {
        return axis == 0 ? points[i].x_m : points[i].y_m;
    }
    template <class Box> bool kdtree_get_bbox(Box &) const { return false; }
};

/// Where the beams of a scan end, relative to the map's origin. A beam without return ends at the
/// greatest range.
std::vector<gpom::Point> ends_of(const gpom_map_t &map, const Scan &scan)
{
    std::vector<gpom::Point> ends;
    for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
        const double range_m = std::fmin(double{scan.ranges_m[i]}, scan.range_max_m);
        const double bearing_rad =
            scan.theta_rad + scan.angle_min_rad + static_cast<double>(i) * scan.angle_step_rad;
        ends.push_back(
            {static_cast<float>(scan.x_m - map.config.origin_x_m + range_m * std::cos(bearing_rad)),
             static_cast<float>(scan.y_m - map.config.origin_y_m +
                                range_m * std::sin(bearing_rad))});
    }
    return ends;
}

/// nanoflann's tree over the hits that were kept when the first scan of the first run was measured.
/// It is not built again, and its building is not measured.
class Rival {
public:
    double search_s(const gpom_map_t &map, const Scan &scan)
    {
        if (!tree_) {
            build(map);
        }
        const std::vector<gpom::Point> ends = ends_of(map, scan);
        std::uint32_t found[kNearest];
        float d2[kNearest];
        const Clock::time_point start = Clock::now();
        for (const gpom::Point &end : ends) {
            const float query[] = {end.x_m, end.y_m};
            sum_ += tree_->knnSearch(query, kNearest, found, d2);
        }
        return std::chrono::duration<double>(Clock::now() - start).count();
    }

    /// Number of hits that all searches found. Its use keeps the compiler from leaving them out.
    std::size_t n_found() const { return sum_; }

private:
    using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>,
                                                     Cloud, 2, std::uint32_t>;

    void build(const gpom_map_t &map)
    {
        for (std::uint32_t slot = 0; slot < map.index.n_slots; ++slot) {
            if (gpom::HitPart::is_seen(map.index.beams[slot])) {
                cloud_.points.push_back(gpom::end_of(map.index.beams[slot]));
            }
        }
        tree_ = std::make_unique<Tree>(2, cloud_, nanoflann::KDTreeSingleIndexAdaptorParams(16));
    }

    Cloud cloud_;
    std::unique_ptr<Tree> tree_;
    std::size_t sum_ = 0;
};

} // namespace

// usage: bench-insertion PARAMS.toml BEAM_MAX OUT.json
int main(int argc, char **argv)
{
    if (argc != 4) {
        std::fputs("usage: bench-insertion PARAMS.toml BEAM_MAX OUT.json\n", stderr);
        return 2;
    }
    try {
        Rival rival;
        InsertBench bench{default_drive()};
        bench.drive.params = read_params(argv[1]);
        bench.drive.live.keep_m = 0.1f;
        bench.drive.live.beam_max = static_cast<std::uint32_t>(std::stoul(argv[2]));
        bench.rival_s = [&rival](const gpom_map_t &map, const Scan &scan) {
            return rival.search_s(map, scan);
        };
        nlohmann::ordered_json report = insert_report(bench);
        const double insert_us = report["insert"]["us_mean"];
        const double nanoflann_us = report["rival"]["us_mean"];
        report["rival"]["n_found"] = rival.n_found();
        report["of_nanoflann"] = insert_us / nanoflann_us;
        replace_files({{argv[3], report.dump(1) + "\n"}});
    } catch (const std::exception &error) {
        std::fprintf(stderr, "bench-insertion: %s\n", error.what());
        return 2;
    }
    return 0;
}
