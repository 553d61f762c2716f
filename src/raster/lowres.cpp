#include "src/raster/lowres.hpp"

#include "gpom/params.h"
#include "src/gp/classify.hpp"

#include <string.h>

namespace gpom
{
namespace
{

constexpr double kVarianceSteps = 255.0;
constexpr double kProbabilitySteps = 65535.0;

/// Rounded to the nearest step. Computed in double, because the products are exact there.
uint32_t quantised_probability(float probability)
{
    const double steps = static_cast<double>(probability) * kProbabilitySteps;
    const uint32_t whole = static_cast<uint32_t>(steps);
    return steps - static_cast<double>(whole) < 0.5 ? whole : whole + 1;
}

/// Rounded up to the next step, so that no cell looks surer than it is.
uint32_t quantised_variance(float variance, float prior_variance)
{
    const double steps =
        static_cast<double>(variance) * kVarianceSteps / static_cast<double>(prior_variance);
    if (!(steps < kVarianceSteps)) {
        return static_cast<uint32_t>(kVarianceSteps);
    }
    const uint32_t whole = static_cast<uint32_t>(steps);
    return static_cast<double>(whole) < steps ? whole + 1 : whole;
}

uint32_t packed(uint32_t probability, uint32_t variance, uint32_t cls)
{
    return probability | variance << 16 | cls << 24;
}

void publish(const Lowres &lowres, Layer &layer)
{
    const Published published = {layer.window, lowres.stamp0_us, lowres.frame_epoch, 0};
    uint32_t words[kPublishedWords];
    memcpy(words, &published, sizeof words);
    for (size_t i = 0; i < kPublishedWords; ++i) {
        store(layer.published[i], words[i]);
    }
}

void reset_all(const Lowres &lowres, Layer &layer)
{
    for (uint32_t slot = 0; slot < cell_count(layer.window); ++slot) {
        reset_cell(lowres, layer, slot, (load(layer.cells[slot].value) & kOutside) != 0);
    }
}

/// Move the window to (ix0, iy0). Cells that are new in the window are reset. The other cells keep
/// their slots and values.
void move_window(const Lowres &lowres, Layer &layer, int32_t ix0, int32_t iy0)
{
    const Window old = layer.window;
    layer.window.ix0 = ix0;
    layer.window.iy0 = iy0;
    const int32_t ix_end = ix0 + static_cast<int32_t>(old.nx);
    for (uint32_t ky = 0; ky < old.ny; ++ky) {
        const int32_t iy = iy0 + static_cast<int32_t>(ky);
        for (int32_t ix = ix0; ix < ix_end; ++ix) {
            if (contains(old, ix, iy)) { // go on at the first column beyond the old window
                ix = old.ix0 + static_cast<int32_t>(old.nx) - 1;
                continue;
            }
            reset_cell(lowres, layer, slot_of(layer.window, ix, iy), false);
        }
    }
    start_round(layer);
}

/// Make all cells unknown and dirty. Call it between begin_change() and end_change().
void reset_layers(Lowres &lowres)
{
    for (Layer &layer : lowres.layers) {
        reset_all(lowres, layer);
        start_round(layer);
    }
    lowres.near = {0, 0};
    lowres_count_change(lowres);
}

/// First cell of a window of n cells after it followed the robot along one axis. The window moves
/// only if the robot's cell is more than n / 8 cells from the middle, and then no farther than
/// needed.
int32_t followed(int32_t first, uint32_t n, int32_t robot)
{
    const int32_t slack = static_cast<int32_t>(n / 8);
    const int32_t centred = robot - static_cast<int32_t>(n / 2);
    if (first < centred - slack) {
        return centred - slack;
    }
    return first > centred + slack ? centred + slack : first;
}

void init_layers(Lowres &lowres, const gpom_config_t &config, Cell *cells)
{
    memset(cells, 0, static_cast<size_t>(lowres_cell_count(config)) * sizeof(Cell));
    Layer &coarse = lowres.layers[GPOM_LAYER_COARSE];
    Layer &focus = lowres.layers[GPOM_LAYER_FOCUS];
    coarse.cells = cells;
    coarse.cell_max = uint32_t{config.lowres_nx} * config.lowres_ny;
    focus.cells = cells + coarse.cell_max;
    focus.cell_max = config.focus_cell_max;
    focus.window.cell_m = 1.0; // there are no cells yet, but cell_number() divides by the side
    coarse.window.cell_m = coarse.cell_max > 0 ? config.lowres_cell_m : 1.0;
    coarse.window.nx = config.lowres_nx;
    coarse.window.ny = config.lowres_ny;
    if (lowres.is_rolling == 0) {
        coarse.window.x0_m = config.lowres_x0_m;
        coarse.window.y0_m = config.lowres_y0_m;
        return;
    }
    const double cell_m = coarse.window.cell_m;
    coarse.window.ix0 = cell_number(config.origin_x_m, 0.0, cell_m) - config.lowres_nx / 2;
    coarse.window.iy0 = cell_number(config.origin_y_m, 0.0, cell_m) - config.lowres_ny / 2;
}

void count_stamp(Lowres &lowres, int64_t stamp_us)
{
    lowres_start_clock(lowres, stamp_us);
    const uint32_t ms = milliseconds_since(lowres.stamp0_us, stamp_us);
    const uint32_t newest_ms = load(lowres.newest_ms);
    if (ms > newest_ms || newest_ms - ms > kSetBack_ms) {
        store(lowres.newest_ms, ms);
    }
}

} // namespace

void lowres_start_clock(Lowres &lowres, int64_t stamp_us)
{
    if (lowres.has_stamp0 == 0) {
        begin_change(lowres);
        lowres.has_stamp0 = 1;
        lowres.stamp0_us = stamp_us;
        end_change(lowres);
    }
}

uint32_t milliseconds_since(int64_t stamp0_us, int64_t stamp_us)
{
    if (stamp_us <= stamp0_us) {
        return 0;
    }
    const uint64_t ms = (static_cast<uint64_t>(stamp_us) - static_cast<uint64_t>(stamp0_us)) / 1000;
    return ms < UINT32_MAX ? static_cast<uint32_t>(ms) : UINT32_MAX;
}

int32_t cell_number(double x_m, double x0_m, double cell_m)
{
    const double cells = (x_m - x0_m) / cell_m;
    if (!(cells < kCellNumberMax)) {
        return static_cast<int32_t>(kCellNumberMax);
    }
    if (cells < -kCellNumberMax) {
        return -static_cast<int32_t>(kCellNumberMax);
    }
    const int32_t towards_zero = static_cast<int32_t>(cells);
    return static_cast<double>(towards_zero) > cells ? towards_zero - 1 : towards_zero;
}

void begin_change(Lowres &lowres) { store(lowres.counter, load(lowres.counter) + 1); }

void end_change(Lowres &lowres)
{
    for (Layer &layer : lowres.layers) {
        publish(lowres, layer);
    }
    store(lowres.counter, load(lowres.counter) + 1);
}

void start_round(Layer &layer) { layer.n_stale = place_count(layer.window); }

void reset_cell(const Lowres &lowres, Layer &layer, uint32_t slot, bool is_outside)
{
    Cell &cell = layer.cells[slot];
    const bool was_dirty = (load(cell.value) & kDirty) != 0;
    store(cell.value, lowres.unknown_value | (is_outside ? kOutside : kDirty));
    store(cell.stamp_ms, 0);
    const uint32_t n_others = load(layer.n_dirty) - (was_dirty ? 1u : 0u);
    store(layer.n_dirty, n_others + (is_outside ? 0u : 1u));
}

uint32_t lowres_value(const Lowres &lowres, const gpom_answer_t &answer)
{
    const bool is_known = answer.flags == 0 && answer.variance <= lowres.unknown_variance;
    const bool keeps_class = is_known || answer.cls == GPOM_OCCUPIED; // never hide an obstacle
    return packed(quantised_probability(answer.probability),
                  quantised_variance(answer.variance, lowres.prior_variance),
                  keeps_class ? answer.cls : static_cast<uint32_t>(GPOM_UNKNOWN));
}

void lowres_init(Lowres &lowres, const gpom_config_t &config, Cell *cells)
{
    lowres = Lowres{};
    lowres.origin_x_m = config.origin_x_m;
    lowres.origin_y_m = config.origin_y_m;
    const float cell_m = static_cast<float>(config.lowres_cell_m);
    lowres.reach_m = config.lowres_reach_m > 0.0f ? config.lowres_reach_m : 2.0f * cell_m;
    const float prior_variance = gpom_params_prior_variance(&config.params);
    lowres.unknown_variance = config.lowres_unknown * prior_variance;
    lowres.prior_variance = prior_variance;
    const float prior = gpom_params_prior_probability(&config.params);
    lowres.unknown_value = packed(quantised_probability(prior), 255, GPOM_UNKNOWN);
    lowres.is_rolling = config.lowres_rolling != 0 ? 1 : 0;
    init_layers(lowres, config, cells);
    const Window &coarse = lowres.layers[GPOM_LAYER_COARSE].window;
    lowres.robot_ix = cell_number(config.origin_x_m, coarse.x0_m, coarse.cell_m);
    lowres.robot_iy = cell_number(config.origin_y_m, coarse.y0_m, coarse.cell_m);
    lowres_clear(lowres);
}

void lowres_clear(Lowres &lowres)
{
    begin_change(lowres);
    reset_layers(lowres);
    end_change(lowres);
}

void lowres_restore(Lowres &lowres, const Anchor &anchor, bool has_scans)
{
    begin_change(lowres);
    lowres.origin_x_m = anchor.origin_x_m;
    lowres.origin_y_m = anchor.origin_y_m;
    lowres.stamp0_us = anchor.stamp0_us;
    lowres.has_stamp0 = has_scans ? 1 : 0;
    if (anchor.frame_epoch > lowres.frame_epoch) {
        lowres.frame_epoch = anchor.frame_epoch;
    }
    store(lowres.newest_ms, 0);
    reset_layers(lowres);
    end_change(lowres);
}

void lowres_follow(Lowres &lowres, Point robot, int64_t stamp_us)
{
    count_stamp(lowres, stamp_us);
    lowres_count_change(lowres);
    Layer &layer = lowres.layers[GPOM_LAYER_COARSE];
    const Window &w = layer.window;
    const double x_m = lowres.origin_x_m + static_cast<double>(robot.x_m);
    const double y_m = lowres.origin_y_m + static_cast<double>(robot.y_m);
    lowres.robot_ix = cell_number(x_m, w.x0_m, w.cell_m);
    lowres.robot_iy = cell_number(y_m, w.y0_m, w.cell_m);
    lowres.near = {0, 0};
    if (lowres.is_rolling == 0 || w.nx == 0) {
        return;
    }
    const int32_t ix0 = followed(w.ix0, w.nx, lowres.robot_ix);
    const int32_t iy0 = followed(w.iy0, w.ny, lowres.robot_iy);
    if (ix0 != w.ix0 || iy0 != w.iy0) {
        begin_change(lowres);
        move_window(lowres, layer, ix0, iy0);
        end_change(lowres);
    }
}

uint32_t StampShift::operator()(uint32_t stamp_ms) const
{
    const uint32_t rest_ms = stamp_ms > less_ms ? stamp_ms - less_ms : 0;
    return rest_ms < UINT32_MAX - more_ms ? rest_ms + more_ms : UINT32_MAX;
}

void lowres_move_stamp0(Lowres &lowres, int64_t stamp0_us, const StampShift &shift)
{
    begin_change(lowres);
    lowres.stamp0_us = stamp0_us;
    store(lowres.newest_ms, shift(load(lowres.newest_ms)));
    const Layer &coarse = lowres.layers[GPOM_LAYER_COARSE]; // focus cells follow coarse cells
    const uint32_t n_cells = coarse.cell_max + lowres.layers[GPOM_LAYER_FOCUS].cell_max;
    for (uint32_t slot = 0; slot < n_cells; ++slot) {
        uint32_t &stamp_ms = coarse.cells[slot].stamp_ms;
        store(stamp_ms, load(stamp_ms) == 0 ? 0 : shift(stamp_ms));
    }
    end_change(lowres);
}

void lowres_rebase(Lowres &lowres, double dx_m, double dy_m)
{
    lowres.origin_x_m += dx_m;
    lowres.origin_y_m += dy_m;
    for (Layer &layer : lowres.layers) {
        start_round(layer);
    }
}

void lowres_start_epoch(Lowres &lowres, bool clears)
{
    begin_change(lowres);
    ++lowres.frame_epoch;
    if (clears) {
        reset_layers(lowres);
    }
    lowres_count_change(lowres);
    end_change(lowres);
}

} // namespace gpom
