// Scans of CARMEN's log files, a line at a time.
#ifndef GPOM_PORTS_HOST_CARMEN_LOG_HPP
#define GPOM_PORTS_HOST_CARMEN_LOG_HPP

#include "ports/host/laser_angles.hpp"
#include "ports/host/scan_log.hpp"
#include "ports/host/text_lines.hpp"

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gpom_tools
{

/// True for a line that begins with a message's name in capitals and a blank: `ODOM 1.0 ...`.
bool looks_like_carmen(std::string_view line);

struct CarmenPose {
    double x_m, y_m, theta_rad;
};

/// The robot by an ODOM line.
struct CarmenOdometry {
    double t_s;
    CarmenPose pose;
};

/// A scan whose pose is to come from odometry.
struct RawScan {
    Scan scan;
    int laser;
    std::size_t n_odometry; ///< ODOM lines before it.
};

/// Takes the lines of a log in their order:
///   FLASER, RLASER, LASER3 ...: n r0 .. (pose of laser) (pose of robot) time host log_time
///   ROBOTLASER1 ...: type start_angle fov resolution range_max accuracy remission_mode
///       n r0 .. m remission0 .. (pose of laser) (pose of robot) tv rv forward_distance
///       side_distance turn_axis time host log_time; older ones without m and turn_axis
///   RAWLASER1, RAWLASER2: as ROBOTLASER1 to the remissions, then the times. They are used if the
///       log has no other scan, with poses between those of the ODOM lines before and after.
///   PARAM name value: the field of view and the resolution of the lasers of FLASER and RLASER,
///       laser_front_laser_fov and so on; and where they are on the robot,
///       robot_frontlaser_offset and so on, if a line has one pose for laser and robot.
///   ODOM x y theta tv rv acceleration time host log_time
/// Metres, seconds and radians; but a resolution by PARAM, and any angle there over 2 pi, is in
/// degrees. Other lines hold no scan and are skipped; those with LASER in their name are counted in
/// a note.
///
/// FLASER and RLASER do not say where their beams point. PARAM does if it fits the number of
/// ranges; else the usual lasers with so many ranges do (laser_angles.cpp). Less than 180 ranges
/// are over 180 degrees, as CARMEN takes them, with a note. Others are refused.
///
/// Times that go back are mended (scan_times.hpp), and a note tells it.
class CarmenLog {
public:
    explicit CarmenLog(const ReadOptions &options) : options_(options) {}

    /// Take a line, split at its blanks; there is at least one field. Throws FileError.
    void take(const std::vector<std::string_view> &fields, const Place &place);

    /// What was read, after the last line; the notes tell of lines that are not used.
    ScanLog finish();

private:
    using Fields = std::vector<std::string_view>;

    void take_param(const Fields &fields);
    void take_odometry(const Fields &fields, const Place &place);
    void take_old_laser(const Fields &fields, int laser, const Place &place);
    void take_robot_laser(const Fields &fields, int laser, const Place &place);
    void take_raw_laser(const Fields &fields, int laser, const Place &place);

    /// False: no ranges, which is counted.
    bool has_ranges(const Fields &fields, std::size_t n_ranges);
    /// Angles, usable range and ranges of a ROBOTLASER or RAWLASER line.
    Scan parse_head(const Fields &fields, std::size_t n_ranges, const Place &place) const;
    LaserAngles old_laser_angles(int laser, std::size_t n_ranges, const Place &place);
    /// By PARAM lines; none if they do not say it or do not fit.
    std::optional<LaserAngles> param_angles(int laser, std::size_t n_ranges);
    /// Of the poses of laser and robot from a field on.
    CarmenPose parse_pose(const Fields &fields, std::size_t i_field, int laser, const Place &place);
    std::optional<double> param(const std::string &name) const;
    /// The laser on the robot, by PARAM lines; at its centre if they do not say it.
    CarmenPose mount_of(int laser) const;
    void add_raw_scans();
    void note(const std::string &text);

    const ReadOptions options_;
    std::map<std::string, double> params_;
    std::vector<Scan> scans_;
    std::vector<RawScan> raw_scans_;
    std::vector<CarmenOdometry> odometry_;
    std::map<std::string, std::size_t> n_unused_; ///< Lines, by their kind.
    std::vector<std::string> notes_;
};

} // namespace gpom_tools

#endif
