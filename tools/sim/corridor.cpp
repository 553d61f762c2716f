#include "tools/sim/corridor.hpp"

#include <cmath>

namespace gpom_tools
{
namespace
{

constexpr double kPi = 3.14159265358979323846;

// All lengths are in metres. The seed then moves everything.
constexpr double kWidth = 13.2, kHeight = 6.0; ///< Size of the area.
constexpr double kOuterWall = 0.3;             ///< Thickness of the wall around the area.
constexpr double kLow = 0.5, kRight = 12.5;    ///< The corridor's lower wall, and its right end.
constexpr double kWallLow = 2.5, kWallHigh = 2.62;
constexpr double kRoomsTop = 5.4;
constexpr double kBetweenRooms[2] = {4.5, 8.5}; ///< Where the walls between rooms begin. They have
                                                ///< the same thickness.
constexpr double kDoorWidth[3] = {0.7, 0.8, 0.9};
constexpr double kDoorCentre[3] = {2.1, 6.3, 11.1};
constexpr double kFrameWidth = 0.06;  ///< Width of each side of a door frame, along the wall.
constexpr double kFrameProud = 0.015; ///< How far the frame stands out on both faces of the wall.

constexpr double kLane = 1.5; ///< The robot's lane in the middle of the corridor.
constexpr double kWayFrom = 1.1, kWayTo = 11.9;
constexpr double kInRoom = 4.0; ///< How far the robot drives into the rooms.
constexpr double kStep = 0.1;
constexpr double kTurnStep_rad = kPi / 18.0; ///< Turn between two scans, when the robot turns on
                                             ///< the spot.
constexpr double kPeriod_s = 0.2;

double whole_millimetres(double value_m) { return std::round(value_m * 1e3) / 1e3; }

/// Add the wall between corridor and rooms, with doors and frames.
void add_door_wall(Corridor &corridor)
{
    std::vector<Rect> &walls = corridor.world.obstacles;
    double from_m = kLow;
    for (std::size_t i = 0; i < 3; ++i) {
        const double half_m = 0.5 * kDoorWidth[i];
        const double left_m = kDoorCentre[i] - half_m, right_m = kDoorCentre[i] + half_m;
        const double low_m = kWallLow - kFrameProud, high_m = kWallHigh + kFrameProud;
        walls.push_back({from_m, kWallLow, left_m, kWallHigh});
        walls.push_back({left_m - kFrameWidth, low_m, left_m, high_m});
        walls.push_back({right_m, low_m, right_m + kFrameWidth, high_m});
        corridor.doors.push_back({kDoorWidth[i], {kDoorCentre[i], 0.5 * (kWallLow + kWallHigh)}});
        from_m = right_m;
    }
    walls.push_back({from_m, kWallLow, kRight, kWallHigh});
    corridor.wall = {kLow, kWallLow, kRight, kWallHigh};
}

void add_other_walls(std::vector<Rect> &walls)
{
    const double left_m = kLow - kOuterWall, right_m = kRight + kOuterWall;
    walls.push_back({left_m, kLow - kOuterWall, right_m, kLow});
    walls.push_back({left_m, kRoomsTop, right_m, kRoomsTop + kOuterWall});
    walls.push_back({left_m, kLow, kLow, kRoomsTop});
    walls.push_back({kRight, kLow, right_m, kRoomsTop});
    for (const double x_m : kBetweenRooms) {
        walls.push_back({x_m, kWallHigh, x_m + kWallHigh - kWallLow, kRoomsTop});
    }
}

/// Turn on the spot towards the next corner, then drive to it in equal steps of at most kStep.
std::vector<StreetPose> drive(const std::vector<gpom_point_t> &corners)
{
    double theta_rad = 0.0;
    std::vector<StreetPose> poses{{corners[0].x_m, corners[0].y_m, theta_rad}};
    for (std::size_t i = 1; i < corners.size(); ++i) {
        const double dx_m = corners[i].x_m - corners[i - 1].x_m;
        const double dy_m = corners[i].y_m - corners[i - 1].y_m;
        const double turn_rad = std::remainder(std::atan2(dy_m, dx_m) - theta_rad, 2.0 * kPi);
        const double n_turns = std::ceil(std::fabs(turn_rad) / kTurnStep_rad - 1e-9);
        for (double k = 1.0; k <= n_turns; ++k) {
            poses.push_back(
                {corners[i - 1].x_m, corners[i - 1].y_m, theta_rad + turn_rad * k / n_turns});
        }
        theta_rad += turn_rad;
        const double n_steps = std::ceil(std::hypot(dx_m, dy_m) / kStep - 1e-9);
        for (double k = 1.0; k <= n_steps; ++k) {
            poses.push_back({corners[i - 1].x_m + dx_m * k / n_steps,
                             corners[i - 1].y_m + dy_m * k / n_steps, theta_rad});
        }
    }
    return poses;
}

void add_drives(Corridor &corridor)
{
    const gpom_point_t from = {kWayFrom, kLane}, to = {kWayTo, kLane};
    std::vector<gpom_point_t> corners{from, to};
    corridor.n_past = drive(corners).size();
    for (auto door = corridor.doors.rbegin(); door != corridor.doors.rend(); ++door) {
        const gpom_point_t before = {door->centre.x_m, kLane}, inside = {door->centre.x_m, kInRoom};
        corners.insert(corners.end(), {before, inside, before});
    }
    corners.push_back(from);
    corridor.poses = drive(corners);
}

void move(Corridor &corridor, double dx_m, double dy_m)
{
    const auto move_rect = [&](Rect &rect) {
        rect = {whole_millimetres(rect.x0_m + dx_m), whole_millimetres(rect.y0_m + dy_m),
                whole_millimetres(rect.x1_m + dx_m), whole_millimetres(rect.y1_m + dy_m)};
    };
    move_rect(corridor.wall);
    for (Rect &rect : corridor.world.obstacles) {
        move_rect(rect);
    }
    for (Door &door : corridor.doors) {
        door.centre = {whole_millimetres(door.centre.x_m + dx_m),
                       whole_millimetres(door.centre.y_m + dy_m)};
    }
    for (StreetPose &pose : corridor.poses) {
        pose.x_m += dx_m;
        pose.y_m += dy_m;
    }
}

} // namespace

Corridor make_corridor(std::uint64_t seed)
{
    Corridor corridor;
    corridor.world = {kWidth, kHeight, {}, {}, 0};
    add_door_wall(corridor);
    add_other_walls(corridor.world.obstacles);
    corridor.world.n_buildings = corridor.world.obstacles.size();
    add_drives(corridor);
    StreetRandom random(seed, StreetRandom::Stream::world);
    const double dx_m = std::floor(random.uniform(0.0, 100.0)) / 1e3;
    const double dy_m = std::floor(random.uniform(0.0, 100.0)) / 1e3;
    move(corridor, dx_m, dy_m);
    return corridor;
}

std::vector<Scan> scan_corridor(const Corridor &corridor, const CorridorLaser &laser)
{
    StreetConfig config;
    config.seed = laser.seed;
    config.n_beams = laser.n_beams;
    config.range_max_m = 10.0;
    config.range_noise_m = laser.noise_m;
    const ObstacleGrid obstacles(corridor.world);
    StreetLaser street_laser(config);
    std::vector<Scan> scans;
    for (const StreetPose &pose : corridor.poses) {
        scans.push_back(street_laser.scan(obstacles, pose));
        scans.back().t_s = kPeriod_s * static_cast<double>(scans.size());
    }
    return scans;
}

} // namespace gpom_tools
