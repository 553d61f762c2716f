#include "ports/host/scan_log.hpp"

#include "ports/host/carmen_log.hpp"
#include "ports/host/laser_angles.hpp"
#include "ports/host/text_lines.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <set>

namespace gpom_tools
{
namespace
{

void parse_ranges(const std::vector<std::string_view> &fields, std::size_t i_first,
                  std::vector<float> &ranges_m, const Place &place)
{
    for (std::size_t i = 0; i < ranges_m.size(); ++i) {
        const auto name = [&] { return "range " + std::to_string(i); };
        const std::string_view text = fields[i_first + i];
        ranges_m[i] = parse_number<float>(text, name(), place);
    }
}

void require_radians(const Scan &scan, const Place &place)
{
    constexpr double kTurns_max = 2.0;
    const double n_steps = static_cast<double>(scan.ranges_m.size()) - 1.0;
    const double n_turns = std::abs(scan.angle_step_rad) * n_steps / (360.0 * kDegree);
    if (n_turns > kTurns_max) {
        std::string text = "the beams of this scan go over ";
        append_number(text, std::round(n_turns * 10.0) / 10.0);
        place.fail(text + " turns; angles are in radians, and angle_step looks like degrees");
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
    require_radians(scan, place);
    parse_ranges(fields, n_head, scan.ranges_m, place);
    return scan;
}

/// Nearly all scans of one laser have the same number of ranges. Note how many scans of a file
/// differ.
std::vector<std::string> notes_on_counts(const std::vector<Scan> &scans)
{
    std::map<std::size_t, std::size_t> n_scans_of;
    for (const Scan &scan : scans) {
        ++n_scans_of[scan.ranges_m.size()];
    }
    const auto most =
        std::max_element(n_scans_of.begin(), n_scans_of.end(),
                         [](const auto &a, const auto &b) { return a.second < b.second; });
    const std::size_t n_others = scans.size() - (scans.empty() ? 0 : most->second);
    if (n_others == 0 || 10 * n_others > scans.size()) {
        return {};
    }
    const auto first = std::find_if(scans.begin(), scans.end(), [&](const Scan &scan) {
        return scan.ranges_m.size() != most->first;
    });
    return {std::to_string(n_others) + " of " + std::to_string(scans.size()) +
            " scans do not have " + std::to_string(most->first) +
            " ranges as the others do; the first is scan " +
            std::to_string(first - scans.begin() + 1) + ", with " +
            std::to_string(first->ranges_m.size()) + ": is the file cut there?"};
}

/// Apply the meaning of readings of 0 and of readings that are too near.
void apply_range_min(std::vector<Scan> &scans, const ReadOptions &options)
{
    const auto range_min_m = static_cast<float>(options.range_min_m);
    constexpr float kNoReturn = std::numeric_limits<float>::infinity();
    const float too_near =
        options.is_too_near_no_return ? kNoReturn : std::numeric_limits<float>::quiet_NaN();
    for (Scan &scan : scans) {
        for (float &range_m : scan.ranges_m) {
            if (range_m == 0.0f && options.is_zero_no_return) {
                range_m = kNoReturn;
            } else if (range_m > 0.0f && range_m < range_min_m) {
                range_m = too_near;
            }
        }
    }
}

void require_scans(const ScanLog &log, const Place &place)
{
    if (!log.scans.empty()) {
        return;
    }
    std::string text = "no scans in this file; need CSV scans or CARMEN FLASER, ROBOTLASER or "
                       "RAWLASER lines";
    for (const std::string &note : log.notes) {
        text += "; " + note;
    }
    place.fail(text);
}

} // namespace

ScanLog read_scan_log(const std::string &path, const ReadOptions &options)
{
    enum class Format { unknown, csv, carmen } format = Format::unknown;
    LineReader reader(path, "CSV scans or a CARMEN log, plain, gzipped or packed with bzip2");
    ScanLog csv;
    CarmenLog carmen(options);
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
            csv.scans.push_back(parse_csv(fields, reader.place()));
            reader.require_line_end();
        } else {
            split_blanks(text, fields);
            carmen.take(fields, reader.place());
        }
    }
    csv.notes = notes_on_counts(csv.scans);
    ScanLog log = format == Format::carmen ? carmen.finish() : std::move(csv);
    require_scans(log, reader.place());
    apply_range_min(log.scans, options);
    return log;
}

std::vector<Scan> read_scans(const std::string &path, const ReadOptions &options)
{
    static std::set<std::string> told;
    ScanLog log = read_scan_log(path, options);
    for (const std::string &note : log.notes) {
        if (told.insert(path + ": " + note).second) {
            std::fprintf(stderr, "%s: %s\n", path.c_str(), note.c_str());
        }
    }
    return std::move(log.scans);
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
