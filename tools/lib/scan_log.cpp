#include "tools/lib/scan_log.hpp"

#include "tools/lib/text_lines.hpp"

namespace gpom_tools
{
namespace
{

constexpr double kDegree = 3.14159265358979323846 / 180.0;

void parse_ranges(const std::vector<std::string_view> &fields, std::size_t i_first,
                  std::vector<float> &ranges_m, const Place &place)
{
    for (std::size_t i = 0; i < ranges_m.size(); ++i) {
        const auto name = [&] { return "range " + std::to_string(i); };
        const std::string_view text = fields[i_first + i];
        ranges_m[i] = parse_number<float>(text, name(), place);
    }
}

Scan parse_csv(const std::vector<std::string_view> &fields, const Place &place)
{
    constexpr std::size_t n_head = 7;
    if (fields.size() < n_head + 1) {
        place.fail("scan has " + std::to_string(fields.size()) +
                   " fields; need t,x,y,theta,angle_min,angle_step,range_max,r0,...");
    }
    if (fields.size() > n_head + kScanBeamsMax) {
        place.fail("scan has over " + std::to_string(kScanBeamsMax) + " ranges");
    }
    Scan scan;
    scan.t_s = parse_finite(fields[0], "t", place);
    scan.x_m = parse_finite(fields[1], "x", place);
    scan.y_m = parse_finite(fields[2], "y", place);
    scan.theta_rad = parse_finite(fields[3], "theta", place);
    scan.angle_min_rad = parse_finite(fields[4], "angle_min", place);
    scan.angle_step_rad = parse_finite(fields[5], "angle_step", place);
    scan.range_max_m = parse_finite(fields[6], "range_max", place);
    if (!(scan.range_max_m > 0.0)) {
        place.fail("range_max must be over 0, is " + std::string(fields[6]));
    }
    scan.ranges_m.resize(fields.size() - n_head);
    parse_ranges(fields, n_head, scan.ranges_m, place);
    return scan;
}

Scan parse_flaser(const std::vector<std::string_view> &fields, double range_max_m,
                  const Place &place)
{
    constexpr std::size_t n_other = 11; // FLASER n, two poses, time, host, log_time
    const int n = fields.size() > 1 ? parse_number<int>(fields[1], "number of ranges", place) : 0;
    if (n < 1 || n > kScanBeamsMax) {
        place.fail("FLASER needs 1 to " + std::to_string(kScanBeamsMax) + " ranges, says " +
                   std::to_string(n));
    }
    const auto n_ranges = static_cast<std::size_t>(n);
    if (fields.size() != n_ranges + n_other) {
        place.fail("FLASER of " + std::to_string(n) + " ranges needs " +
                   std::to_string(n_ranges + n_other) + " fields, has " +
                   std::to_string(fields.size()));
    }
    Scan scan;
    scan.x_m = parse_finite(fields[n_ranges + 2], "x", place);
    scan.y_m = parse_finite(fields[n_ranges + 3], "y", place);
    scan.theta_rad = parse_finite(fields[n_ranges + 4], "theta", place);
    scan.t_s = parse_finite(fields[n_ranges + 8], "time", place);
    scan.angle_min_rad = -90.0 * kDegree;
    scan.angle_step_rad = (n <= 181 ? 1.0 : 0.5) * kDegree;
    scan.range_max_m = range_max_m;
    scan.ranges_m.resize(n_ranges);
    parse_ranges(fields, 2, scan.ranges_m, place);
    return scan;
}

/// CARMEN lines begin with a message's name in capitals and a blank: `ODOM 1.0 ...`.
bool looks_like_carmen(std::string_view line)
{
    const std::size_t n = std::min(line.find_first_of(" \t"), line.size());
    return line[0] >= 'A' && line[0] <= 'Z' &&
           line.substr(0, n).find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789") ==
               std::string_view::npos;
}

/// Times can be told apart if they never go backwards and are half as many as the scans, as of two
/// lasers that scan together, or more. A few digits of the seconds since 1970 are fewer.
bool are_times_sound(const std::vector<Scan> &scans)
{
    std::size_t n_times = 1;
    for (std::size_t i = 1; i < scans.size(); ++i) {
        if (scans[i].t_s < scans[i - 1].t_s) {
            return false;
        }
        n_times += scans[i].t_s > scans[i - 1].t_s ? 1u : 0u;
    }
    return n_times > 1 && 2 * n_times >= scans.size();
}

void mend_times(std::vector<Scan> &scans)
{
    if (are_times_sound(scans)) {
        return;
    }
    for (std::size_t i = 0; i < scans.size(); ++i) {
        scans[i].t_s = static_cast<double>(i);
    }
}

} // namespace

std::vector<Scan> read_scans(const std::string &path, const ReadOptions &options)
{
    enum class Format { unknown, csv, carmen } format = Format::unknown;
    LineReader reader(path, "CSV scans or a CARMEN log, plain or gzipped");
    std::vector<Scan> scans;
    std::vector<std::string_view> fields;
    std::string line;
    while (reader.next(line)) {
        const std::string_view text = trimmed(line);
        if (text.empty() || text[0] == '#') {
            continue;
        }
        if (format == Format::unknown) {
            format = looks_like_carmen(text) ? Format::carmen : Format::csv;
        }
        if (format == Format::csv) {
            split_commas(text, fields);
            scans.push_back(parse_csv(fields, reader.place()));
            continue;
        }
        split_blanks(text, fields);
        if (fields[0] == "FLASER") {
            scans.push_back(parse_flaser(fields, options.range_max_m, reader.place()));
        }
    }
    if (scans.empty()) {
        reader.place().fail("no scans in this file; need CSV scans or CARMEN FLASER lines");
    }
    if (format == Format::carmen) {
        mend_times(scans);
    }
    return scans;
}

std::string scans_csv(const std::vector<Scan> &scans, const std::string &header_comment)
{
    std::string text = "# ";
    for (const char c : header_comment) {
        text += c;
        text += c == '\n' ? "# " : "";
    }
    text += "\n# t_s,x_m,y_m,theta_rad,angle_min_rad,angle_step_rad,range_max_m,ranges_m...\n";
    for (const Scan &scan : scans) {
        append_number(text, scan.t_s);
        for (const double value : {scan.x_m, scan.y_m, scan.theta_rad, scan.angle_min_rad,
                                   scan.angle_step_rad, scan.range_max_m}) {
            text += ',';
            append_number(text, value);
        }
        for (const float range_m : scan.ranges_m) {
            text += ',';
            append_number(text, range_m);
        }
        text += '\n';
    }
    return text;
}

void write_scans_csv(const std::string &path, const std::vector<Scan> &scans,
                     const std::string &header_comment)
{
    replace_files({{path, scans_csv(scans, header_comment)}});
}

} // namespace gpom_tools
