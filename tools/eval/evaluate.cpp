#include "tools/eval/evaluate.hpp"

#include "ports/host/params_toml.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

namespace gpom_tools
{
namespace
{

MethodResult gp_result(const std::string &key, const std::string &label, const Trial &trial,
                       const HostMap &map)
{
    MethodResult method;
    method.key = key;
    method.label = label;
    for (const gpom_answer_t &answer : map.query(places_of(trial.test))) {
        method.probabilities.push_back(double{answer.probability});
    }
    return judged(std::move(method), trial.test);
}

/// Path of the paper's parameters: the option if given, otherwise NAME_paper.toml beside NAME.toml,
/// otherwise empty.
std::string map_frame_path(const EvalOptions &options)
{
    if (!options.map_frame_path.empty()) {
        return options.map_frame_path;
    }
    std::filesystem::path beside = options.params_path;
    beside.replace_filename(beside.stem().string() + "_paper.toml");
    return std::filesystem::exists(beside) ? beside.string() : "";
}

gpom_params_t read_map_frame_params(const std::string &path)
{
    const gpom_params_t params = read_params(path);
    if (params.kernel != GPOM_KERNEL_NN || params.frame != GPOM_FRAME_MAP) {
        throw FileError(path, 0,
                        "is for the paper's map; it needs kernel = \"nn\", frame = \"map\"");
    }
    return params;
}

std::string text_of(const std::string &path)
{
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void add_rivals(const EvalOptions &options, const Trial &trial, Outcome &outcome)
{
    if (options.rivals) {
        outcome.methods.push_back(judged_strong_grid(trial));
        outcome.methods.push_back(judged_octomap(trial));
    }
    if (!options.exact_gp) {
        return;
    }
    if (std::optional<MethodResult> exact = judged_exact_gp(trial)) {
        outcome.methods.push_back(std::move(*exact));
    } else {
        outcome.notes.push_back("exact GP: scikit-learn is not installed; run "
                                "tools/setup results");
    }
}

} // namespace

HostMap map_of(const Trial &trial, const gpom_params_t &params)
{
    HostMap map(params, beam_count(trial.scans), middle_of(trial.scans));
    map.insert(trial.scans);
    return map;
}

Outcome evaluate(const EvalOptions &options, const Trial &trial)
{
    Outcome outcome;
    const std::string map_frame = map_frame_path(options);
    const gpom_params_t params = read_params(options.params_path);
    require_neighbours(options, params);
    const HostMap map = map_of(trial, params);
    outcome.prior_variance = double{gpom_params_prior_variance(&params)};
    outcome.methods.push_back(gp_result("gp_query", "GP, query frame", trial, map));
    if (!map_frame.empty()) {
        const HostMap paper = map_of(trial, read_map_frame_params(map_frame));
        outcome.methods.push_back(
            gp_result("gp_map", "GP, map frame (as the paper)", trial, paper));
    } else {
        outcome.notes.push_back("GP in the map frame: no NAME_paper.toml beside " +
                                options.params_path + " and no --map-frame-params");
    }
    for (const std::string &path : options.also_paths) {
        const std::string name = std::filesystem::path(path).stem().string();
        const HostMap also = map_of(trial, read_params(path));
        outcome.methods.push_back(gp_result("gp_" + name, "GP, " + name, trial, also));
    }
    outcome.log_odds = chosen_grids(options, trial);
    outcome.grids = grid_constants(*outcome.log_odds);
    outcome.methods.push_back(outcome.log_odds->thin.result);
    outcome.methods.push_back(outcome.log_odds->wide.result);
    add_rivals(options, trial, outcome);
    if (!options.neighbours.empty()) {
        outcome.neighbours = check_neighbours(options, trial, params);
    }
    return outcome;
}

nlohmann::ordered_json eval_json(const EvalOptions &options, const Trial &trial,
                                 const Outcome &outcome)
{
    nlohmann::ordered_json json;
    json["mode"] = trial.mode;
    json["command"] = options.command;
    json["scans_file"] = options.scans_path;
    json["seed"] = options.seed;
    json["scans"] = trial.scans.size();
    json["beams"] = trial.beams.size();
    json["prior_variance"] = outcome.prior_variance;
    json.update(outcome.grids);
    if (trial.truth) {
        json["truth_file"] = options.truth_path;
    } else {
        json["split"] = options.split;
        json["fraction"] = options.fraction;
        json["range_max_m"] = options.reading.range_max_m;
        json["beam_width_deg"] = options.beam_width_deg;
        json["after_m"] = options.after_m;
    }
    json["params"] = {{"file", options.params_path}, {"text", text_of(options.params_path)}};
    const std::string map_frame = map_frame_path(options);
    if (!map_frame.empty()) {
        json["map_frame_params"] = {{"file", map_frame}, {"text", text_of(map_frame)}};
    }
    json.update(report_json(outcome.methods));
    if (!outcome.neighbours.empty()) {
        json["neighbours"] = neighbour_json(outcome.neighbours);
    }
    json["left_out"] = outcome.notes;
    return json;
}

} // namespace gpom_tools
