// CARMEN logs: where beams point, whose poses count, and what is told of lines that are not used.
#include "ports/host/scan_log.hpp"
#include "tests/common/log_files.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

using namespace gpom_tools;

namespace
{

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180.0;

ScanLog log_of(const std::string &text, const ReadOptions &options = {})
{
    const Folder folder;
    return read_scan_log(folder.file("f.log", text), options);
}

/// What an unreadable log is refused with.
std::string refusal_of(const std::string &text)
{
    try {
        log_of(text);
    } catch (const FileError &error) {
        return error.message;
    }
    return "";
}

double first_deg(const Scan &scan) { return scan.angle_min_rad / kDegree; }
double step_deg(const Scan &scan) { return scan.angle_step_rad / kDegree; }

std::string times(int n, const std::string &word)
{
    std::string text;
    for (int i = 0; i < n; ++i) {
        text += " " + word;
    }
    return text;
}

/// `NAME 0 start fov step max 0.01 0 n ranges`, from which on ROBOTLASER and RAWLASER differ.
std::string head(const std::string &name, const std::string &angles, int n,
                 const std::string &range_max = "81.9")
{
    return name + " 0 " + angles + " " + range_max + " 0.01 0 " + std::to_string(n) + times(n, "2");
}

/// A ROBOTLASER1 line over a half circle, of the laser's and the robot's pose.
std::string robot_laser(int n, const std::string &poses, const std::string &time)
{
    return head("ROBOTLASER1", "-1.570796 3.141593 0.017453", n) + " 0 " + poses +
           " 0 0 0.5 0.4 1000000 " + time + " host " + time + "\n";
}

std::string raw_laser(const std::string &name, const std::string &time)
{
    return head(name, "-1.570796 3.141593 0.017453", 181) + " 0 " + time + " host " + time + "\n";
}

std::string odometry(const std::string &pose, const std::string &time)
{
    return "ODOM " + pose + " 0 0 0 " + time + " host " + time + "\n";
}

} // namespace

TEST_CASE("FLASER lines point where PARAM lines say, in degrees or radians")
{
    const std::string name = "PARAM laser_front_laser_";
    const struct {
        const char *fov, *step;
        int n;
        double first_deg, step_deg;
    } cases[] = {
        {"270", "0.5", 541, -135.0, 0.5},    {"270", "0.5", 540, -135.0, 0.5},
        {"3.14159", "0.5", 361, -90.0, 0.5}, {"240", "", 721, -120.0, 1.0 / 3.0},
        {"", "0.25", 721, -90.0, 0.25},      {"100", "0.25", 401, -50.0, 0.25},
        {"360", "0.5", 720, -180.0, 0.5},    {"6.2832", "1.0", 360, -180.0, 1.0},
        {"100", "0.5", 201, -50.0, 0.5},     {"180", "2", 91, -90.0, 2.0},
    };
    for (const auto &c : cases) {
        CAPTURE(c.n);
        std::string text = "# a log\n";
        text += *c.fov ? name + "fov " + c.fov + " nohost 0\n" : "";
        text += *c.step ? name + "resolution " + c.step + " nohost 0\n" : "";
        const ScanLog log = log_of(text + flaser(c.n, "1"));
        CHECK(first_deg(log.scans[0]) == doctest::Approx(c.first_deg).epsilon(1e-4));
        CHECK(step_deg(log.scans[0]) == doctest::Approx(c.step_deg).epsilon(1e-4));
        CHECK(log.notes.empty());
    }
}

TEST_CASE("without PARAM lines, FLASER lines point as the usual lasers with so many ranges do")
{
    const struct {
        int n;
        double first_deg, last_deg;
    } cases[] = {{181, -90.0, 90.0},   {401, -50.0, 50.0},   {541, -135.0, 135.0},
                 {540, -135.0, 134.5}, {811, -135.0, 135.0}, {1081, -135.0, 135.0},
                 {381, -95.0, 95.0},   {769, -135.0, 135.0}, {682, -119.53, 119.88}};
    for (const auto &c : cases) {
        CAPTURE(c.n);
        const ScanLog log = log_of(flaser(c.n, "1"));
        CHECK(first_deg(log.scans[0]) == doctest::Approx(c.first_deg).epsilon(1e-4));
        CHECK(first_deg(log.scans[0]) + (c.n - 1) * step_deg(log.scans[0]) ==
              doctest::Approx(c.last_deg).epsilon(1e-4));
        CHECK(log.notes.empty());
    }
}

