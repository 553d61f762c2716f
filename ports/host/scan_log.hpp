// Planar range scans with poses, from and to files.
#ifndef GPOM_PORTS_HOST_SCAN_LOG_HPP
#define GPOM_PORTS_HOST_SCAN_LOG_HPP

#include "ports/host/file_error.hpp"

#include <optional>
#include <string>
#include <vector>

namespace gpom_tools
{

/// Most beams one scan may have; a longer line is taken for a broken file.
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

/// How a file is read where it does not say.
struct ReadOptions {
    /// Usable range [m] of a CARMEN log; CSV scans carry their own.
    double range_max_m = 49.0;
    /// Whole angle [degree] that the lasers of a CARMEN log see, symmetrical about their front, in
    /// the place of what the log says; absent: as it says.
    std::optional<double> fov_deg = {};
    /// Readings over 0 and below it are ignored [m]. No usual lidar measures nearer: Hokuyo
    /// URG-04LX and LDRobot LD06 from 0.02 m on, SICK TiM and RPLIDAR S2 0.05, Hokuyo UST 0.06 and
    /// UTM 0.1, YDLIDAR X4 0.12, RPLIDAR A1 0.15.
    double range_min_m = 0.02;
    bool is_zero_no_return = false;     ///< A reading of 0 is no return; false: ignored.
    bool is_too_near_no_return = false; ///< So is one below range_min_m.
};

/// The scans of a file, and what a person should know of how they were read, a sentence each.
struct ScanLog {
    std::vector<Scan> scans;
    std::vector<std::string> notes;
};

/// Read all scans of a file, plain, gzipped or packed with bzip2, of either format, told apart by
/// content:
///   CSV     one scan a line, `t,x,y,theta,angle_min,angle_step,range_max,r0,r1,...` in s, m, rad;
///           `#` comments and blank lines are skipped. The last line needs its end, else it may be
///           cut. A scan over more than two turns is refused: its angles are degrees.
///   CARMEN  a log of CARMEN, or one that gmapping corrected (.gfs.log): carmen_log.hpp.
/// Ranges that the options say to ignore become NaN, those that they say are no return infinite;
/// a range of 0 that is ignored stays, and so do negative ones: they are not wrong here.
/// Throws FileError at the first thing wrong.
ScanLog read_scan_log(const std::string &path, const ReadOptions &options);

/// The scans of read_scan_log(). Its notes go to stderr, each once in a run.
std::vector<Scan> read_scans(const std::string &path, const ReadOptions &options);

/// The CSV text of scans: numbers in the fewest digits that read back to the same bits.
/// Each line of the comment is written after `# `.
std::string scans_csv(const std::vector<Scan> &scans, const std::string &header_comment);

/// Write scans_csv() to a file, whole or not at all. Throws FileError.
void write_scans_csv(const std::string &path, const std::vector<Scan> &scans,
                     const std::string &header_comment);

} // namespace gpom_tools

#endif
