#include "tools/live/cars.hpp"

#include "tools/eval/occupancy_grid.hpp"
#include "tools/eval/protocol.hpp"
#include "tools/live/report.hpp"

#include <algorithm>
#include <cmath>

namespace gpom_tools
{
namespace
{

using Json = nlohmann::ordered_json;

/// Enough operations for all cells that a scan marks.
constexpr std::uint64_t kWholeStepOps = std::uint64_t{1} << 40;

/// If a scan has this many returns from a cell, it sees that something stands there. One or two
/// returns may graze the cell.
constexpr std::ptrdiff_t kReturnsSeen = 3;

/// A cell of a vehicle, and what the scans after the change said about it.
struct CarCell {
    std::size_t i_cell;
    gpom_point_t centre;
    bool was_wrong;      ///< The cell was wrong right after the change, as expected. Other cells
                         ///< are not used.
    int n_witnesses = 0; ///< Number of scans that saw the change.
    int n_needed = 0;    ///< Number of these scans until the cell was no longer wrong. 0: it is
                         ///< still wrong.
};

/// After a vehicle left, occupied is wrong. After a vehicle arrived, free is wrong.
bool is_wrong(const gpom_cell_t &cell, bool arrived)
{
    return cell.cls == (arrived ? GPOM_FREE : GPOM_OCCUPIED);
}

bool is_in(const Rect &rect, gpom_point_t at)
{
    return at.x_m >= rect.x0_m && at.x_m < rect.x1_m && at.y_m >= rect.y0_m && at.y_m < rect.y1_m;
}

gpom_config_t cars_config(const CarsTrial &trial)
{
    const StreetConfig &street = trial.street;
    gpom_config_t config =
        live_config(trial.params, trial.live,
                    {std::round(0.5 * street.width_m), std::round(0.5 * street.height_m)});
    config.lowres_cell_m = trial.cell_m;
    config.lowres_nx = static_cast<std::uint16_t>(std::ceil(street.width_m / trial.cell_m));
    config.lowres_ny = static_cast<std::uint16_t>(std::ceil(street.height_m / trial.cell_m));
    return config;
}

std::vector<CarCell> car_cells(const StreetWorld &world, const gpom_config_t &config,
                               const std::vector<gpom_cell_t> &cells, bool arrived)
{
    std::vector<CarCell> found;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        const gpom_point_t centre = {
            (static_cast<double>(i % config.lowres_nx) + 0.5) * config.lowres_cell_m,
            (static_cast<double>(i / config.lowres_nx) + 0.5) * config.lowres_cell_m};
        const bool in_car = std::any_of(
            world.obstacles.begin() + static_cast<std::ptrdiff_t>(world.n_buildings),
            world.obstacles.end(), [&](const Rect &rect) { return is_in(rect, centre); });
        if (in_car) {
            found.push_back({i, centre, is_wrong(cells[i], arrived)});
        }
    }
    return found;
}

/// Where a beam passes a cell's centre: distance along the beam, and distance beside it.
struct Passing {
    double along_m, across_m;
};

Passing passing_of(const GridBeam &beam, gpom_point_t centre)
{
    const double dx_m = centre.x_m - beam.x_m, dy_m = centre.y_m - beam.y_m;
    const double c = std::cos(beam.bearing_rad), s = std::sin(beam.bearing_rad);
    return {c * dx_m + s * dy_m, c * dy_m - s * dx_m};
}

/// True if the beams that go on beyond a cell cover it: no two neighbours are farther apart than
/// gap_m.
bool sees_through(const std::vector<GridBeam> &beams, gpom_point_t centre, double cell_m,
                  double gap_m)
{
    std::vector<double> across_m;
    for (const GridBeam &beam : beams) {
        const Passing p = passing_of(beam, centre);
        if (std::fabs(p.across_m) < cell_m && p.along_m > 0.0 &&
            beam.range_m > p.along_m + cell_m) {
            across_m.push_back(p.across_m);
        }
    }
    std::sort(across_m.begin(), across_m.end());
    double seen_to_m = -0.5 * cell_m;
    for (const double at_m : across_m) {
        if (at_m > seen_to_m && at_m - seen_to_m > gap_m) {
            break;
        }
        seen_to_m = std::max(seen_to_m, at_m);
    }
    return seen_to_m + gap_m > 0.5 * cell_m;
}

bool returns_from(const std::vector<GridBeam> &beams, gpom_point_t centre, double cell_m)
{
    const auto n_returns = std::count_if(beams.begin(), beams.end(), [&](const GridBeam &beam) {
        const Passing p = passing_of(beam, centre);
        return beam.hit && std::hypot(beam.range_m - p.along_m, p.across_m) < 0.5 * cell_m;
    });
    return n_returns >= kReturnsSeen;
}

void count_witnesses(std::vector<CarCell> &cells, const Scan &scan, const CarsTrial &trial,
                     bool arrived)
{
    const std::vector<GridBeam> beams = beams_of({scan}, kHalfSpacing);
    for (CarCell &cell : cells) {
        const bool seen = arrived
                              ? returns_from(beams, cell.centre, trial.cell_m)
                              : sees_through(beams, cell.centre, trial.cell_m, trial.seen_gap_m);
        cell.n_witnesses += seen ? 1 : 0;
    }
}

/// Number of cells by the number of scans they needed: [n] for n scans, [0] for never. Also the
/// number of cells that five or more scans saw and that have not changed yet.
Json summary_json(const std::vector<CarCell> &cells)
{
    constexpr int kEnough = 5;
    std::vector<int> needed;
    int n_cells = 0, n_late = 0;
    Json late = Json::array();
    for (const CarCell &cell : cells) {
        if (cell.n_witnesses == 0 || !cell.was_wrong) {
            continue;
        }
        ++n_cells;
        const auto n = static_cast<std::size_t>(std::max(cell.n_needed, 0));
        needed.resize(std::max(needed.size(), n + 1), 0);
        ++needed[n];
        const bool is_late =
            cell.n_witnesses >= kEnough && (cell.n_needed == 0 || cell.n_needed > kEnough);
        n_late += is_late ? 1 : 0;
        if (is_late) {
            late.push_back({cell.centre.x_m, cell.centre.y_m, cell.n_witnesses, cell.n_needed});
        }
    }
    return {{"cells", n_cells}, {"by_witnesses", needed}, {"late", n_late}, {"late_cells", late}};
}

Json raster_json(const std::vector<gpom_cell_t> &cells)
{
    Json probabilities = Json::array();
    for (const gpom_cell_t &cell : cells) {
        probabilities.push_back(cell.cls == GPOM_UNKNOWN ? -1.0 : cell.probability / 65535.0);
    }
    return probabilities;
}

} // namespace

