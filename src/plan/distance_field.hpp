/// \file distance_field.hpp
/// The memory of a distance field, and the sweeps of its columns and rows (distances.h).
#pragma once

#include "gpom/distances.h"
#include "src/base/arena.hpp"
#include "src/raster/lowres.hpp"

namespace gpom
{

/// The distances to occupied cells and to cells that are not free.
enum Target : uint32_t { kOccupied = 0, kNotFree = 1 };
constexpr uint32_t kTargets = 2;
constexpr Target kAllTargets[kTargets] = {kOccupied, kNotFree};

/// Of a cell: `along` is the offset to the nearest target cell of its column, along y. `across` is
/// the offset to the column of the nearest target cell of all, along x. So the nearest cell of all
/// is (x + across, y + along of (x + across, y)).
struct Nearest {
    int16_t along, across;
};
constexpr int16_t kNone = GPOM_OFFSET_NONE;

/// A parabola of the lower envelope in a row: from `first` on, the nearest cell of all is in column
/// `column`.
struct Parabola {
    int16_t column, first;
    uint32_t along2; ///< The square of its `along`.
};

/// Columns or rows of the window, first .. last. None if first > last.
struct Places {
    int16_t first, last;
};
constexpr Places kNoPlaces = {INT16_MAX, -1};

/// Of a column: the rows in which a cell changed since it was swept, for each target. Of a row: the
/// columns in which `along` changed.
struct Changes {
    Places of[kTargets];
};

} // namespace gpom

/// Opaque to users (gpom_distances_t).
struct gpom_distances {
    uint32_t magic; ///< kFieldMagic if the field is initialised.
    uint32_t frame_epoch, map_sequence, begun_sequence;
    gpom::Window window; ///< That of the raster. Cells lie in the same slots as there.
    gpom::Nearest *nearest[gpom::kTargets];
    gpom::Changes *columns, *rows; ///< From the corner of the window.
    gpom::Parabola *envelope;
    uint32_t n_columns, n_rows;     ///< Columns and rows with changes.
    uint32_t compared, column, row; ///< Next row to compare, next column and row to look at.
};

namespace gpom
{

constexpr uint32_t kFieldMagic = 0x74736964; // "dist"

/// Operations of sweeping a cell.
constexpr uint64_t kSweepOps = 8;

struct FieldLayout {
    size_t nearest[kTargets], envelope, columns, rows, total;
};

constexpr FieldLayout field_layout(uint32_t nx, uint32_t ny)
{
    const size_t nearest_bytes = align8(size_t{nx} * ny * sizeof(Nearest));
    const size_t longer = nx > ny ? nx : ny;
    FieldLayout layout = {};
    layout.nearest[kOccupied] = align8(sizeof(gpom_distances));
    layout.nearest[kNotFree] = layout.nearest[kOccupied] + nearest_bytes;
    layout.envelope = layout.nearest[kNotFree] + nearest_bytes;
    layout.columns = layout.envelope + longer * sizeof(Parabola);
    layout.rows = layout.columns + nx * sizeof(Changes);
    layout.total = layout.rows + ny * sizeof(Changes);
    return layout;
}

static_assert(field_layout(1, 1).total <= GPOM_DISTANCES_BYTES(1, 1), "public macro too small");
static_assert(field_layout(3, 5).total <= GPOM_DISTANCES_BYTES(3, 5), "public macro too small");
static_assert(field_layout(900, 7).total <= GPOM_DISTANCES_BYTES(900, 7), "public macro too small");

/// Mark all of all columns and rows.
void mark_field(gpom_distances &field);

/// Mark the cells of the next row that are other targets than in the field. Returns the operations.
uint64_t compare_row(gpom_distances &field, const Layer &layer);

/// Sweep the column that has changes and comes next. Marks the cells whose `along` changes. Returns
/// the operations, at most nx + kSweepOps ny.
uint64_t sweep_next_column(gpom_distances &field, const Layer &layer);

/// Sweep the row that has changes and comes next. Returns the operations, at most ny + kSweepOps
/// nx.
uint64_t sweep_next_row(gpom_distances &field);

/// Offset to the nearest cell of all, from cell (ix, iy) of the window.
Nearest offset_at(const gpom_distances &field, Target target, uint32_t ix, uint32_t iy);

} // namespace gpom
