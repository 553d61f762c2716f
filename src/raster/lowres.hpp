/// \file lowres.hpp
/// The low-resolution map (lowres.h): two rasters of cells, their dirty marks, and the state of
/// their evaluation.
///
/// Only the thread that changes the map calls functions that change the rasters. gpom_lowres_info()
/// and gpom_lowres_copy() may run in another thread at the same time. They read words that are
/// atomic one by one: the cells, and a copy of each layer's window. The counter is odd while a
/// window changes. Every store of the writer is a release, and every load of a reader is an
/// acquire. So a reader that sees a store made after the counter became odd also sees the odd
/// counter, and no fence is needed.
#pragma once

#include "gpom/lowres.h"
#include "src/beams/beam.hpp"

#include <stddef.h>

namespace gpom
{

constexpr uint32_t kLayers = 2;

/// value: probability in bits 0 .. 15, variance in bits 16 .. 23, class in bits 24 .. 25, kDirty in
/// bit 26, kOutside in bit 27.
struct Cell {
    uint32_t value;
    uint32_t stamp_ms;
};
static_assert(sizeof(Cell) == 8, "GPOM_MAP_BYTES counts on it");

constexpr uint32_t kDirty = UINT32_C(1) << 26;
/// The cell is not in the band of the focus layer. It is never marked and never evaluated.
constexpr uint32_t kOutside = UINT32_C(1) << 27;

/// A rectangle of numbered cells, ix0 <= ix < ix0 + nx and iy0 <= iy < iy0 + ny. Cell (ix, iy) has
/// its centre at (x0_m + (ix + 0.5) cell_m, y0_m + (iy + 0.5) cell_m). Memory holds it at column ix
/// modulo nx and row iy modulo ny, so that no cell is copied when the window moves.
struct Window {
    double x0_m, y0_m; ///< Map frame.
    double cell_m;
    int32_t ix0, iy0;
    uint32_t nx, ny; ///< 0: there are no cells.
};

/// Data that a reader must get from the same moment.
struct Published {
    Window window;
    int64_t stamp0_us;
    uint32_t frame_epoch;
    uint32_t reserved;
};
constexpr size_t kPublishedWords = sizeof(Published) / sizeof(uint32_t);

struct Layer {
    Cell *cells;
    uint32_t cell_max;
    uint32_t n_dirty; ///< Atomic.
    uint32_t cursor;  ///< Next place of the round over dirty cells.
    uint32_t refresh; ///< Next place of the round over all cells.
    uint32_t n_stale; ///< Places that are left of the round over all cells.
    Window window;
    uint32_t published[kPublishedWords]; ///< Atomic: the words of a Published.
};

/// A place on the spiral around the robot's cell.
struct Spiral {
    uint32_t ring; ///< Chebyshev distance [cells].
    uint32_t i;    ///< 0 .. 8 ring - 1; 0 in ring 0.
};

struct Lowres {
    Layer layers[kLayers];
    double origin_x_m, origin_y_m; ///< The map's origin in the map frame. Beams are relative to it.
    int64_t stamp0_us;
    float reach_m;
    float unknown_variance; ///< A cell with a greater variance has class unknown.
    float prior_variance;
    uint32_t unknown_value; ///< Cell::value of a cell that was never evaluated, without flags.
    uint32_t counter;       ///< Atomic: odd while a window changes.
    uint32_t map_sequence;  ///< Atomic.
    uint32_t newest_ms;     ///< Atomic.
    uint32_t frame_epoch;
    int32_t robot_ix, robot_iy; ///< The robot's cell in the coarse layer. May be out of its window.
    Spiral near;
    uint8_t batch_number; ///< Batches of cells evaluated so far, modulo 8.
    uint8_t is_rolling;
    uint8_t has_stamp0;
};

/// Greatest cell number. float64 tells neighbouring cells apart far beyond this number.
constexpr double kCellNumberMax = 1e9;

/// Fewest cells of a focus layer. A path around the zero of the map frame touches four cells,
/// however large the cells are.
constexpr uint32_t kFocusCellsMin = 4;

/// Number of cells of both layers.
constexpr uint64_t lowres_cell_count(const gpom_config_t &config)
{
    return uint64_t{config.lowres_nx} * config.lowres_ny + config.focus_cell_max;
}

/// Build both layers in `cells`, which has lowres_cell_count() elements. All cells are unknown and
/// dirty, and there is no focus.
void lowres_init(Lowres &lowres, const gpom_config_t &config, Cell *cells);

/// Make all cells unknown and dirty. The focus stays.
void lowres_clear(Lowres &lowres);

/// Place and time that the coordinates and stamps of beams are relative to.
struct Anchor {
    double origin_x_m, origin_y_m;
    int64_t stamp0_us;
    uint32_t frame_epoch;
};

/// The map got other beams: make every cell unknown and dirty. The frame epoch becomes the greater
/// of the present one and the anchor's.
/// has_scans  false: the next scan sets stamp0_us.
void lowres_restore(Lowres &lowres, const Anchor &anchor, bool has_scans);

/// Whole milliseconds from stamp0_us to stamp_us, limited to 0 .. 2^32 - 1 (49 days).
uint32_t milliseconds_since(int64_t stamp0_us, int64_t stamp_us);

/// If a scan is older than the newest scan by more than this, it is not late. The clock was ahead
/// before and has been set back.
constexpr uint32_t kSetBack_ms = 60000;

/// Converts a stamp when stamp0_us moves. Adds more_ms and subtracts less_ms. One of the two is 0.
/// The result is limited to 32 bits.
struct StampShift {
    uint32_t more_ms, less_ms;

