// Scan and truth files: what is written reads back the same, what is broken is refused by line.
#include "ports/host/scan_log.hpp"
#include "tests/common/log_files.hpp"
#include "tools/sim/truth.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

using namespace gpom_tools;

namespace
{

std::string bytes_of(const std::string &path)
{
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// Equal bits, NaN included; any NaN counts as the same.
bool same_scan(const Scan &a, const Scan &b)
{
    bool same = a.t_s == b.t_s && a.x_m == b.x_m && a.y_m == b.y_m && a.theta_rad == b.theta_rad &&
                a.angle_min_rad == b.angle_min_rad && a.angle_step_rad == b.angle_step_rad &&
                a.range_max_m == b.range_max_m && a.ranges_m.size() == b.ranges_m.size();
    for (std::size_t i = 0; same && i < a.ranges_m.size(); ++i) {
        same = (std::isnan(a.ranges_m[i]) && std::isnan(b.ranges_m[i])) ||
               (a.ranges_m[i] == b.ranges_m[i] &&
                std::signbit(a.ranges_m[i]) == std::signbit(b.ranges_m[i]));
    }
    return same;
}

std::vector<Scan> random_scans()
{
    std::mt19937_64 bits(1);
    std::uniform_real_distribution<double> number(-1e4, 1e4);
    std::vector<Scan> scans(50);
    for (Scan &scan : scans) {
        scan = {number(bits), number(bits),        number(bits), number(bits),
                number(bits), number(bits) * 1e-5, 34.0,         {}};
        for (int i = 0; i < 20; ++i) {
            scan.ranges_m.push_back(static_cast<float>(number(bits)));
        }
        for (const float special : {0.0f, -0.0f, INFINITY, -INFINITY, NAN, -NAN, 1e-38f, 3e38f}) {
            scan.ranges_m.push_back(special);
        }
    }
    return scans;
}

const std::string kGoodLine = "0,1,2,0.5,-1.5,0.1,34,3,inf,nan,0,-1\n";

/// The line of the FileError that reading throws; -1 if it throws none.
template <typename Read> int error_line(const Read &read, const std::string &path)
{
    try {
        read(path);
    } catch (const FileError &error) {
        const std::string place =
            error.line > 0 ? path + ":" + std::to_string(error.line) + ": " : path + ": ";
        CHECK(error.what() == place + error.message);
        return error.line;
    }
    return -1;
}

int scan_error_line(const std::string &path)
{
    return error_line([](const std::string &p) { read_scan_log(p, {}); }, path);
}

int truth_error_line(const std::string &path)
{
    return error_line([](const std::string &p) { read_truth(p); }, path);
}

Truth small_truth() { return {-1.5, 0.1, 0.3, 3, 2, {1, 0, 0, 0, 0, 1}}; }

} // namespace

TEST_CASE("scans read back with the same bits")
{
    const Folder folder;
    const std::string path = (folder.path / "scans.csv").string();
    const std::vector<Scan> scans = random_scans();
    write_scans_csv(path, scans, "two\nlines");
    CHECK(bytes_of(path).rfind("# two\n# lines\n", 0) == 0);
    ReadOptions all;
    all.range_min_m = 0.0;
    const std::vector<Scan> read = read_scan_log(path, all).scans;
    REQUIRE(read.size() == scans.size());
    for (std::size_t i = 0; i < scans.size(); ++i) {
        CHECK(same_scan(read[i], scans[i]));
    }
}

TEST_CASE("gzipped and plain files of either format read the same")
{
    const Folder folder;
    for (const std::string &text : {kGoodLine + kGoodLine, flaser(180, "1") + flaser(180, "2")}) {
        const std::vector<Scan> plain = read_scan_log(folder.file("plain", text), {}).scans;
        const std::vector<Scan> zipped = read_scan_log(folder.gz("zipped", text), {}).scans;
        REQUIRE(plain.size() == 2);
        REQUIRE(zipped.size() == 2);
        CHECK(same_scan(plain[0], zipped[0]));
        CHECK(same_scan(plain[1], zipped[1]));
    }
}

TEST_CASE("CSV: comments, blank lines, blanks and CR LF are fine")
{
    const Folder folder;
    const std::string text = "# c\xc3\xa9\n\n  \n0, 1,2,0.5,-1.5,0.1,34,\t3\r\n  # more\n1" +
                             kGoodLine.substr(1) + "# end";
    const std::vector<Scan> scans = read_scan_log(folder.file("f", text), {}).scans;
    REQUIRE(scans.size() == 2);
    CHECK(scans[0].ranges_m == std::vector<float>{3.0f});
    CHECK(scans[1].t_s == 1.0);
    REQUIRE(scans[1].ranges_m.size() == 5);
    CHECK(std::isinf(scans[1].ranges_m[1]));
    CHECK(std::isnan(scans[1].ranges_m[2]));
    CHECK(scans[1].ranges_m[4] == -1.0f);
}

TEST_CASE("CARMEN: the first beam is at -90 degrees, steps are 1 or 0.5 degree by their number")
{
    constexpr double degree = 3.14159265358979323846 / 180.0;
    const Folder folder;
    const struct {
        int n;
        double step_degree;
    } cases[] = {{180, 1.0}, {181, 1.0}, {360, 0.5}, {361, 0.5}};
    for (const auto &c : cases) {
        const std::string text = "# comment\nPARAM a b\nODOM 1 2 3\n" + flaser(c.n, "5");
        const Scan scan = read_scan_log(folder.file("f", text), ReadOptions{25.0}).scans[0];
        CHECK(scan.angle_min_rad == doctest::Approx(-90.0 * degree));
        CHECK(scan.angle_step_rad == doctest::Approx(c.step_degree * degree));
        CHECK(scan.range_max_m == 25.0);
        CHECK(scan.x_m == 10.0); // the corrected pose, not the odometry's
        CHECK(scan.y_m == 20.0);
        CHECK(scan.theta_rad == 0.5);
        REQUIRE(scan.ranges_m.size() == static_cast<std::size_t>(c.n));
        CHECK(scan.ranges_m[0] == 1.0f);
        CHECK(scan.ranges_m.back() == static_cast<float>(c.n));
    }
}

TEST_CASE("CARMEN: sound times stay, times that never advance give way to the index")
{
    const Folder folder;
    const struct {
        const char *times[3];
        double expected[3];
    } cases[] = {{{"5.5", "5.5", "7"}, {5.5, 5.5, 7.0}},
                 {{"5", "7", "6"}, {5.0, 7.0, 9.0}},
                 {{"0", "0", "0"}, {0.0, 1.0, 2.0}}};
    for (const auto &c : cases) {
        std::string text;
        for (const char *time : c.times) {
            text += flaser(3, time);
        }
        const std::vector<Scan> scans = read_scan_log(folder.file("f", text), {}).scans;
        for (std::size_t i = 0; i < 3; ++i) {
            CHECK(scans[i].t_s == c.expected[i]);
        }
    }
}

// Scans of one time cannot confirm or clear what each other saw, so that too few digits of the time
// would leave a live map without either.
TEST_CASE("CARMEN: a log whose times have too few digits is numbered")
{
    const Folder folder;
    std::string text;
    for (int i = 0; i < 40; ++i) {
        text += flaser(3, i < 20 ? "9.77055e+08" : "9.77056e+08");
    }
    const std::vector<Scan> scans = read_scan_log(folder.file("f", text), {}).scans;
    REQUIRE(scans.size() == 40);
    for (std::size_t i = 0; i < scans.size(); ++i) {
        CHECK(scans[i].t_s == static_cast<double>(i));
    }
}

// Two lasers on one robot scan together, and the log may begin or end between them.
TEST_CASE("CARMEN: pairs of scans at equal times keep them, wherever the log was cut")
{
    const Folder folder;
    for (const int first : {0, 1}) {
        for (const int end : {19, 20}) {
            std::string text;
            std::vector<double> times;
            for (int i = first; i < end; ++i) {
                times.push_back(7.5 + i / 2);
                text += flaser(3, std::to_string(times.back()));
            }
            const std::vector<Scan> scans = read_scan_log(folder.file("f", text), {}).scans;
            REQUIRE(scans.size() == times.size());
            for (std::size_t i = 0; i < scans.size(); ++i) {
                CHECK(scans[i].t_s == times[i]);
            }
        }
    }
}

TEST_CASE("each kind of broken scan file is refused with its line")
{
    const Folder folder;
    const std::string nul(1, '\0');
    std::string too_many = "0,1,2,0.5,-1.5,0.1,34";
    for (int i = 0; i <= kScanBeamsMax; ++i) {
        too_many += ",1";
    }
    const struct {
        const char *what;
        std::string text;
        int line;
    } cases[] = {
        {"empty file", "", 1},
        {"comments only", "# a\n\n", 3},
        {"CARMEN without FLASER", "ODOM 1 2 3\n", 2},
        {"too few fields", kGoodLine + "0,1,2,0.5,-1.5,0.1,34\n", 2},
        {"too many ranges", too_many + "\n", 1},
        {"text for a number", "# a\n0,x,2,0.5,-1.5,0.1,34,3\n", 2},
        {"column names", "t,x,y,theta,angle_min,angle_step,range_max,r0\n", 1},
        {"trailing rubbish", "0,1m,2,0.5,-1.5,0.1,34,3\n", 1},
        {"empty field", "0,1,2,0.5,-1.5,0.1,34,3,\n", 1},
        {"number too large", "0,1,2,0.5,-1.5,0.1,34,1e99\n", 1},
        {"time nan", "nan,1,2,0.5,-1.5,0.1,34,3\n", 1},
        {"x inf", "0,inf,2,0.5,-1.5,0.1,34,3\n", 1},
        {"y nan", "0,1,nan,0.5,-1.5,0.1,34,3\n", 1},
        {"theta inf", "0,1,2,-inf,-1.5,0.1,34,3\n", 1},
        {"angle_min nan", "0,1,2,0.5,nan,0.1,34,3\n", 1},
        {"angle_step in degrees", "0,1,2,0.5,-9,3,34,1,2,3,4,5,6\n", 1},
        {"clockwise, in degrees", kGoodLine + "0,1,2,0.5,9,-3,34,1,2,3,4,5,6\n", 2},
        {"angle_step inf", "0,1,2,0.5,-1.5,inf,34,3\n", 1},
        {"range_max zero", "0,1,2,0.5,-1.5,0.1,0,3\n", 1},
        {"range_max negative", kGoodLine + kGoodLine + "0,1,2,0.5,-1.5,0.1,-1,3\n", 3},
        {"range_max nan", "0,1,2,0.5,-1.5,0.1,nan,3\n", 1},
        {"NUL byte", kGoodLine + nul + kGoodLine, 2},
        {"control byte in a comment", "# \x01\n" + kGoodLine, 1},
        {"high bytes", kGoodLine + "\xff\xfe,1\n", 2},
        {"line without end", std::string(3u << 20, '1'), 1},
        {"FLASER alone", "FLASER\n", 1},
        {"FLASER n zero alone", "FLASER 0 1 2 3 1 2 3 4 host 5\n", 2},
        {"FLASER n negative", "FLASER -3 1 2 3 1 2 3 1 2 3 4 host 5\n", 1},
        {"FLASER n absurd", flaser(3, "1") + "FLASER 10001 1 2 3\n", 2},
        {"FLASER n beyond int", "FLASER 99999999999 1 2 3\n", 1},
        {"FLASER n no number", "FLASER x 1 2 3\n", 1},
        {"FLASER cut short", flaser(3, "1") + "ODOM 1\nFLASER 3 1 2 3 10 20 0.5 11\n", 3},
        {"FLASER too long", "FLASER 2 1 2 3 10 20 0.5 11 21 0.6 1 host 99\n", 1},
        {"FLASER pose nan", "FLASER 1 1 nan 20 0.5 11 21 0.6 1 host 99\n", 1},
        {"FLASER time inf", flaser(3, "1") + flaser(3, "inf"), 2},
        {"FLASER range no number", "FLASER 1 x 10 20 0.5 11 21 0.6 1 host 99\n", 1},
    };
    for (const auto &c : cases) {
        CAPTURE(c.what);
        CHECK(scan_error_line(folder.file("f", c.text)) == c.line);
    }
    CHECK(scan_error_line((folder.path / "missing").string()) == 0);
    CHECK(scan_error_line(folder.path.string()) == 1); // a folder
}

TEST_CASE("readings of 0 and too near ones are what the options say")
{
    const Folder folder;
    const std::string path = folder.file("f", "0,0,0,0,0,0.1,30,0,0.01,0.02,-1,nan,7\n");
    const auto read = [&](ReadOptions options) {
        return read_scan_log(path, options).scans[0].ranges_m;
    };
    const std::vector<float> as_default = read({});
    CHECK(as_default[0] == 0.0f);
    CHECK(std::isnan(as_default[1]));
    CHECK(as_default[2] == 0.02f);
    CHECK(as_default[3] == -1.0f);
    CHECK(std::isnan(as_default[4]));
    CHECK(as_default[5] == 7.0f);
    ReadOptions options;
    options.range_min_m = 0.0;
    options.is_too_near_no_return = true; // nothing is too near
    CHECK(read(options)[1] == 0.01f);
    options.range_min_m = 0.1;
    CHECK(read(options)[0] == 0.0f);
    CHECK(std::isinf(read(options)[1]));
    CHECK(std::isinf(read(options)[2]));
    CHECK(read(options)[3] == -1.0f);
    options.is_zero_no_return = true;
    CHECK(std::isinf(read(options)[0]));
}

TEST_CASE("a CSV file is refused at every length it can be cut to inside its last line")
{
    const Folder folder;
    const std::string text = kGoodLine + "0,1,2,0.5,-1.5,0.1,34,12.5,10.25\n";
    for (std::size_t n = kGoodLine.size() + 1; n < text.size(); ++n) {
        CAPTURE(n);
        CHECK(scan_error_line(folder.file("cut", text.substr(0, n))) == 2);
    }
    CHECK(scan_error_line(folder.file("whole", text)) == -1);
}

TEST_CASE("CSV: scans that have other numbers of ranges than nearly all the others are told")
{
    const Folder folder;
    std::string text;
    for (int i = 0; i < 10; ++i) {
        text += kGoodLine;
    }
    const std::string longer = kGoodLine.substr(0, kGoodLine.size() - 1) + ",3\n";
    CHECK(read_scan_log(folder.file("f", text), {}).notes.empty());
    CHECK(read_scan_log(folder.file("f", text + longer), {}).notes ==
          std::vector<std::string>{"1 of 11 scans do not have 5 ranges as the others do; the first "
                                   "is scan 11, with 6: is the file cut there?"});
    CHECK(read_scan_log(folder.file("f", longer + kGoodLine + longer), {}).notes.empty());
}

TEST_CASE("a gzipped log is refused at every length it can be truncated to")
{
    const Folder folder;
    std::string text;
    for (const Scan &scan : random_scans()) {
        text += scans_csv({scan}, "x");
    }
    const std::string whole = bytes_of(folder.gz("whole.gz", text));
    for (std::size_t n = 0; n < whole.size(); n += n < 40 || n + 40 > whole.size() ? 1 : 97) {
        CAPTURE(n);
        CHECK(scan_error_line(folder.file("cut.gz", whole.substr(0, n))) >= 1);
    }
    std::string damaged = whole;
    damaged[whole.size() / 2] = static_cast<char>(damaged[whole.size() / 2] ^ 0x55);
    CHECK(scan_error_line(folder.file("damaged.gz", damaged)) >= 1);
}

TEST_CASE("truth reads back the same, and its image has north up and 0 for occupied")
{
    const Folder folder;
    const std::string path = (folder.path / "truth.pgm").string();
    const Truth truth = small_truth();
    write_truth(path, truth, "made by a test");
    const Truth read = read_truth(path);
    CHECK(read.x0_m == truth.x0_m);
    CHECK(read.y0_m == truth.y0_m);
    CHECK(read.cell_m == truth.cell_m);
    CHECK(read.nx == 3);
    CHECK(read.ny == 2);
    CHECK(read.occupied == truth.occupied);
    CHECK(read.at(0, 0));
    CHECK(!read.at(0, 1));
    CHECK(read.at(2, 1));
    CHECK(bytes_of(path) == std::string("P5\n# gpom-truth 1 -1.5 0.1 0.3\n# made by a test\n3 2\n"
                                        "255\n\xff\xff\0\0\xff\xff",
                                        sizeof "P5\n# gpom-truth 1 -1.5 0.1 0.3\n"
                                               "# made by a test\n3 2\n255\n" +
                                            5));
}

TEST_CASE("each kind of broken truth file is refused with its line, and every truncation")
{
    const Folder folder;
    const std::string place = "P5\n# gpom-truth 1 0 0 0.25\n";
    const std::string image(6, '\xff');
    const struct {
        const char *what;
        std::string bytes;
        int line;
    } cases[] = {
        {"empty", "", 1},
        {"other image", "P6\n", 1},
        {"binary rubbish", std::string(10000, '\x80'), 1},
        {"no place", "P5\n3 2\n255\n" + image, 2},
        {"other version", "P5\n# gpom-truth 2 0 0 1\n3 2\n255\n" + image, 2},
        {"cell zero", "P5\n# gpom-truth 1 0 0 0\n3 2\n255\n" + image, 2},
        {"cell nan", "P5\n# gpom-truth 1 0 0 nan\n3 2\n255\n" + image, 2},
        {"origin inf", "P5\n# gpom-truth 1 inf 0 1\n3 2\n255\n" + image, 2},
        {"place too long", "P5\n# gpom-truth 1 0 0 1 7\n3 2\n255\n" + image, 2},
        {"width zero", place + "0 2\n255\n", 3},
        {"height negative", place + "3 -2\n255\n" + image, 3},
        {"size huge", place + "2000000000 2000000000\n255\n" + image, 3},
        {"size a lie", place + "20000 20000\n255\n" + image, 4},
        {"grey maximum", place + "3 2\n15\n" + image, 4},
        {"image too long", place + "3 2\n255\n" + image + "x", 4},
        {"grey value", place + "3 2\n255\n" + image.substr(1) + "\x7f", 4},
    };
    for (const auto &c : cases) {
        CAPTURE(c.what);
        CHECK(truth_error_line(folder.file("f", c.bytes)) == c.line);
    }
    CHECK(truth_error_line((folder.path / "missing").string()) == 0);
    CHECK(truth_error_line(folder.path.string()) >= 0);
    const std::string whole = truth_pgm(small_truth(), "x");
    for (std::size_t n = 0; n < whole.size(); ++n) {
        CAPTURE(n);
        CHECK(truth_error_line(folder.file("cut", whole.substr(0, n))) >= 1);
    }
}

TEST_CASE("a failed write leaves the old files as they were and nothing beside them")
{
    const Folder folder;
    const std::string old = folder.file("old.csv", "old");
    const std::string impossible = (folder.path / "no-folder" / "x").string();
    CHECK_THROWS_AS(replace_files({{old, "new"}, {impossible, "new"}}), FileError);
    CHECK(bytes_of(old) == "old");
    CHECK_THROWS_AS(replace_files({{folder.path.string(), "new"}}), FileError);
    CHECK(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator()) == 1);
    replace_files({{old, "new"}});
    CHECK(bytes_of(old) == "new");
}
