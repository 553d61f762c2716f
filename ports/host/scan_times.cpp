#include "ports/host/scan_times.hpp"

#include "ports/host/text_lines.hpp"

#include <algorithm>
#include <cmath>

namespace gpom_tools
{
namespace
{

/// Intervals between scans, where the time advances.
struct Intervals {
    double median_s; ///< 0 if there are none.
    std::size_t n_advances;
};

Intervals intervals_of(const std::vector<Scan> &scans)
{
    std::vector<double> intervals_s;
    for (std::size_t i = 1; i < scans.size(); ++i) {
        const double interval_s = scans[i].t_s - scans[i - 1].t_s;
        if (interval_s > 0.0) {
            intervals_s.push_back(interval_s);
        }
    }
    if (intervals_s.empty()) {
        return {0.0, 0};
    }
    const auto middle = intervals_s.begin() + static_cast<std::ptrdiff_t>(intervals_s.size() / 2);
    std::nth_element(intervals_s.begin(), middle, intervals_s.end());
    return {*middle, intervals_s.size()};
}

/// Number of scans between a scan and the last earlier scan whose time is sound and not later. 0:
/// the time of the scan before is not later.
std::size_t count_later_before(const std::vector<Scan> &scans, const std::vector<bool> &is_spread,
                               std::size_t i_scan)
{
    const double t_s = scans[i_scan].t_s;
    if (scans[i_scan - 1].t_s <= t_s) {
        return 0;
    }
    std::size_t n = 1;
    while (n < i_scan && (is_spread[i_scan - 1 - n] || scans[i_scan - 1 - n].t_s > t_s)) {
        ++n;
    }
    return n;
}

/// True if the clock runs on and only the stamps in between are late: the time since the last scan
/// that is not later is about as long as this number of scans takes.
bool are_stamps_late(const std::vector<Scan> &scans, std::size_t i_scan, std::size_t n_later,
                     double median_s)
{
    if (n_later >= i_scan) {
        return false;
    }
    const double span_s = scans[i_scan].t_s - scans[i_scan - 1 - n_later].t_s;
    return span_s >= 0.5 * median_s * static_cast<double>(n_later + 1);
}

/// Set the times of the scans between two scans evenly between the times of these two.
void spread(std::vector<Scan> &scans, std::vector<bool> &is_spread, std::size_t i_first,
            std::size_t i_last)
{
    const double first_s = scans[i_first].t_s;
    const double step_s = (scans[i_last].t_s - first_s) / static_cast<double>(i_last - i_first);
    for (std::size_t i = i_first + 1; i < i_last; ++i) {
        scans[i].t_s = first_s + static_cast<double>(i - i_first) * step_s;
        is_spread[i] = true;
    }
}

std::string number_text(double value)
{
    std::string text;
    append_number(text, std::round(value * 1e6) * 1e-6);
    return text;
}

/// Use the numbers of the scans as times, because there are too few different times for a clock.
std::string number_scans(std::vector<Scan> &scans, std::size_t n_times)
{
    for (std::size_t i = 0; i < scans.size(); ++i) {
        scans[i].t_s = static_cast<double>(i);
    }
    return "only " + std::to_string(n_times) + " times in " + std::to_string(scans.size()) +
           " scans: the time of each scan is its number, in seconds";
}

std::vector<std::string> sentences(std::ptrdiff_t n_spread, std::size_t n_back, std::size_t i_back,
                                   double back_s)
{
    std::vector<std::string> done;
    if (n_spread > 0) {
        done.push_back(std::to_string(n_spread) + (n_spread == 1 ? " time" : " times") +
                       " out of order: set between the times before and after");
    }
    if (n_back > 0) {
        done.push_back("the clock goes back " + std::to_string(n_back) +
                       (n_back == 1 ? " time, at scan " : " times, first at scan ") +
                       std::to_string(i_back + 1) + " by " + number_text(back_s) +
                       " s: the times from there on are moved so that they go on");
    }
    return done;
}

} // namespace

std::vector<std::string> mend_times(std::vector<Scan> &scans)
{
    const Intervals intervals = intervals_of(scans);
    const std::size_t n_times = intervals.n_advances + 1;
    if (scans.size() > 1 && (n_times == 1 || 2 * n_times < scans.size())) {
        return {number_scans(scans, n_times)};
    }
    std::vector<bool> is_spread(scans.size(), false);
    std::size_t n_back = 0, i_back = 0;
    double shift_s = 0.0, back_s = 0.0;
    for (std::size_t i = 1; i < scans.size(); ++i) {
        scans[i].t_s += shift_s;
        const std::size_t n_later = count_later_before(scans, is_spread, i);
        if (n_later == 0) {
            continue;
        }
        if (are_stamps_late(scans, i, n_later, intervals.median_s)) {
            spread(scans, is_spread, i - n_later - 1, i);
        } else if (i + 1 < scans.size() && scans[i + 1].t_s + shift_s >= scans[i - 1].t_s) {
            scans[i].t_s = 0.5 * (scans[i - 1].t_s + scans[i + 1].t_s + shift_s);
            is_spread[i] = true;
        } else {
            const double on_s = scans[i - 1].t_s + intervals.median_s - scans[i].t_s;
            if (n_back++ == 0) {
                i_back = i;
                back_s = scans[i - 1].t_s - scans[i].t_s;
            }
            shift_s += on_s;
            scans[i].t_s += on_s;
        }
    }
    const auto n_spread = std::count(is_spread.begin(), is_spread.end(), true);
    return sentences(n_spread, n_back, i_back, back_s);
}

} // namespace gpom_tools
