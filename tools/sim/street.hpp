// Simulated streets after the paper's recipe (sec. IV.A): main and side streets, alleys, buildings,
// parked cars and vans; a robot drives along them and scans. The map frame's origin is the area's
// lower left corner, x east, y north. All of it follows from the seed, on any platform.
#ifndef GPOM_TOOLS_SIM_STREET_HPP
#define GPOM_TOOLS_SIM_STREET_HPP

#include "ports/host/scan_log.hpp"
#include "tools/sim/truth.hpp"

#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace gpom_tools
{

/// Version of the recipe. Frozen: any change of the streets, drives or scans that a seed gives
/// takes a new number, since published results name recipe and seed.
constexpr int kStreetRecipe = 1;

struct StreetConfig {
    std::uint64_t seed = 0;
    double width_m = 150.0;
    double height_m = 120.0;
    int n_scans = 28;
    int n_beams = 17;
    double fov_deg = 180.0; ///< Centred about the heading.
    double range_max_m = 34.0;
    double range_noise_m = 0.05; ///< Standard deviation of the Gaussian range error.
    double step_m = 8.0;         ///< Way driven between scans.
    double truth_cell_m = 0.25;
    int cars_arrive_at = 0;      ///< Scan from which on vehicles are parked,
    int cars_leave_at = -1;      ///< and from which on they are gone; -1: they stay.
    bool there_and_back = false; ///< The second half of the drive is the first one backwards.
};

/// What is absurd about a config, in one sentence; empty if nothing.
std::string street_config_error(const StreetConfig &config);

/// `gpom-street recipe=.. seed=.. ...`: all that is needed to make the same files again.
std::string street_comment(const StreetConfig &config);

/// Uniform and Gaussian numbers from the raw bits of mt19937_64: what std's distributions make
/// of those bits differs between libraries. One stream for each purpose.
class StreetRandom {
public:
    enum class Stream : std::uint64_t { world = 1, drive = 2, noise = 3 };
    StreetRandom(std::uint64_t seed, Stream stream);
    double uniform(double low, double high);
    bool chance(double probability) { return uniform(0.0, 1.0) < probability; }
    double gaussian(); ///< Mean 0, standard deviation 1.

private:
    std::mt19937_64 bits_;
};

struct Rect {
    double x0_m, y0_m, x1_m, y1_m;
};

enum class StreetKind { main, side, alley };

/// A straight street: centre line at `centre` across, from `from` to `to` along.
struct Street {
    StreetKind kind;
    bool vertical; ///< Runs along y; else along x.
    double centre_m;
    double half_width_m; ///< Between the building lines on both sides.
    double from_m;
    double to_m;
};

struct StreetWorld {
    double width_m;
    double height_m;
    std::vector<Street> streets;
    std::vector<Rect> obstacles; ///< Buildings and vehicles, solid, clipped to the area.
    std::size_t n_buildings;     ///< They come first.
};

/// The same streets with no vehicle on them.
StreetWorld without_vehicles(StreetWorld world);

/// Whether vehicles are parked during a scan.
bool cars_are_parked(const StreetConfig &config, int i_scan);

struct StreetPose {
    double x_m, y_m, theta_rad;
};

/// Whether two streets at right angles meet or cross.
bool streets_meet(const Street &a, const Street &b);

StreetWorld make_street_world(const StreetConfig &config);

/// n_scans poses, one each step_m of the way, on the right of main and side streets. Back on a way,
/// the robot has turned round and keeps to the same lane.
std::vector<StreetPose> drive_streets(const StreetWorld &world, const StreetConfig &config);

/// A world's obstacles, sorted into square buckets.
class ObstacleGrid {
public:
    explicit ObstacleGrid(const StreetWorld &world);
    bool contains(double x_m, double y_m) const;
    /// Exact way to the first obstacle; infinite if none within range_max or inside the area.
    double first_hit_m(const StreetPose &beam, double range_max_m) const;

private:
    double bucket_hit_m(std::size_t bucket, const double origin[2],
                        const double direction[2]) const;
    std::size_t bucket_at(double x_m, double y_m) const;

    int n_[2]; ///< Buckets along x and y.
    std::vector<Rect> rects_;
    std::vector<std::size_t> bucket_start_; ///< Into rects_, one more than buckets.
};

/// A laser in a world, scan by scan, for drives that are too long to be kept. Poses and ranges are
/// rounded to the millimetre, the poses before the beams are cast, so that they are exact. The
/// world may change on the way.
class StreetLaser {
public:
    explicit StreetLaser(const StreetConfig &config);
    Scan scan(const ObstacleGrid &obstacles, const StreetPose &pose);

private:
    StreetConfig config_;
    StreetRandom random_;
    std::size_t n_scans_ = 0;
};

using ProgressCall = std::function<void(std::size_t n_done, std::size_t n_total)>;

/// Scans from the drive.
std::vector<Scan> simulate_scans(const StreetWorld &world, const StreetConfig &config,
                                 const ProgressCall &progress);

/// A cell is occupied if its centre lies in an obstacle.
Truth street_truth(const StreetWorld &world, double cell_m);

} // namespace gpom_tools

#endif
