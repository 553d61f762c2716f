// Planar range scans with poses, from and to files.
#ifndef GPOM_TOOLS_LIB_SCAN_LOG_HPP
#define GPOM_TOOLS_LIB_SCAN_LOG_HPP

#include "tools/lib/file_error.hpp"

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

struct ReadOptions {
    /// Usable range [m] of a CARMEN log, which does not say; CSV scans carry their own.
    double range_max_m = 49.0;
};

/// Read all scans of a file, plain or gzipped, of either format, told apart by content:
///   CSV     one scan a line, `t,x,y,theta,angle_min,angle_step,range_max,r0,r1,...` in s, m, rad;
///           `#` comments and blank lines are skipped.
///   CARMEN  lines `FLASER n r0 .. r(n-1) x y theta odom_x odom_y odom_theta time host log_time`,
///           others skipped. The first beam is at -90 degrees; the step is 1 degree for n <= 181,
///           0.5 degree above. If times go backwards anywhere, never advance, or are fewer than
///           half as many as the scans (a logger that wrote too few digits; two lasers that scan
///           together keep theirs), every scan's time is its index instead [s].
/// Throws FileError at the first thing wrong; zero and negative ranges are not wrong here.
std::vector<Scan> read_scans(const std::string &path, const ReadOptions &options);

/// The CSV text of scans: numbers in the fewest digits that read back to the same bits.
/// Each line of the comment is written after `# `.
std::string scans_csv(const std::vector<Scan> &scans, const std::string &header_comment);

/// Write scans_csv() to a file, whole or not at all. Throws FileError.
void write_scans_csv(const std::string &path, const std::vector<Scan> &scans,
                     const std::string &header_comment);

} // namespace gpom_tools

#endif
