// gpom-sim: simulated streets with laser scans and ground truth.
#include "ports/host/command_line.hpp"
#include "ports/host/progress.hpp"
#include "tools/sim/street.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{

struct Options {
    std::string out_path;
    std::string truth_path;
    std::string truth_empty_path;
    gpom_tools::StreetConfig street;
};

/// Check a seed here, because CLI11 would turn -3, or a number that is too large, into another
/// seed.
std::string check_seed(const std::string &text)
{
    std::uint64_t seed = 0;
    const char *const end = text.data() + text.size();
    const auto result = std::from_chars(text.data(), end, seed);
    const bool whole = result.ec == std::errc{} && result.ptr == end;
    return whole ? "" : "must be a whole number from 0 to 2^64 - 1, is '" + text + "'";
}

void declare_options(CLI::App &app, Options &options)
{
    gpom_tools::StreetConfig &street = options.street;
    app.add_option("--out", options.out_path, "Scans to write, CSV")->required()->type_name("FILE");
    app.add_option("--truth", options.truth_path, "Ground truth to write, PGM image")
        ->type_name("FILE");
    app.add_option("--truth-empty", options.truth_empty_path,
                   "Ground truth without vehicles to write, PGM image")
        ->type_name("FILE");
    app.add_option("--seed", street.seed, "Seed. The same seed gives the same street")
        ->check(check_seed);
    app.add_option("--width", street.width_m, "Area's extent along x [m]");
    app.add_option("--height", street.height_m, "Area's extent along y [m]");
    app.add_option("--scans", street.n_scans, "Number of scans");
    app.add_option("--beams", street.n_beams, "Beams in each scan");
    app.add_option("--fov-deg", street.fov_deg, "Field of view around the heading [degree]");
    app.add_option("--range-max", street.range_max_m,
                   "Maximum range [m]; beyond it there is no return");
    app.add_option("--range-noise", street.range_noise_m, "Standard deviation of ranges [m]");
    app.add_option("--step", street.step_m, "Way driven from scan to scan [m]");
    app.add_option("--truth-cell", street.truth_cell_m, "Cell size of the ground truth [m]");
    app.add_option("--cars-arrive-at", street.cars_arrive_at, "First scan with parked vehicles");
    app.add_option("--cars-leave-at", street.cars_leave_at,
                   "First scan without them again; -1: they stay");
    for (CLI::Option *option : app.get_options()) {
        const std::string name = option->get_name();
        if (name != "--help" && name != "--out" && name.rfind("--truth", 0) != 0) {
            option->capture_default_str();
        }
    }
    app.get_option("--truth-cell")->capture_default_str();
    app.add_flag("--there-and-back", street.there_and_back,
                 "Turn round in the middle of the drive and drive back");
}

void check_different(const std::vector<std::string> &paths)
{
    for (std::size_t i = 0; i < paths.size(); ++i) {
        if (!paths[i].empty() && std::count(paths.begin(), paths.end(), paths[i]) > 1) {
            throw std::runtime_error("two outputs name the same file, " + paths[i]);
        }
    }
}

void simulate(const Options &options)
{
    using namespace gpom_tools;
    const std::string absurd = street_config_error(options.street);
    if (!absurd.empty()) {
        throw std::runtime_error(absurd + "; see gpom-sim --help");
    }
    check_different({options.out_path, options.truth_path, options.truth_empty_path});
    const StreetWorld world = make_street_world(options.street);
    const std::string comment = street_comment(options.street);
    std::vector<FileContent> files;
    {
        Progress progress("scanning");
        const auto show = [&](std::size_t n, std::size_t n_all) { progress.update(n, n_all); };
        const std::vector<Scan> scans = simulate_scans(world, options.street, show);
        files.push_back({options.out_path, scans_csv(scans, comment)});
    }
    if (!options.truth_path.empty()) {
        const Truth truth = street_truth(world, options.street.truth_cell_m);
        files.push_back({options.truth_path, truth_pgm(truth, comment)});
    }
    if (!options.truth_empty_path.empty()) {
        const Truth truth = street_truth(without_vehicles(world), options.street.truth_cell_m);
        files.push_back({options.truth_empty_path, truth_pgm(truth, comment)});
    }
    replace_files(files);
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("Simulate streets with parked cars, a robot's laser scans along them, and the\n"
                 "ground truth. The defaults are those of the paper: 476 beams in 18,000 m2.",
                 "gpom-sim");
    Options options;
    declare_options(app, options);
    return gpom_tools::run_tool(app, argc, argv, [&options] { simulate(options); });
}
