#include "tools/eval/trial.hpp"

#include "tools/eval/stretch.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace gpom_tools
{
namespace
{

constexpr double kPi = 3.14159265358979323846;

/// Find the corners of the box around all beams.
void cover_beams(Trial &trial)
{
    constexpr double kFar = std::numeric_limits<double>::infinity();
    trial.low = {kFar, kFar};
    trial.high = {-kFar, -kFar};
    const auto cover = [&](gpom_point_t point) {
        trial.low = {std::min(trial.low.x_m, point.x_m), std::min(trial.low.y_m, point.y_m)};
        trial.high = {std::max(trial.high.x_m, point.x_m), std::max(trial.high.y_m, point.y_m)};
    };
    for (const GridBeam &beam : trial.beams) {
        cover({beam.x_m, beam.y_m});
        cover(end_of(beam));
    }
}

LogSplit split_of(const EvalOptions &options, const std::vector<Scan> &scans)
{
    if (options.split == "runs") {
        return split_log_runs(scans, options.fraction, options.seed);
    }
    return split_log(scans, std::min(options.fraction, kTrainingShareMax), options.seed);
}

} // namespace

Trial street_trial(const EvalOptions &options)
{
    return street_trial(options, read_scans(options.scans_path, options.reading));
}

Trial log_trial(const EvalOptions &options)
{
    return log_trial(options, read_log(options.scans_path, options.reading));
}

Trial street_trial(const EvalOptions &options, std::vector<Scan> scans)
{
    Trial trial;
    trial.mode = "street";
    trial.truth = read_truth(options.truth_path);
    trial.scans = std::move(scans);
    trial.beams = beams_of(trial.scans, kHalfSpacing);
    trial.test.points = street_points(*trial.truth, options.n_points, options.seed);
    for (const TestPoint &point : trial.test.points) {
        trial.test.near_beam.push_back(is_near(point.at, trial.beams, kNearBeam));
    }
    trial.test.profile = profile_across(*trial.truth, trial.scans, options.seed);
    trial.low = {trial.truth->x0_m, trial.truth->y0_m};
    trial.high = {trial.low.x_m + trial.truth->nx * trial.truth->cell_m,
                  trial.low.y_m + trial.truth->ny * trial.truth->cell_m};
    return trial;
}

Trial log_trial(const EvalOptions &options, std::vector<Scan> scans)
{
    Trial trial;
    trial.mode = "log";
    LogSplit split = split_of(
        options, after_metres(evenly_taken(std::move(scans), kLogScansMax), options.after_m));
    const double half_width_rad = 0.5 * options.beam_width_deg * kPi / 180.0;
    trial.beams = beams_of(split.training, half_width_rad);
    trial.other_beams = beams_of(split.others, half_width_rad);
    trial.scans = std::move(split.training);
    trial.test.points = std::move(split.points);
    trial.test.profile = profile_along(trial.other_beams, options.seed);
    cover_beams(trial);
    return trial;
}

} // namespace gpom_tools