CarsTrial default_cars()
{
    CarsTrial trial;
    trial.street.seed = 1;
    trial.street.n_scans = 200;
    trial.street.n_beams = 720;
    trial.street.step_m = 0.8;
    trial.street.cars_leave_at = 100;
    trial.street.there_and_back = true;
    gpom_params_init(&trial.params);
    return trial;
}

Json cars_report(const CarsTrial &trial)
{
    const StreetWorld world = make_street_world(trial.street);
    const bool arrived = trial.street.cars_arrive_at > 0;
    const int change_at = arrived ? trial.street.cars_arrive_at : trial.street.cars_leave_at;
    const gpom_config_t config = cars_config(trial);
    HostMap map(config, trial.live.late_m);
    std::vector<CarCell> cells;
    std::vector<gpom_cell_t> before;
    std::vector<Scan> scans = simulate_scans(world, trial.street, nullptr);
    add_spurious(scans, trial.spurious, trial.street.seed);
    int i_scan = 0;
    for (const Scan &scan : scans) {
        if (i_scan == change_at) {
            before = map.cells();
            cells = car_cells(world, config, before, arrived);
        }
        map.insert(scan);
        map.step(kWholeStepOps);
        count_witnesses(cells, scan, trial, arrived);
        const std::vector<gpom_cell_t> now = map.cells();
        for (CarCell &cell : cells) {
            if (is_wrong(now[cell.i_cell], arrived)) {
                cell.n_needed = 0;
            } else if (cell.n_needed == 0) {
                cell.n_needed = std::max(cell.n_witnesses, 1);
            }
        }
        ++i_scan;
    }
    return {{"cells", summary_json(cells)},
            {"counts", counts_json(map.stats())},
            {"kept", gpom_map_beam_count(map.get())},
            {"nx", config.lowres_nx},
            {"ny", config.lowres_ny},
            {"cell_m", trial.cell_m},
            {"before", raster_json(before)},
            {"after", raster_json(map.cells())}};
}

} // namespace gpom_tools
