#include "tools/live/repose.hpp"

#include "ports/host/params_toml.hpp"
#include "tools/live/report.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <string>
#include <unordered_map>

namespace gpom_tools
{
namespace
{

using Json = nlohmann::ordered_json;

constexpr double kPi = 3.14159265358979323846;

/// Scans of the split, each with its right and its drifted pose.
struct Drifts {
    std::vector<Scan> right, drifted;
    LogSplit split;
    double greatest_m = 0.0;
};

/// The bits of the ranges, because NaN is not equal to itself.
std::string key_of(const Scan &scan)
{
    return {reinterpret_cast<const char *>(scan.ranges_m.data()),
            scan.ranges_m.size() * sizeof(float)};
}

/// For each scan the scan of another log with the same ranges. Scans without one are left out.
std::vector<std::pair<Scan, Scan>> matched(const std::vector<Scan> &scans,
                                           const std::vector<Scan> &others)
{
    std::unordered_map<std::string, const Scan *> by_ranges;
    for (const Scan &other : others) {
        by_ranges.emplace(key_of(other), &other);
    }
    std::vector<std::pair<Scan, Scan>> pairs;
    for (const Scan &scan : scans) {
        const auto found = by_ranges.find(key_of(scan));
        if (found != by_ranges.end()) {
            pairs.emplace_back(scan, *found->second);
        }
    }
    return pairs;
}

/// The drifted pose in the frame in which both logs begin at the same pose.
Scan in_frame_of(const std::pair<Scan, Scan> &first, const Scan &drifted)
{
    const double turn = first.first.theta_rad - first.second.theta_rad;
    const double x = drifted.x_m - first.second.x_m;
    const double y = drifted.y_m - first.second.y_m;
    Scan scan = drifted;
    scan.x_m = first.first.x_m + std::cos(turn) * x - std::sin(turn) * y;
    scan.y_m = first.first.y_m + std::sin(turn) * x + std::cos(turn) * y;
    scan.theta_rad = drifted.theta_rad + turn;
    return scan;
}

double short_way(double angle_rad) { return std::remainder(angle_rad, 2.0 * kPi); }

/// Fill the drifted poses. The error of the yaw is followed from scan to scan, because it may be
/// more than half a turn.
void fill_drifts(Drifts &drifts, const std::vector<std::pair<Scan, Scan>> &pairs, double share)
{
    double yaw_error = 0.0;
    for (const auto &pair : pairs) {
        const Scan drifted = in_frame_of(pairs.front(), pair.second);
        yaw_error += short_way(drifted.theta_rad - pair.first.theta_rad - yaw_error);
        Scan scan = pair.first;
        scan.x_m += share * (drifted.x_m - pair.first.x_m);
        scan.y_m += share * (drifted.y_m - pair.first.y_m);
        scan.theta_rad += share * yaw_error;
        drifts.greatest_m = std::max(
            drifts.greatest_m, std::hypot(scan.x_m - pair.first.x_m, scan.y_m - pair.first.y_m));
        drifts.drifted.push_back(std::move(scan));
    }
}

Drifts read_drifts(const ReposeOptions &options)
{
    const JudgeOptions &judge = options.judge;
    const auto pairs = matched(read_log(judge.scans_path, judge.reading),
                               read_log(options.drifted_path, judge.reading));
    if (pairs.size() < 2) {
        throw FileError(options.drifted_path, 0,
                        "has no scans with the ranges of " + judge.scans_path +
                            "; give the log of the same drive before its poses were corrected");
    }
    Drifts drifts;
    fill_drifts(drifts, pairs, options.share);
    for (const auto &pair : pairs) {
        drifts.right.push_back(pair.first);
    }
    drifts.split = split_log(drifts.right, judge.fraction, judge.seed);
    drifts.right = drifts.split.training;
    for (std::size_t i = 0; i < drifts.right.size(); ++i) {
        drifts.drifted[i].ranges_m = drifts.right[i].ranges_m;
    }
    return drifts;
}

double milliseconds_of(const std::function<void()> &work)
{
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> spent =
        std::chrono::steady_clock::now() - start;
    return spent.count();
}

class Trial {
public:
    explicit Trial(const ReposeOptions &options)
        : options_(options), params_(read_params(options.judge.params_path)),
          drifts_(read_drifts(options))
    {
    }

    Json run() const
    {
        const std::size_t n = drifts_.right.size();
        const std::size_t half = n / 2;
        Json figures = {{"scans", n}, {"drift_m", drifts_.greatest_m}};
        figures["right"] = accuracy(driven(drifts_.right, n));
        HostMap map = driven(drifts_.drifted, n);
        figures["drifted"] = accuracy(map);
        figures["repose"] = repose(map, n);
        figures["reposed"] = accuracy(map);
        for (const char *rule : {"repose", "keep", "clear"}) {
            figures[std::string("half drifted, then ") + rule] = accuracy(gone_on(half, rule));
        }
        return figures;
    }

private:
    HostMap driven(const std::vector<Scan> &scans, std::size_t n) const
    {
        HostMap map(live_config(params_, options_.judge.live, middle_of(drifts_.right)));
        go(map, scans, 0, n);
        return map;
    }

    void go(HostMap &map, const std::vector<Scan> &scans, std::size_t first, std::size_t end) const
    {
        for (std::size_t i = first; i < end; ++i) {
            map.insert(scans[i]);
            map.step(options_.judge.live.step_ops);
        }
    }

    /// Correct the first n scans, and build the trees anew in slices.
    Json repose(HostMap &map, std::size_t n) const
    {
        std::vector<gpom_correction_t> corrections;
        for (std::size_t i = 0; i < n; ++i) {
            const Scan &from = drifts_.drifted[i];
            const Scan &to = drifts_.right[i];
            corrections.push_back({stamp_us(to),
                                   {from.x_m, from.y_m, from.theta_rad, nullptr},
                                   {to.x_m, to.y_m, to.theta_rad, nullptr}});
        }
        gpom_repose_report_t report;
        const double ms = milliseconds_of([&] { report = map.repose(corrections); });
        double ms_max = 0.0;
        std::size_t n_steps = 0;
        for (std::uint64_t used = 1; used > 0; ++n_steps) {
            ms_max = std::max(
                ms_max, milliseconds_of([&] { used = map.step(options_.judge.live.step_ops); }));
        }
        return {{"ms", ms},
                {"steps", n_steps - 1},
                {"step_ms_max", ms_max},
                {"moved", report.n_moved},
                {"before", report.n_before},
                {"after", report.n_after},
                {"restored", report.n_restored},
                {"forgotten", report.n_forgotten}};
    }

    HostMap gone_on(std::size_t half, const std::string &rule) const
    {
        HostMap map = driven(drifts_.drifted, half);
        if (rule == "repose") {
            repose(map, half);
        } else {
            map.jump(rule == "keep" ? GPOM_JUMP_KEEP : GPOM_JUMP_CLEAR);
        }
        go(map, drifts_.right, half, drifts_.right.size());
        return map;
    }

    Json accuracy(const HostMap &map) const
    {
        return accuracy_of(map, {drifts_.split.points, {}, {}});
    }

    const ReposeOptions &options_;
    gpom_params_t params_;
    Drifts drifts_;
};

} // namespace

Json repose_report(const ReposeOptions &options) { return Trial(options).run(); }

} // namespace gpom_tools
