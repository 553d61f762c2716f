// Reads scans from CARMEN's log files, line by line.
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

/// The robot's pose in an ODOM line.
struct CarmenOdometry {
    double t_s;
    CarmenPose pose;
};

/// A scan whose pose will come from odometry.
struct RawScan {
    Scan scan;
    int laser;
    std::size_t n_odometry; ///< Number of ODOM lines before the scan.
};

/// Takes the lines of a log in order:
///   FLASER, RLASER, LASER3 ...: n r0 .. (pose of laser) (pose of robot) time host log_time
///   ROBOTLASER1 ...: type start_angle fov resolution range_max accuracy remission_mode
///       n r0 .. m remission0 .. (pose of laser) (pose of robot) tv rv forward_distance
///       side_distance turn_axis time host log_time. Older lines have no m and no turn_axis.
///   RAWLASER1, RAWLASER2: as ROBOTLASER1 up to the remissions, then the times. They are used if
///       the log has no other scan. Their poses are interpolated between ODOM lines.
///   PARAM name value: the field of view and the resolution of the lasers of FLASER and RLASER,
///       laser_front_laser_fov and so on. Also the places of the lasers on the robot,
///       robot_frontlaser_offset and so on, for lines that have one pose for laser and robot.
///   ODOM x y theta tv rv acceleration time host log_time
/// Units are metres, seconds and radians. In PARAM lines a resolution is in degrees, and so is any
/// angle over 2 pi. Other lines hold no scan and are skipped. A note counts those with LASER in
/// their name.
///
/// FLASER and RLASER lines do not say where their beams point. PARAM lines say it, if they fit the
/// number of ranges. Otherwise the usual lasers with this number of ranges are used
/// (laser_angles.cpp). Fewer than 180 ranges are taken to cover 180 degrees, as CARMEN does, with a
/// note. All other scans are refused.
///
/// Times that go back are repaired (scan_times.hpp), with a note.
class CarmenLog {
public:
    explicit CarmenLog(const ReadOptions &options) : options_(options) {}

    /// Take a line, split at its blanks, with at least one field. Throws FileError.
    void take(const std::vector<std::string_view> &fields, const Place &place);

    /// Return what was read. Call it after the last line. The notes also count the lines that are
    /// not used.
    ScanLog finish();

private:
    using Fields = std::vector<std::string_view>;

    void take_param(const Fields &fields);
    void take_odometry(const Fields &fields, const Place &place);
    void take_old_laser(const Fields &fields, int laser, const Place &place);
    void take_robot_laser(const Fields &fields, int laser, const Place &place);
    void take_raw_laser(const Fields &fields, int laser, const Place &place);

    /// False: the line has no ranges, and is counted as unused.
    bool has_ranges(const Fields &fields, std::size_t n_ranges);
    /// Read angles, usable range and ranges of a ROBOTLASER or RAWLASER line.
    Scan parse_head(const Fields &fields, std::size_t n_ranges, const Place &place) const;
    LaserAngles old_laser_angles(int laser, std::size_t n_ranges, const Place &place);
    /// Angles by PARAM lines. Empty: there are no such lines, or they do not fit.
    std::optional<LaserAngles> param_angles(int laser, std::size_t n_ranges);
    /// Read the laser's pose from the poses of laser and robot that begin at a field.
    CarmenPose parse_pose(const Fields &fields, std::size_t i_field, int laser, const Place &place);
    std::optional<double> param(const std::string &name) const;
    /// Place of the laser on the robot by PARAM lines. Without such lines: the robot's centre.
    CarmenPose mount_of(int laser) const;
    void add_raw_scans();
    void note(const std::string &text);

    const ReadOptions options_;
    std::map<std::string, double> params_;
    std::vector<Scan> scans_;
    std::vector<RawScan> raw_scans_;
    std::vector<CarmenOdometry> odometry_;
    std::map<std::string, std::size_t> n_unused_; ///< Number of unused lines of each kind.
    std::vector<std::string> notes_;
};

} // namespace gpom_tools

#endif
