// gpom-live: measures what a live map knows and what it costs.
#include "ports/host/command_line.hpp"
#include "ports/host/file_error.hpp"
#include "ports/host/params_toml.hpp"
#include "ports/host/scan_options.hpp"
#include "tools/eval/protocol.hpp"
#include "tools/live/cars.hpp"
#include "tools/live/door.hpp"
#include "tools/live/drive.hpp"
#include "tools/live/judge.hpp"
#include "tools/live/merge.hpp"
#include "tools/live/repose.hpp"
#include "tools/live/seams.hpp"
#include "tools/map/map_options.hpp"

#include <cstdio>
#include <stdexcept>
#include <string>

using namespace gpom_tools;

namespace
{

struct Options {
    std::string params_path;
    std::string json_path;
    JudgeOptions judge;
    ReposeOptions repose;
    std::size_t n_lines = 500;
    CarsTrial cars = default_cars();
    DoorTrial door;
    InsertBench bench{default_drive()};
};

/// Add a subcommand with the options that all of them have.
CLI::App *add_command(CLI::App &app, const std::string &name, const std::string &what,
                      Options &options)
{
    CLI::App *const command = app.add_subcommand(name, what);
    command->add_option("--params", options.params_path, "Hyperparameters, TOML")
        ->required()
        ->type_name("FILE");
    command->add_option("--json", options.json_path, "File for the figures; default: stdout")
        ->type_name("FILE");
    return command;
}

void add_spurious_option(CLI::App &command, double &share)
{
    command.add_option("--spurious", share, "Share of returns that are made too short")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
}

/// Add the options that decide which scans make a map and which scans judge it.
void add_judge_options(CLI::App &command, JudgeOptions &judge)
{
    command
        .add_option("--scans", judge.scans_path, "Scans: CSV or CARMEN log, plain, gzip or bzip2")
        ->required()
        ->type_name("FILE");
    command.add_option("--truth", judge.truth_path, "Ground truth of a street, PGM image")
        ->type_name("FILE");
    command.add_option("--range-max", judge.reading.range_max_m,
                       "Usable range of a log's sensor [m]");
    add_scan_options(command, judge.reading);
    command.add_option("--fraction", judge.fraction, "Share of a log's returns that make the map")
        ->check(CLI::Range(0.01, kTrainingShareMax));
    command.add_option("--seed", judge.seed, "Seed of split, points and draws");
    add_live_options(command, judge.live);
    add_capacity_option(command, judge.live);
}

CLI::App *add_judge(CLI::App &app, Options &options)
{
    CLI::App *const command = add_command(
        app, "judge", "Accuracy, compared with the same number of beams drawn at random", options);
    add_judge_options(*command, options.judge);
    add_spurious_option(*command, options.judge.spurious);
    command->add_option("--points", options.judge.n_points, "Test points of a street")
        ->check(CLI::Range(100, 1000000));
    return command;
}

CLI::App *add_seams(CLI::App &app, Options &options)
{
    CLI::App *const command =
        add_command(app, "seams", "Jumps of the answers along random lines of 1 m", options);
    add_judge_options(*command, options.judge);
    command->add_option("--lines", options.n_lines, "Number of lines")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    return command;
}

CLI::App *add_repose(CLI::App &app, Options &options)
{
    CLI::App *const command =
        add_command(app, "repose", "Accuracy of a map whose poses are corrected later", options);
    add_judge_options(*command, options.repose.judge);
    command
        ->add_option("--drifted", options.repose.drifted_path,
                     "The scans of --scans with drifted poses")
        ->required()
        ->type_name("FILE");
    command->add_option("--share", options.repose.share, "Share of the drift")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    return command;
}

CLI::App *add_merge(CLI::App &app, Options &options)
{
    CLI::App *const command =
        add_command(app, "merge", "Accuracy of the map of two robots that share a log", options);
    add_judge_options(*command, options.judge);
    return command;
}

CLI::App *add_cars(CLI::App &app, Options &options)
{
    StreetConfig &street = options.cars.street;
    CLI::App *const command =
        add_command(app, "cars", "Scans until vehicles that left or came are noticed", options);
    command->add_option("--seed", street.seed, "Seed of the street");
    command->add_option("--scans", street.n_scans, "Number of scans");
    command->add_option("--beams", street.n_beams, "Beams in each scan");
    command->add_option("--step", street.step_m, "Way driven from scan to scan [m]");
    command->add_option("--cars-leave-at", street.cars_leave_at, "Scan at which vehicles leave");
    command->add_option("--cars-arrive-at", street.cars_arrive_at, "Scan at which vehicles arrive");
    command
        ->add_option("--seen-gap", options.cars.seen_gap_m,
                     "Largest spacing of beams that see through a cell [m]")
        ->check(CLI::Range(1e-3, 10.0))
        ->capture_default_str();
    add_spurious_option(*command, options.cars.spurious);
    command->add_option("--cell", options.cars.cell_m, "Size of low-resolution cells [m]")
        ->check(CLI::Range(0.1, 10.0));
    add_live_options(*command, options.cars.live);
    add_capacity_option(*command, options.cars.live);
    return command;
}

CLI::App *add_door(CLI::App &app, Options &options)
{
    DoorTrial &door = options.door;
    CLI::App *const command = add_command(
        app, "door", "Width of a corridor's doors, and robots that fit through", options);
    command->add_option("--seed", door.laser.seed, "Seed of the first run")->capture_default_str();
    command->add_option("--runs", door.n_runs, "Runs, each with the next seed")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    command->add_option("--beams", door.laser.n_beams, "Beams in each scan, over 180 degrees")
        ->check(CLI::Range(2, kScanBeamsMax))
        ->capture_default_str();
    command->add_option("--noise", door.laser.noise_m, "Standard deviation of the range error [m]")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    add_live_options(*command, door.live);
    add_capacity_option(*command, door.live);
    return command;
}

void add_drive_options(CLI::App &command, DriveConfig &drive)
{
    command.add_option("--scans", drive.town.n_scans, "Length of the drive, ten scans a second");
    command.add_option("--seed", drive.town.seed, "Seed of the town and the drive");
    command
        .add_option("--cells", drive.n_cells_side,
                    "Side of a low-resolution map that follows the robot [cells of 0.5 m]")
        ->check(CLI::Range(0, 1000));
    add_live_options(command, drive.live);
    add_capacity_option(command, drive.live);
}

CLI::App *add_drive(CLI::App &app, Options &options)
{
    CLI::App *const command =
        add_command(app, "drive", "Memory, work and query cost of a long drive", options);
    add_drive_options(*command, options.bench.drive);
    return command;
}

CLI::App *add_insert(CLI::App &app, Options &options)
{
    CLI::App *const command = add_command(app, "insert", "Time of inserting a scan", options);
    add_drive_options(*command, options.bench.drive);
    command->add_option("--kept", options.bench.n_kept, "Beams kept when measuring begins");
    command->add_option("--measured", options.bench.n_scans, "Scans measured")
        ->check(CLI::Range(1, 1000000));
    command->add_option("--runs", options.bench.n_runs, "Repetitions of the whole drive")
        ->check(CLI::Range(1, 1000));
    return command;
}

void check_street(const StreetConfig &street)
{
    const std::string absurd = street_config_error(street);
    if (!absurd.empty()) {
        throw std::runtime_error(absurd);
    }
}

nlohmann::ordered_json cars_figures(Options &options)
{
    check_street(options.cars.street);
    options.cars.params = read_params(options.params_path);
    return cars_report(options.cars);
}

nlohmann::ordered_json door_figures(Options &options)
{
    options.door.params = read_params(options.params_path);
    return door_report(options.door);
}

void prepare_drive(Options &options)
{
    check_length(options.bench.drive);
    options.bench.drive.params = read_params(options.params_path);
}

nlohmann::ordered_json drive_figures(Options &options)
{
    prepare_drive(options);
    return drive_report(options.bench.drive);
}

nlohmann::ordered_json insert_figures(Options &options)
{
    prepare_drive(options);
    return insert_report(options.bench);
}

nlohmann::ordered_json judge_figures(Options &options)
{
    options.judge.params_path = options.params_path;
    return judge_report(options.judge);
}

nlohmann::ordered_json repose_figures(Options &options)
{
    options.repose.judge.params_path = options.params_path;
    return repose_report(options.repose);
}

nlohmann::ordered_json merge_figures(Options &options)
{
    options.judge.params_path = options.params_path;
    return merge_report(options.judge);
}

/// Random places of a street tried for each line. Places away from the beams are left out.
constexpr std::size_t kPlacesPerLine = 8;

nlohmann::ordered_json seams_figures(Options &options)
{
    options.judge.params_path = options.params_path;
    options.judge.n_points = kPlacesPerLine * options.n_lines;
    return seams_report(options.judge, options.n_lines);
}

void report(const Options &options, const nlohmann::ordered_json &figures)
{
    const std::string text = figures.dump(1) + "\n";
    if (options.json_path.empty()) {
        std::fputs(text.c_str(), stdout);
    } else {
        replace_files({{options.json_path, text}});
    }
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app(
        "Keep a map as a vehicle does, and measure accuracy and cost. Writes figures as JSON.",
        "gpom-live");
    Options options;
    app.require_subcommand(1);
    struct Command {
        const CLI::App *app;
        nlohmann::ordered_json (*figures)(Options &options);
    };
    const Command commands[] = {
        {add_judge(app, options), judge_figures},   {add_seams(app, options), seams_figures},
        {add_repose(app, options), repose_figures}, {add_merge(app, options), merge_figures},
        {add_cars(app, options), cars_figures},     {add_door(app, options), door_figures},
        {add_insert(app, options), insert_figures}, {add_drive(app, options), drive_figures}};
    return run_tool(app, argc, argv, [&] {
        for (const Command &command : commands) {
            if (command.app->parsed()) {
                report(options, command.figures(options));
            }
        }
    });
}