TEST_CASE("FLASER lines of no usual laser are refused, and the refusal says what to give")
{
    const std::string text = flaser(1000, "1");
    CHECK(refusal_of(text) == "scans of 1000 ranges are of no usual laser, and no PARAM "
                              "laser_front_laser_fov before them says where they point; give "
                              "--fov DEGREES");
    ReadOptions options;
    options.fov_deg = 250.0;
    CHECK(first_deg(log_of(text, options).scans[0]) == doctest::Approx(-125.0));
    CHECK(step_deg(log_of(text, options).scans[0]) == doctest::Approx(0.25));
}

TEST_CASE("PARAM lines that do not fit the ranges are ignored, and this is told")
{
    const std::string text = "PARAM laser_front_laser_fov 180 nohost 0\n"
                             "PARAM laser_front_laser_resolution 1.0 nohost 0\n";
    const ScanLog log = log_of(text + flaser(541, "1") + flaser(541, "2"));
    CHECK(first_deg(log.scans[0]) == doctest::Approx(-135.0));
    REQUIRE(log.notes.size() == 1);
    CHECK(log.notes[0] == "PARAM laser_front_laser_fov and _resolution say 180 degrees in steps of "
                          "1 degrees, which does not fit 541 ranges: ignored");
    CHECK(refusal_of(text + flaser(1000, "1")) != "");
}

TEST_CASE("few ranges that no line explains are taken for a half circle, and this is told")
{
    const ScanLog log = log_of(flaser(3, "1") + flaser(3, "2"));
    CHECK(first_deg(log.scans[0]) == doctest::Approx(-90.0));
    CHECK(step_deg(log.scans[0]) == doctest::Approx(90.0));
    REQUIRE(log.notes.size() == 1);
    CHECK(log.notes[0] == "scans of 3 ranges are taken for 180 degrees, as CARMEN does; --fov "
                          "DEGREES gives another angle");
}

TEST_CASE("ROBOTLASER lines say angles, usable range, poses and time themselves")
{
    const std::string end = " 1 2 0.5 4 5 0.6 0 0 0.5 0.4 ";
    const std::string angles = "-2.356194 4.712389 0.008727";
    const std::string lines[] = {
        head("ROBOTLASER1", angles, 541, "30") + " 0" + end + "1000000 7.5 host 7.5\n",
        head("ROBOTLASER0", angles, 541, "30") + " 2 0.1 0.2" + end + "1000000 7.5 host 7.5\n",
        head("ROBOTLASER2", angles, 541, "30") + end + "7.5 host 7.5\n"}; // as CARMEN wrote first
    for (const std::string &line : lines) {
        CAPTURE(line);
        const ScanLog log = log_of("WEIGHT -3\n" + line + "NEFF 5\n");
        REQUIRE(log.scans.size() == 1);
        const Scan &scan = log.scans[0];
        CHECK(first_deg(scan) == doctest::Approx(-135.0));
        CHECK(step_deg(scan) == doctest::Approx(0.5).epsilon(1e-4));
        CHECK(scan.ranges_m == std::vector<float>(541, 2.0f));
        CHECK(scan.range_max_m == 30.0);
        CHECK(scan.x_m == 1.0);
        CHECK(scan.y_m == 2.0);
        CHECK(scan.theta_rad == 0.5);
        CHECK(log.notes.empty());
    }
}

TEST_CASE("ROBOTLASER lines whose angles do not fit their ranges are refused, not turned")
{
    const std::string line = head("ROBOTLASER1", "-1.570796 3.141593 0.017453", 361) +
                             " 0 1 2 0.5 1 2 0.5 0 0 0.5 0.4 1000000 7.5 host 7.5\n";
    CHECK(refusal_of(line) == "ROBOTLASER1 says 180 degrees in steps of 1 degrees, which does not "
                              "fit its 361 ranges; give --fov DEGREES");
    ReadOptions options;
    options.fov_deg = 180.0;
    CHECK(step_deg(log_of(line, options).scans[0]) == doctest::Approx(0.5));
}