    uint32_t operator()(uint32_t stamp_ms) const;
};

/// Set stamp0_us and shift the stamps of all cells. Cells that were never evaluated keep stamp 0.
void lowres_move_stamp0(Lowres &lowres, int64_t stamp0_us, const StampShift &shift);

/// Stamps count from this time on, if none was set before.
void lowres_start_clock(Lowres &lowres, int64_t stamp_us);

/// A scan was taken with the robot at a place, given relative to the map's origin. Moves the window
/// if it is a rolling one, starts the spiral again, and updates newest_ms and map_sequence.
void lowres_follow(Lowres &lowres, Point robot, int64_t stamp_us);

/// Count a change of the map that no scan made.
inline void lowres_count_change(Lowres &lowres)
{
    __atomic_store_n(&lowres.map_sequence, lowres.map_sequence + 1, __ATOMIC_RELEASE);
}

/// Mark the cells whose centre is within reach_m of a beam that was inserted or dropped. The beam
/// runs from its sensor to its hit, relative to the map's origin. Near its ends, some cells within
/// sqrt(2) reach_m are marked, too. The reach is a little greater to allow for rounding: by at most
/// 4e-6 of the distance that beam and raster span together.
/// Cost: O(rows that the beam crosses + cells in reach).
void lowres_mark_segment(Lowres &lowres, Point from, Point to, float reach_m);

/// Mark the cells whose centre lies in a box, widened by reach_m.
void lowres_mark_box(Lowres &lowres, Point low, Point high, float reach_m);

void lowres_mark_all(Lowres &lowres);

/// The map's origin moved by (dx_m, dy_m). The map frame does not move, and neither do the cells.
/// But the coordinates of beams were rounded again, so all cells will be evaluated once more.
void lowres_rebase(Lowres &lowres, double dx_m, double dy_m);

/// The map frame jumped: start the next frame epoch, which readers see. If `clears`, all cells
/// become unknown and dirty at the same moment. Else they stay as they are.
void lowres_start_epoch(Lowres &lowres, bool clears);

/// Cell::value of an answer, quantised as gpom_cell_t in lowres.h says, without flags.
uint32_t lowres_value(const Lowres &lowres, const gpom_answer_t &answer);

inline uint32_t class_of_value(uint32_t value) { return value >> 24 & 3; }

// ---- shared by the files of this module --------------------------------------------------------

inline uint32_t load(const uint32_t &word) { return __atomic_load_n(&word, __ATOMIC_ACQUIRE); }
inline void store(uint32_t &word, uint32_t value)
{
    __atomic_store_n(&word, value, __ATOMIC_RELEASE);
}

/// i modulo n. The result is 0 .. n - 1, for negative i, too.
inline uint32_t wrap_index(int32_t i, uint32_t n)
{
    const int32_t rest = i % static_cast<int32_t>(n);
    return static_cast<uint32_t>(rest < 0 ? rest + static_cast<int32_t>(n) : rest);
}

inline bool contains(const Window &w, int32_t ix, int32_t iy)
{
    const int64_t kx = int64_t{ix} - w.ix0;
    const int64_t ky = int64_t{iy} - w.iy0;
    return kx >= 0 && kx < w.nx && ky >= 0 && ky < w.ny;
}

/// The slot of a cell of the window.
inline uint32_t slot_of(const Window &w, int32_t ix, int32_t iy)
{
    return wrap_index(iy, w.ny) * w.nx + wrap_index(ix, w.nx);
}

inline uint32_t cell_count(const Window &w) { return w.nx * w.ny; }

/// Number of the cell that contains a coordinate, limited to -kCellNumberMax .. kCellNumberMax.
int32_t cell_number(double x_m, double x0_m, double cell_m);

/// A round visits the cells in tiles of 4 x 4 slots, so that the cells of a group lie close
/// together and share their search. Some places of the last tiles may lie beyond the raster.
constexpr uint32_t kTileSide = 4;
inline uint32_t tiles_along(uint32_t n) { return (n + kTileSide - 1) / kTileSide; }
inline uint32_t place_count(const Window &w)
{
    return tiles_along(w.nx) * tiles_along(w.ny) * kTileSide * kTileSide;
}

inline bool has_dirty_cells(const Lowres &lowres)
{
    return load(lowres.layers[GPOM_LAYER_COARSE].n_dirty) > 0 ||
           load(lowres.layers[GPOM_LAYER_FOCUS].n_dirty) > 0;
}

/// Begin and end a change of windows. A reader whose read overlaps the change reads again.
void begin_change(Lowres &lowres);
void end_change(Lowres &lowres);

/// Columns or rows of a window, counted from its corner: [first, end).
struct Span {
    uint32_t first, end;
};

/// The cells near a stretch. Coordinates (u, v) are in cells from the window's corner. The strip
/// runs along the stretch and is cut to the box around all points within the radius. It holds all
/// cells within the radius, and near the ends of the stretch some within sqrt(2) radii. Its columns
/// in row v are |u - (offset + slope v)| <= half_width.
struct Strip {
    float u_min, u_max, v_min, v_max;
    float offset, slope, half_width;
};

Strip strip_of(const Lowres &lowres, const Window &w, Point from, Point to, float radius_m);

/// Numbers k, of 0 .. n - 1, of the cells whose centres k + 0.5 lie in [low, high].
inline Span centres_between(float low, float high, uint32_t n)
{
    const float n_cells = static_cast<float>(n);
    uint32_t first = 0;
    if (low > 0.5f) {
        first = low < n_cells ? static_cast<uint32_t>(low - 0.5f) : n;
        first += first < n && static_cast<float>(first) + 0.5f < low ? 1u : 0u;
    }
    uint32_t end = 0;
    if (high >= 0.5f) {
        end = high < n_cells ? static_cast<uint32_t>(high - 0.5f) + 1 : n;
    }
    return {first, end > first ? end : first};
}

/// Columns of a strip in row ky.
inline Span columns_of(const Strip &strip, uint32_t ky, uint32_t nx)
{
    const float middle = strip.offset + strip.slope * (static_cast<float>(ky) + 0.5f);
    const float low = middle - strip.half_width;
    const float high = middle + strip.half_width;
    return centres_between(low > strip.u_min ? low : strip.u_min,
                           high < strip.u_max ? high : strip.u_max, nx);
}

/// Call visit(cell) for the given columns of each of the given rows.
template <class Columns, class Visit>
inline void for_cells(Cell *cells, const Window &w, Span rows, Columns columns_of_row, Visit visit)
{
    if (w.nx == 0) {
        return;
    }
    const uint32_t row0 = wrap_index(w.iy0, w.ny);
    const uint32_t column0 = wrap_index(w.ix0, w.nx);
    for (uint32_t ky = rows.first; ky < rows.end; ++ky) {
        const Span columns = columns_of_row(ky);
        const uint32_t row = row0 + ky < w.ny ? row0 + ky : row0 + ky - w.ny;
        Cell *const first = cells + static_cast<size_t>(row) * w.nx;
        Cell *const end = first + w.nx;
        Cell *cell = first + column0 + columns.first;
        cell = cell < end ? cell : cell - w.nx;
        for (uint32_t n_left = columns.end - columns.first; n_left > 0; --n_left) {
            visit(*cell);
            cell = cell + 1 == end ? first : cell + 1;
        }
    }
}

/// Call visit(cell) for the cells of a strip.
template <class Visit> inline void for_strip(Layer &layer, const Strip &strip, Visit visit)
{
    const Window &w = layer.window;
    for_cells(
        layer.cells, w, centres_between(strip.v_min, strip.v_max, w.ny),
        [&strip, &w](uint32_t ky) { return columns_of(strip, ky, w.nx); }, visit);
}

/// Start the round over all cells again, because the map or the window changed.
void start_round(Layer &layer);

/// Make a cell unknown, and dirty unless it is outside of the focus band.
void reset_cell(const Lowres &lowres, Layer &layer, uint32_t slot, bool is_outside);

} // namespace gpom
