#include "tools/live/merge.hpp"

#include "ports/host/params_toml.hpp"
#include "tools/live/report.hpp"

#include <cmath>

namespace gpom_tools
{
namespace
{

using Json = nlohmann::ordered_json;

/// The same pose in the frames of the first and of the second robot.
constexpr gpom_pose_t kHere = {0.0, 0.0, 0.0, nullptr};
constexpr gpom_pose_t kThere = {120.0, -40.0, 2.0, nullptr};

/// The scan in the frame of the second robot.
Scan seen_there(const Scan &scan)
{
    Scan there = scan;
    const double turn = kThere.yaw_rad - kHere.yaw_rad;
    const double x = scan.x_m - kHere.x_m;
    const double y = scan.y_m - kHere.y_m;
    there.x_m = kThere.x_m + std::cos(turn) * x - std::sin(turn) * y;
    there.y_m = kThere.y_m + std::sin(turn) * x + std::cos(turn) * y;
    there.theta_rad += turn;
    return there;
}

} // namespace

Json merge_report(const JudgeOptions &options)
{
    const gpom_params_t params = read_params(options.params_path);
    const JudgeData data = judge_data(options);
    const auto middle = data.scans.begin() + static_cast<std::ptrdiff_t>(data.scans.size() / 2);
    const std::vector<Scan> first(data.scans.begin(), middle);
    std::vector<Scan> second;
    std::transform(middle, data.scans.end(), std::back_inserter(second), seen_there);
    const TestSet test{data.points, {}, {}};
    HostMap map = live_map(params, options.live, first);
    const Json alone = accuracy_of(map, test);
    const gpom_import_report_t report =
        map.import(live_map(params, options.live, second).kept(), kThere, kHere);
    while (map.step(options.live.step_ops) > 0) {
    }
    return {{"one robot", accuracy_of(live_map(params, options.live, data.scans), test)},
            {"first half", alone},
            {"both halves", accuracy_of(map, test)},
            {"import",
             {{"kept", report.n_kept},
              {"known", report.n_known},
              {"not_useful", report.n_not_useful},
              {"out_of_reach", report.n_out_of_reach},
              {"damaged", report.n_damaged}}}};
}

} // namespace gpom_tools
