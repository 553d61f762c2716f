// Planar range scans with poses: reads them from files and writes them to files.
#ifndef GPOM_PORTS_HOST_SCAN_LOG_HPP
#define GPOM_PORTS_HOST_SCAN_LOG_HPP

#include "ports/host/file_error.hpp"

#include <optional>
#include <string>
#include <vector>

namespace gpom_tools
{

/// Most beams of one scan. A longer line means that the file is damaged.
constexpr int kScanBeamsMax = 10000;

/// One scan. Beam i points at bearing theta + angle_min + i * angle_step in the map frame,
/// counter-clockwise. A range of NaN = ignore the beam; infinite or >= range_max = no return.
struct Scan {
    double t_s;
    double x_m; ///< Pose of the laser in the map frame.
    double y_m;
    double theta_rad;
    double angle_min_rad;
    double angle_step_rad;
    double range_max_m;
    std::vector<float> ranges_m;
};

/// Options for what a file does not say.
struct ReadOptions {
    /// Usable range [m] of a CARMEN log. CSV scans carry their own.
    double range_max_m = 49.0;
    /// Field of view [degree] of the lasers of a CARMEN log, symmetrical about their front. It
    /// replaces what the log says. Absent: as the log says.
    std::optional<double> fov_deg = {};
    /// Readings over 0 and below this value are ignored [m]. No usual lidar measures nearer: Hokuyo
    /// URG-04LX and LDRobot LD06 measure from 0.02 m on, SICK TiM and RPLIDAR S2 from 0.05, Hokuyo
    /// UST from 0.06 and UTM from 0.1, YDLIDAR X4 from 0.12, RPLIDAR A1 from 0.15.
    double range_min_m = 0.02;
    bool is_zero_no_return = false;     ///< A reading of 0 is no return. False: it is ignored.
    bool is_too_near_no_return = false; ///< A reading below range_min_m is no return. False: it is
                                        ///< ignored.
};

/// The scans of a file, and notes on how they were read, one sentence each.
struct ScanLog {
    std::vector<Scan> scans;
    std::vector<std::string> notes;
};

/// Read all scans of a file. The file is plain, gzipped or packed with bzip2. Its content decides
/// the format:
///   CSV     one scan a line, `t,x,y,theta,angle_min,angle_step,range_max,r0,r1,...` in s, m, rad;
///           `#` comments and blank lines are skipped. A last line without a line break is refused,
///           because it may be cut. A scan over more than two turns is refused, because its angles
///           must be in degrees.
///   CARMEN  a log of CARMEN, or one that gmapping corrected (.gfs.log): carmen_log.hpp.
/// Ranges that the options ignore become NaN. Ranges that the options call no return become
/// infinite. An ignored range of 0 is not changed, and neither are negative ranges, because they
/// are valid here. Throws FileError at the first error.
ScanLog read_scan_log(const std::string &path, const ReadOptions &options);

/// The scans of read_scan_log(). Its notes go to stderr, each only once per run.
std::vector<Scan> read_scans(const std::string &path, const ReadOptions &options);

/// The CSV text of scans. Numbers have the fewest digits that read back to the same bits.
/// Each line of the comment is written after `# `.
std::string scans_csv(const std::vector<Scan> &scans, const std::string &header_comment);

/// Write scans_csv() to a file, either the whole text or nothing. Throws FileError.
void write_scans_csv(const std::string &path, const std::vector<Scan> &scans,
                     const std::string &header_comment);

} // namespace gpom_tools

#endif
