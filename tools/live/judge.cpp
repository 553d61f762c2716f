#include "tools/live/judge.hpp"

#include "ports/host/params_toml.hpp"
#include "ports/host/progress.hpp"
#include "tools/eval/report.hpp"
#include "tools/eval/unchanged_points.hpp"
#include "tools/live/report.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gpom_tools
{
namespace
{

using Json = nlohmann::ordered_json;

/// Number of a street's scans whose beams decide which places are near a beam.
constexpr std::size_t kNearScans = 50;

/// Random stream that differs from the split's, which uses the seed itself.
constexpr std::uint64_t kDrawSeed = 2000;

JudgeData street_data(const JudgeOptions &options)
{
    JudgeData data{read_scans(options.scans_path, options.reading), {}, {}, {}};
    const Truth truth = read_truth(options.truth_path);
    const std::vector<Scan> near_scans = evenly_taken(data.scans, kNearScans);
    const std::vector<GridBeam> beams = beams_of(near_scans, kHalfSpacing);
    const std::vector<TestPoint> points = street_points(truth, options.n_points, options.seed);
    data.profile = profile_across(truth, near_scans, options.seed);
    std::copy_if(points.begin(), points.end(), std::back_inserter(data.points),
                 [&](const TestPoint &point) { return is_near(point.at, beams, kNearBeam); });
    return data;
}

JudgeData log_data(const JudgeOptions &options)
{
    LogSplit split =
        split_log(read_log(options.scans_path, options.reading), options.fraction, options.seed);
    const std::vector<GridBeam> others = beams_of(split.others, 0.0);
    return {std::move(split.training), std::move(split.points), profile_along(others, options.seed),
            others};
}

MethodResult judged(const std::vector<gpom_answer_t> &answers, const TestSet &test)
{
    MethodResult method;
    for (const gpom_answer_t &answer : answers) {
        method.probabilities.push_back(double{answer.probability});
    }
    return judged(std::move(method), test);
}

/// Results of the thresholds of the parameters: how many of the points called free are occupied,
/// how many of the points called occupied are free, and how many points are unsure.
Json classes_json(const std::vector<gpom_answer_t> &answers, const std::vector<TestPoint> &points)
{
    double n_free = 0.0, n_occupied = 0.0, n_free_wrong = 0.0, n_occupied_wrong = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (answers[i].cls == GPOM_FREE) {
            n_free += 1.0;
            n_free_wrong += points[i].occupied ? 1.0 : 0.0;
        } else if (answers[i].cls == GPOM_OCCUPIED) {
            n_occupied += 1.0;
            n_occupied_wrong += points[i].occupied ? 0.0 : 1.0;
        }
    }
    const double n = static_cast<double>(points.size());
    return {{"occupied_of_free", n_free_wrong / std::max(n_free, 1.0)},
            {"free_of_occupied", n_occupied_wrong / std::max(n_occupied, 1.0)},
            {"unsure", (n - n_free - n_occupied) / n}};
}

/// Without a profile in the test set, the result has no profile.
Json accuracy_json(const HostMap &map, const TestSet &test)
{
    const std::vector<gpom_answer_t> answers = map.query(places_of(test));
    const MethodResult method = judged(answers, test);
    Json json = {{"kept", gpom_map_beam_count(map.get())},
                 {"auc", method.all.auc},
                 {"fp_at_tp95", method.all.false_positive_rate},
                 {"nll", method.all.nll},
                 {"ece", method.all.calibration_error},
                 {"classes", classes_json(answers, test.points)}};
    if (method.band) {
        json["band"] = json_of(*method.band);
    }
    if (!test.profile.empty()) {
        json["profile"] = json_of(method.profile);
    }
    return json;
}

/// True if a map can use a reading.
bool is_beam(float range_m) { return range_m > 0.0f; } // NaN gives false

/// Keep n random beams and set all others to NaN: Knuth, The Art of Computer Programming, vol. 2,
/// algorithm 3.4.2 S.
std::vector<Scan> drawn(std::vector<Scan> scans, std::size_t n, std::uint64_t seed)
{
    std::size_t n_left = 0;
    for (const Scan &scan : scans) {
        n_left += static_cast<std::size_t>(
            std::count_if(scan.ranges_m.begin(), scan.ranges_m.end(), is_beam));
    }
    ProtocolRandom random(seed);
    for (Scan &scan : scans) {
        for (float &range_m : scan.ranges_m) {
            if (!is_beam(range_m)) {
                continue;
            }
            if (random.uniform() * static_cast<double>(n_left--) < static_cast<double>(n)) {
                --n;
            } else {
                range_m = std::numeric_limits<float>::quiet_NaN();
            }
        }
    }
    return scans;
}

/// Drive a map through all scans and record the work of its steps. Calls advance(n) when the first
/// n scans are in the map.
template <class Advance>
Json drive(HostMap &map, const std::vector<Scan> &scans, std::uint64_t step_ops,
           const Advance &advance)
{
    std::uint64_t ops = 0, ops_max = 0;
    for (std::size_t i = 0; i < scans.size(); ++i) {
        map.insert(scans[i]);
        const std::uint64_t used = map.step(step_ops);
        ops += used;
        ops_max = std::max(ops_max, used);
        advance(i + 1);
    }
    return {{"mean", static_cast<double>(ops) / static_cast<double>(scans.size())},
            {"max", ops_max},
            {"budget", step_ops}};
}

} // namespace

JudgeData judge_data(const JudgeOptions &options)
{
    return options.truth_path.empty() ? log_data(options) : street_data(options);
}

HostMap live_map(const gpom_params_t &params, const LiveConfig &live,
                 const std::vector<Scan> &scans)
{
    HostMap map(live_config(params, live, middle_of(scans)), live.late_m);
    drive(map, scans, live.step_ops, [](std::size_t) {});
    return map;
}

Metrics live_accuracy(const gpom_params_t &params, const LiveConfig &live, const JudgeData &data)
{
    const TestSet test{data.points, {}, {}};
    return judged(live_map(params, live, data.scans).query(places_of(test)), test).all;
}

Json judge_report(const JudgeOptions &options)
{
    const gpom_params_t params = read_params(options.params_path);
    const bool is_log = options.truth_path.empty();
    JudgeData data = judge_data(options);
    const TestSet test{data.points, {}, data.profile};
    const TestSet unchanged{
        is_log ? unchanged_points(data.points, data.scans) : data.points, {}, {}};
    add_spurious(data.scans, options.spurious, options.seed);
    const gpom_point_t middle = middle_of(data.scans);
    HostMap live(live_config(params, options.live, middle), options.live.late_m);
    Progress progress("mapping");
    const Json ops = drive(live, data.scans, options.live.step_ops,
                           [&](std::size_t n) { progress.update(n, data.scans.size()); });
    const std::size_t n = gpom_map_beam_count(live.get());
    HostMap random(params, n, middle);
    random.insert(drawn(data.scans, n, options.seed + kDrawSeed));
    return {{"live", accuracy_json(live, test)},
            {"random", accuracy_json(random, test)},
            {"points", test.points.size()},
            {"unchanged",
             {{"live", accuracy_json(live, unchanged)},
              {"random", accuracy_json(random, unchanged)},
              {"points", unchanged.points.size()}}},
            {"scans", data.scans.size()},
            {"beam_max", options.live.beam_max},
            {"map_bytes", live.bytes()},
            {"step_ops", ops},
            {"counts", counts_json(live.stats())}};
}

} // namespace gpom_tools