TEST_CASE("lines of several lasers are all read, each with its own pose")
{
    std::string rear = flaser(181, "1");
    rear.replace(0, 1, "R");
    rear.replace(rear.find(" 10 20 0.5 "), 11, " -10 20 3.6 ");
    const ScanLog log =
        log_of(flaser(181, "1") + rear + robot_laser(181, "7 8 0.1 6 8 0.1", "1.1"));
    REQUIRE(log.scans.size() == 3);
    CHECK(log.scans[1].x_m == -10.0);
    CHECK(log.scans[1].theta_rad == 3.6);
    CHECK(log.scans[2].x_m == 7.0);
    CHECK(log.notes.empty());
}

TEST_CASE("a pose that is the robot's, too, is moved to where PARAM lines put the laser")
{
    const std::string offset = "PARAM robot_frontlaser_offset 0.3 nohost 0\n"
                               "PARAM robot_frontlaser_side_offset 0.1 nohost 0\n"
                               "PARAM robot_frontlaser_angular_offset 180 nohost 0\n";
    const ScanLog moved =
        log_of(offset + robot_laser(181, "1 2 1.5707963268 1 2 1.5707963268", "1"));
    CHECK(moved.scans[0].x_m == doctest::Approx(0.9));
    CHECK(moved.scans[0].y_m == doctest::Approx(2.3));
    CHECK(moved.scans[0].theta_rad == doctest::Approx(1.5 * kPi));
    REQUIRE(moved.notes.size() == 1);
    CHECK(moved.notes[0] == "poses of laser 1 are the robot's own: moved by what PARAM says of the "
                            "laser's place on it");
    const ScanLog said = log_of(offset + robot_laser(181, "1.3 2 0 1 2 0", "1"));
    CHECK(said.scans[0].x_m == 1.3);
    CHECK(said.notes.empty());
}

TEST_CASE("RAWLASER lines get the pose between the odometry before and after them")
{
    const std::string text = odometry("0 0 3.1", "10") + raw_laser("RAWLASER1", "10.25") +
                             raw_laser("RAWLASER2", "10.5") + odometry("4 8 -3.1", "11");
    const ScanLog log = log_of("PARAM robot_frontlaser_offset 0.5 nohost 0\n" + text);
    REQUIRE(log.scans.size() == 2);
    const double turn_rad = 2.0 * kPi - 6.2; // over the back
    const double front_rad = 3.1 + 0.25 * turn_rad;
    CHECK(log.scans[0].x_m == doctest::Approx(1.0 + 0.5 * std::cos(front_rad)));
    CHECK(log.scans[0].y_m == doctest::Approx(2.0 + 0.5 * std::sin(front_rad)));
    CHECK(log.scans[0].theta_rad == doctest::Approx(front_rad));
    CHECK(log.scans[1].x_m == doctest::Approx(2.0)); // the rear one looks back
    CHECK(log.scans[1].theta_rad == doctest::Approx(3.1 + 0.5 * turn_rad + kPi));
    REQUIRE(log.notes.size() == 1);
    CHECK(log.notes[0] == "scans of RAWLASER lines have the poses of odometry, which drifts");
}

TEST_CASE("each line of a laser that is not used is counted and told")
{
    const std::string text = flaser(181, "1") + "FLASER 0 0 0 0 0 0 0 1 host 1\n" +
                             raw_laser("RAWLASER1", "1") + raw_laser("RAWLASER1", "2") +
                             raw_laser("RAWLASER3", "2") + "REMISSIONFLASER 1 2 3\n" +
                             "SYNC a\nTRUEPOS 1 2 3\nNMEA-GGA 1\nODOM 1 2 3\n";
    const std::vector<std::string> told = {
        "1 line not used: FLASER without ranges",
        "2 lines not used: RAWLASER beside scans that have poses",
        "1 line not used: RAWLASER3",
        "1 line not used: REMISSIONFLASER",
    };
    CHECK(log_of(text).scans.size() == 1);
    CHECK(log_of(text).notes == told);
    CHECK(log_of(raw_laser("RAWLASER1", "0") + odometry("0 0 0", "1") +
                 raw_laser("RAWLASER1", "2") + odometry("1 0 0", "3") + raw_laser("RAWLASER2", "4"))
              .notes.back() == "2 lines not used: RAWLASER without ODOM before and after it");
}

