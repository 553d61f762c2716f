// Simulated streets by the paper's recipe (sec. IV.A): main and side streets, alleys, buildings,
// parked cars and vans. A robot drives along them and scans. The map frame's origin is the area's
// lower left corner, x east, y north. Everything follows from the seed, the same on any platform.
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

/// Version of the recipe. It is frozen: any change of the streets, drives or scans of a seed needs
/// a new number, because published results name recipe and seed.
constexpr int kStreetRecipe = 1;

struct StreetConfig {
    std::uint64_t seed = 0;
    double width_m = 150.0;
    double height_m = 120.0;
    int n_scans = 28;
    int n_beams = 17;
    double fov_deg = 180.0; ///< Centred on the heading.
    double range_max_m = 34.0;
    double range_noise_m = 0.05; ///< Standard deviation of the Gaussian range error.
    double step_m = 8.0;         ///< Distance driven between scans.
    double truth_cell_m = 0.25;
    int cars_arrive_at = 0;      ///< First scan with parked vehicles.
    int cars_leave_at = -1;      ///< First scan without them again. -1: they stay.
    bool there_and_back = false; ///< The second half of the drive is the first half backwards.
};

/// One sentence about a setting that is out of range. Empty: all are good.
std::string street_config_error(const StreetConfig &config);

/// `gpom-street recipe=.. seed=.. ...`: all settings needed to make the same files again.
std::string street_comment(const StreetConfig &config);

/// Uniform and Gaussian numbers from the raw bits of mt19937_64. The distributions of std are not
/// used, because they differ between libraries. Each purpose has its own stream.
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

/// A straight street. `centre` is the position of its middle line, `from` and `to` are its ends.
struct Street {
    StreetKind kind;
    bool vertical; ///< The street runs along y. False: along x.
    double centre_m;
    double half_width_m; ///< Half of the distance between the building lines.
    double from_m;
    double to_m;
};

struct StreetWorld {
    double width_m;
    double height_m;
    std::vector<Street> streets;
    std::vector<Rect> obstacles; ///< Buildings and vehicles, solid, clipped to the area. Buildings
                                 ///< come first.
    std::size_t n_buildings;     ///< Number of buildings.
};

/// The same world without vehicles.
StreetWorld without_vehicles(StreetWorld world);

/// True if vehicles are parked during a scan.
bool cars_are_parked(const StreetConfig &config, int i_scan);

struct StreetPose {
    double x_m, y_m, theta_rad;
};

/// True if two streets at right angles meet or cross.
bool streets_meet(const Street &a, const Street &b);

StreetWorld make_street_world(const StreetConfig &config);

/// n_scans poses, one every step_m of the way, on the right-hand side of main and side streets. On
/// the way back the robot has turned round but keeps the same lane.
std::vector<StreetPose> drive_streets(const StreetWorld &world, const StreetConfig &config);

/// The obstacles of a world, sorted into square buckets.
class ObstacleGrid {
public:
    explicit ObstacleGrid(const StreetWorld &world);
    bool contains(double x_m, double y_m) const;
    /// Exact distance to the first obstacle. Infinite if there is none within range_max and inside
    /// the area.
    double first_hit_m(const StreetPose &beam, double range_max_m) const;

private:
    double bucket_hit_m(std::size_t bucket, const double origin[2],
                        const double direction[2]) const;
    std::size_t bucket_at(double x_m, double y_m) const;

    int n_[2]; ///< Number of buckets along x and y.
    std::vector<Rect> rects_;
    std::vector<std::size_t> bucket_start_; ///< Start of each bucket in rects_, and the end of the
                                            ///< last one.
};

/// A laser in a world that makes scans one by one, for drives that are too long to be stored. Poses
/// and ranges are rounded to the millimetre. Poses are rounded before the beams are cast, so they
/// are exact. The world may change during the drive.
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

/// The scans of the whole drive.
std::vector<Scan> simulate_scans(const StreetWorld &world, const StreetConfig &config,
                                 const ProgressCall &progress);

/// The raster of a world. A cell is occupied if its centre lies in an obstacle.
Truth street_truth(const StreetWorld &world, double cell_m);

} // namespace gpom_tools

#endif
