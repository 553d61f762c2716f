#include "ports/host/carmen_log.hpp"

#include "ports/host/scan_times.hpp"

#include <algorithm>
#include <cmath>

namespace gpom_tools
{
namespace
{

constexpr double kPi = 180.0 * kDegree;
constexpr int kFrontLaser = 1;
constexpr int kRearLaser = 2;
constexpr std::size_t kCountField = 8; ///< Field with the number of ranges in ROBOTLASER and
                                       ///< RAWLASER lines.

/// The digit after the start of a name, for example 2 of RAWLASER2. -1: not exactly one digit
/// follows.
int digit_after(std::string_view name, std::string_view start)
{
    const bool is_one = name.size() == start.size() + 1 && name.substr(0, start.size()) == start;
    const char digit = is_one ? name.back() : '-';
    return digit >= '0' && digit <= '9' ? digit - '0' : -1;
}

/// The laser that an old line is from. 0: it is not a line of a laser.
int old_laser_of(std::string_view name)
{
    if (name == "FLASER") {
        return kFrontLaser;
    }
    return name == "RLASER" ? kRearLaser : std::max(digit_after(name, "LASER"), 0);
}

/// The beginning of the names of a laser's parameters.
std::string param_start(int laser)
{
    if (laser == kFrontLaser) {
        return "laser_front_laser_";
    }
    return laser == kRearLaser ? "laser_rear_laser_" : "laser_laser" + std::to_string(laser) + "_";
}

/// An angle in radians. CARMEN has used both units for the same parameters.
double radians_of(double angle)
{
    constexpr double kDigits = 1e-3; // a file may round a whole turn up to 6.284
    return std::abs(angle) > 2.0 * kPi + kDigits ? angle * kDegree : angle;
}

std::string degrees_text(double angle_rad)
{
    std::string text;
    append_number(text, std::round(angle_rad / kDegree * 1e3) / 1e3);
    return text;
}

std::size_t parse_count(const std::vector<std::string_view> &fields, std::size_t i_field,
                        const Place &place)
{
    const std::string name(fields[0]);
    if (fields.size() <= i_field) {
        place.fail(name + " ends before its number of ranges or remissions");
    }
    const int n = parse_number<int>(fields[i_field], "number of ranges or remissions", place);
    if (n < 0 || n > kScanBeamsMax) {
        place.fail(name + " has at most " + std::to_string(kScanBeamsMax) +
                   " ranges or remissions, says " + std::to_string(n));
    }
    return static_cast<std::size_t>(n);
}

void require_fields(const std::vector<std::string_view> &fields, std::size_t n_ranges,
                    std::size_t n_needed, const Place &place)
{
    if (fields.size() != n_needed) {
        place.fail(std::string(fields[0]) + " of " + std::to_string(n_ranges) + " ranges needs " +
                   std::to_string(n_needed) + " fields, has " + std::to_string(fields.size()));
    }
}

std::vector<float> parse_ranges(const std::vector<std::string_view> &fields, std::size_t i_first,
                                std::size_t n_ranges, const Place &place)
{
    std::vector<float> ranges_m(n_ranges);
    for (std::size_t i = 0; i < n_ranges; ++i) {
        ranges_m[i] = parse_number<float>(fields[i_first + i], "range " + std::to_string(i), place);
    }
    return ranges_m;
}

/// The pose of something that is mounted on the robot.
CarmenPose carried(const CarmenPose &robot, const CarmenPose &mount)
{
    const double c = std::cos(robot.theta_rad), s = std::sin(robot.theta_rad);
    return {robot.x_m + c * mount.x_m - s * mount.y_m, robot.y_m + s * mount.x_m + c * mount.y_m,
            robot.theta_rad + mount.theta_rad};
}

} // namespace

bool looks_like_carmen(std::string_view line)
{
    const std::size_t n = std::min(line.find_first_of(" \t"), line.size());
    return line[0] >= 'A' && line[0] <= 'Z' &&
           line.substr(0, n).find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789") ==
               std::string_view::npos;
}

void CarmenLog::take(const Fields &fields, const Place &place)
{
    const std::string_view name = fields[0];
    if (const int laser = old_laser_of(name); laser > 0) {
        take_old_laser(fields, laser, place);
    } else if (const int robot_laser = digit_after(name, "ROBOTLASER"); robot_laser >= 0) {
        take_robot_laser(fields, std::max(robot_laser, kFrontLaser), place);
    } else if (name == "RAWLASER1" || name == "RAWLASER2") {
        take_raw_laser(fields, digit_after(name, "RAWLASER"), place);
    } else if (name == "ODOM") {
        take_odometry(fields, place);
    } else if (name == "PARAM") {
        take_param(fields);
    } else if (name == "LASER_READING") {
        ++n_unused_["LASER_READING, gmapping's own record; its gfs2log makes a CARMEN log of it"];
    } else if (name.find("LASER") != std::string_view::npos) {
        ++n_unused_[std::string(name)];
    }
}

/// Keep a parameter that is a number. Other parameters are not needed.
void CarmenLog::take_param(const Fields &fields)
{
    if (fields.size() < 3) {
        return;
    }
    double value = 0.0;
    const char *const end = fields[2].data() + fields[2].size();
    const auto result = std::from_chars(fields[2].data(), end, value);
    if (result.ec == std::errc{} && result.ptr == end && std::isfinite(value)) {
        params_.insert_or_assign(std::string(fields[1]), value);
    }
}

void CarmenLog::take_odometry(const Fields &fields, const Place &place)
{
    constexpr std::size_t i_time = 7;
    if (fields.size() > i_time) { // gmapping's own records have fewer
        const CarmenPose pose = {parse_finite(fields[1], "x", place),
                                 parse_finite(fields[2], "y", place),
                                 parse_finite(fields[3], "theta", place)};
        odometry_.push_back({parse_finite(fields[i_time], "time", place), pose});
    }
}

bool CarmenLog::has_ranges(const Fields &fields, std::size_t n_ranges)
{
    if (n_ranges == 0) {
        ++n_unused_[std::string(fields[0]) + " without ranges"];
    }
    return n_ranges > 0;
}

void CarmenLog::take_old_laser(const Fields &fields, int laser, const Place &place)
{
    constexpr std::size_t n_other = 11; // name, n, two poses, then time host log_time
    const std::size_t n = parse_count(fields, 1, place);
    require_fields(fields, n, n + n_other, place);
    if (!has_ranges(fields, n)) {
        return;
    }
    const CarmenPose pose = parse_pose(fields, n + 2, laser, place);
    const LaserAngles angles = old_laser_angles(laser, n, place);
    scans_.push_back({parse_finite(fields[n + 8], "time", place), pose.x_m, pose.y_m,
                      pose.theta_rad, angles.first_rad, angles.step_rad, options_.range_max_m,
                      parse_ranges(fields, 2, n, place)});
}

void CarmenLog::take_robot_laser(const Fields &fields, int laser, const Place &place)
{
    constexpr std::size_t n_old_end = 13; // two poses, four numbers, then time host log_time
    const std::size_t n = parse_count(fields, kCountField, place);
    std::size_t i_pose = kCountField + 1 + n;
    if (fields.size() != i_pose + n_old_end) {
        i_pose += 1 + parse_count(fields, i_pose, place);
        require_fields(fields, n, i_pose + n_old_end + 1, place);
    }
    if (!has_ranges(fields, n)) {
        return;
    }
    Scan scan = parse_head(fields, n, place);
    const CarmenPose pose = parse_pose(fields, i_pose, laser, place);
    scan.t_s = parse_finite(fields[fields.size() - 3], "time", place);
    scan.x_m = pose.x_m;
    scan.y_m = pose.y_m;
    scan.theta_rad = pose.theta_rad;
    scans_.push_back(std::move(scan));
}

void CarmenLog::take_raw_laser(const Fields &fields, int laser, const Place &place)
{
    constexpr std::size_t n_end = 3; // time host log_time
    const std::size_t n = parse_count(fields, kCountField, place);
    const std::size_t i_remissions = kCountField + 1 + n;
    const std::size_t i_time = i_remissions + 1 + parse_count(fields, i_remissions, place);
    require_fields(fields, n, i_time + n_end, place);
    if (!has_ranges(fields, n)) {
        return;
    }
    Scan scan = parse_head(fields, n, place);
    scan.t_s = parse_finite(fields[i_time], "time", place);
    raw_scans_.push_back({std::move(scan), laser, odometry_.size()});
}

Scan CarmenLog::parse_head(const Fields &fields, std::size_t n_ranges, const Place &place) const
{
    const double first_rad = parse_finite(fields[2], "start angle", place);
    const double fov_rad = parse_finite(fields[3], "field of view", place);
    const double step_rad = parse_finite(fields[4], "angular resolution", place);
    const double range_max_m = parse_finite(fields[5], "maximum range", place);
    LaserAngles angles = {first_rad, step_rad};
    if (options_.fov_deg) {
        angles = angles_over(*options_.fov_deg * kDegree, n_ranges);
    } else if (!do_angles_fit(fov_rad, step_rad, n_ranges)) {
        place.fail(std::string(fields[0]) + " says " + degrees_text(fov_rad) +
                   " degrees in steps of " + degrees_text(step_rad) +
                   " degrees, which does not fit its " + std::to_string(n_ranges) +
                   " ranges; give --fov DEGREES");
    }
    Scan scan = {};
    scan.angle_min_rad = angles.first_rad;
    scan.angle_step_rad = angles.step_rad;
    scan.range_max_m =
        range_max_m > 0.0 ? std::min(range_max_m, options_.range_max_m) : options_.range_max_m;
    scan.ranges_m = parse_ranges(fields, kCountField + 1, n_ranges, place);
    return scan;
}

LaserAngles CarmenLog::old_laser_angles(int laser, std::size_t n_ranges, const Place &place)
{
    constexpr std::size_t kFewRanges = 180;
    if (options_.fov_deg) {
        return angles_over(*options_.fov_deg * kDegree, n_ranges);
    }
    if (const std::optional<LaserAngles> said = param_angles(laser, n_ranges)) {
        return *said;
    }
    if (const std::optional<LaserAngles> usual = usual_angles(n_ranges)) {
        return *usual;
    }
    const std::string what = "scans of " + std::to_string(n_ranges) + " ranges";
    if (n_ranges > kFewRanges) {
        place.fail(what + " are of no usual laser, and no PARAM " + param_start(laser) +
                   "fov before them says where they point; give --fov DEGREES");
    }
    note(what + " are taken for 180 degrees, as CARMEN does; --fov DEGREES gives another angle");
    const double n_steps = std::max(static_cast<double>(n_ranges) - 1.0, 1.0);
    return {-0.5 * kPi, kPi / n_steps};
}

std::optional<LaserAngles> CarmenLog::param_angles(int laser, std::size_t n_ranges)
{
    const std::optional<double> fov = param(param_start(laser) + "fov");
    const std::optional<double> step_deg = param(param_start(laser) + "resolution");
    if (!fov && !step_deg) {
        return {};
    }
    const double fov_rad =
        fov ? radians_of(*fov) : angle_of(step_deg.value_or(0.0) * kDegree, n_ranges);
    const double step_rad =
        step_deg ? *step_deg * kDegree : angles_over(fov_rad, n_ranges).step_rad;
    if (!do_angles_fit(fov_rad, step_rad, n_ranges)) {
        note("PARAM " + param_start(laser) + "fov and _resolution say " + degrees_text(fov_rad) +
             " degrees in steps of " + degrees_text(step_rad) + " degrees, which does not fit " +
             std::to_string(n_ranges) + " ranges: ignored");
        return {};
    }
    return LaserAngles{-0.5 * fov_rad, step_rad};
}

CarmenPose CarmenLog::parse_pose(const Fields &fields, std::size_t i_field, int laser,
                                 const Place &place)
{
    constexpr const char *kNames[] = {"x", "y", "theta", "robot x", "robot y", "robot theta"};
    double values[6];
    for (std::size_t i = 0; i < std::size(values); ++i) {
        values[i] = parse_finite(fields[i_field + i], kNames[i], place);
    }
    const CarmenPose mount = mount_of(laser);
    const bool is_at_centre = mount.x_m == 0.0 && mount.y_m == 0.0 && mount.theta_rad == 0.0;
    const CarmenPose pose = {values[0], values[1], values[2]};
    if (is_at_centre || !std::equal(values, values + 3, values + 3)) {
        return pose;
    }
    note("poses of laser " + std::to_string(laser) +
         " are the robot's own: moved by what PARAM says of the laser's place on it");
    return carried(pose, mount);
}

std::optional<double> CarmenLog::param(const std::string &name) const
{
    const auto found = params_.find(name);
    return found == params_.end() ? std::nullopt : std::optional<double>(found->second);
}

CarmenPose CarmenLog::mount_of(int laser) const
{
    const std::string start = laser == kFrontLaser ? "robot_frontlaser_" : "robot_rearlaser_";
    if (laser > kRearLaser) {
        return {0.0, 0.0, 0.0};
    }
    return {param(start + "offset").value_or(0.0), param(start + "side_offset").value_or(0.0),
            radians_of(param(start + "angular_offset").value_or(0.0))};
}

/// Interpolate the pose of each scan between the ODOM lines before and after it, by their times. If
/// their times are equal, use the line before. Scans without both lines are counted as unused.
void CarmenLog::add_raw_scans()
{
    for (RawScan &raw : raw_scans_) {
        if (raw.n_odometry == 0 || raw.n_odometry == odometry_.size()) {
            ++n_unused_["RAWLASER without ODOM before and after it"];
            continue;
        }
        const CarmenOdometry &before = odometry_[raw.n_odometry - 1];
        const CarmenOdometry &after = odometry_[raw.n_odometry];
        const double span_s = after.t_s - before.t_s;
        const double share =
            span_s > 0.0 ? std::clamp((raw.scan.t_s - before.t_s) / span_s, 0.0, 1.0) : 0.0;
        const double turn_rad =
            std::remainder(after.pose.theta_rad - before.pose.theta_rad, 2.0 * kPi);
        CarmenPose mount = mount_of(raw.laser);
        if (raw.laser == kRearLaser && !param("robot_rearlaser_angular_offset")) {
            mount.theta_rad = kPi;
        }
        const CarmenPose pose =
            carried({before.pose.x_m + share * (after.pose.x_m - before.pose.x_m),
                     before.pose.y_m + share * (after.pose.y_m - before.pose.y_m),
                     before.pose.theta_rad + share * turn_rad},
                    mount);
        raw.scan.x_m = pose.x_m;
        raw.scan.y_m = pose.y_m;
        raw.scan.theta_rad = pose.theta_rad;
        scans_.push_back(std::move(raw.scan));
    }
    if (!raw_scans_.empty() && !scans_.empty()) {
        note("scans of RAWLASER lines have the poses of odometry, which drifts");
    }
}

void CarmenLog::note(const std::string &text)
{
    if (std::find(notes_.begin(), notes_.end(), text) == notes_.end()) {
        notes_.push_back(text);
    }
}

ScanLog CarmenLog::finish()
{
    if (!scans_.empty() && !raw_scans_.empty()) {
        n_unused_["RAWLASER beside scans that have poses"] += raw_scans_.size();
    } else {
        add_raw_scans();
    }
    for (const auto &[kind, n_lines] : n_unused_) {
        note(std::to_string(n_lines) + (n_lines == 1 ? " line" : " lines") + " not used: " + kind);
    }
    for (const std::string &done : mend_times(scans_)) {
        note(done);
    }
    return {std::move(scans_), std::move(notes_)};
}

} // namespace gpom_tools