TEST_CASE("a log without scans is refused, with what is in it")
{
    const std::string none = "no scans in this file; need CSV scans or CARMEN FLASER, ROBOTLASER "
                             "or RAWLASER lines";
    CHECK(refusal_of("ODOM 1 2 3\n") == none);
    CHECK(refusal_of(raw_laser("RAWLASER1", "1") + raw_laser("RAWLASER1", "2")) ==
          none + "; 2 lines not used: RAWLASER without ODOM before and after it");
    CHECK(refusal_of("LASER_READING 1 2.0 0 0 0 1\n") ==
          none + "; 1 line not used: LASER_READING, gmapping's own record; its gfs2log makes a "
                 "CARMEN log of it");
}

TEST_CASE("each broken ROBOTLASER, RAWLASER or ODOM line is refused")
{
    const std::string good = robot_laser(181, "1 2 0.5 1 2 0.5", "1");
    const std::string raw = raw_laser("RAWLASER1", "1");
    const auto replaced = [](std::string text, const std::string &from, const std::string &to) {
        return text.replace(text.find(from), from.size(), to);
    };
    const std::string broken[] = {
        "ROBOTLASER1\n",
        "ROBOTLASER1 0 0 0 0 0 0 0 x\n",
        "ROBOTLASER1 0 0 0 0 0 0 0 -1\n",
        "ROBOTLASER1 0 0 0 0 0 0 0 10001\n",
        replaced(good, " host", ""),
        replaced(good, " 0 1 2 0.5", " 1 1 2 0.5"),
        replaced(good, "-1.570796", "nan"),
        replaced(good, "81.9", "inf"),
        replaced(good, "1 2 0.5", "1 2 inf"),
        replaced(good, " 2 2 ", " 2 x "),
        replaced(good, "0.017453", "0"),
        replaced(raw, " host", ""),
        replaced(raw, " 1 host", " nan host"),
        "RAWLASER2 0 0 0 0 0 0 0 1 2\n",
        odometry("1 x 3", "4"),
        odometry("1 2 3", "nan"),
    };
    CHECK(refusal_of(good) == "");
    for (const std::string &line : broken) {
        CAPTURE(line);
        CHECK(refusal_of(line + good) != "");
    }
}

TEST_CASE("files packed with bzip2 read as plain ones, several streams on end, too")
{
    const Folder folder;
    std::string text;
    for (int i = 0; i < 400; ++i) {
        text += flaser(181, std::to_string(i));
    }
    const auto packed_of = [&](const std::string &part) {
        const std::string path = folder.bz2("part", part);
        std::ifstream in(path, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(in), {});
    };
    const std::string whole = packed_of(text);
    const std::vector<Scan> read = read_scan_log(folder.file("f", whole), {}).scans;
    REQUIRE(read.size() == 400);
    CHECK(read[399].t_s == 399.0);
    CHECK(read[399].ranges_m == read[0].ranges_m);
    const std::string parts = packed_of(text) + packed_of(flaser(181, "400"));
    CHECK(read_scan_log(folder.file("f", parts), {}).scans.size() == 401);
    for (std::size_t n = 0; n < whole.size(); n += n < 40 || n + 40 > whole.size() ? 1 : 97) {
        CAPTURE(n);
        CHECK_THROWS_AS(read_scan_log(folder.file("cut", whole.substr(0, n)), {}), FileError);
    }
    std::string damaged = whole;
    damaged[whole.size() / 2] = static_cast<char>(damaged[whole.size() / 2] ^ 0x55);
    CHECK_THROWS_AS(read_scan_log(folder.file("damaged", damaged), {}), FileError);
}
