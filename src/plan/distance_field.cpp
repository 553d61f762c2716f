// Sweeps of columns and rows of a distance field.
#include "src/plan/distance_field.hpp"

namespace gpom
{
namespace
{

/// True if a cell is a target.
bool is_target(uint32_t value, Target target)
{
    const uint32_t cls = class_of_value(value);
    return target == kOccupied ? cls == GPOM_OCCUPIED : cls != GPOM_FREE;
}

uint32_t square(int32_t i) { return static_cast<uint32_t>(i * i); }

/// Slot of row or column i of the window, whose first one has the number i0.
uint32_t slot_along(int32_t i0, uint32_t i, uint32_t n)
{
    const uint32_t slot = wrap_index(i0, n) + i;
    return slot < n ? slot : slot - n;
}

/// One column or row of a field.
class Line {
public:
    /// A column: `first` is its cell in slot row 0.
    Line(Nearest *first, int32_t i0, uint32_t n, size_t step)
        : first_(first), slot0_(wrap_index(i0, n)), n_(n), step_(step)
    {
    }
    size_t slot(int32_t i) const
    {
        const uint32_t at = slot0_ + static_cast<uint32_t>(i);
        return (at < n_ ? at : at - n_) * step_;
    }
    Nearest &at(int32_t i) const { return first_[slot(i)]; }

private:
    Nearest *first_;
    uint32_t slot0_, n_;
    size_t step_;
};

bool has_changes(const Changes &changes)
{
    return changes.of[kOccupied].last >= 0 || changes.of[kNotFree].last >= 0;
}

void mark(Changes &changes, Target target, int32_t place, uint32_t &n_marked)
{
    n_marked += has_changes(changes) ? 0u : 1u;
    Places &places = changes.of[target];
    places.first = place < places.first ? static_cast<int16_t>(place) : places.first;
    places.last = place > places.last ? static_cast<int16_t>(place) : places.last;
}

/// Mark the places 0 .. n_places - 1 of n columns or rows.
void mark_all(Changes *changes, uint32_t n, uint32_t n_places)
{
    const Places all = {0, static_cast<int16_t>(n_places - 1)};
    for (uint32_t i = 0; i < n; ++i) {
        changes[i] = {{all, all}};
    }
}

/// The next column or row with changes, from `cursor` on. There is one. Adds the looks to `ops`.
uint32_t next_marked(const Changes *changes, uint32_t n, uint32_t &cursor, uint64_t &ops)
{
    uint32_t place = cursor < n ? cursor : 0;
    while (!has_changes(changes[place])) {
        place = place + 1 < n ? place + 1 : 0;
        ++ops;
    }
    cursor = place + 1;
    return place;
}

/// The offset of the next cell: 0 at a target, else `step` more than that of the cell before.
int16_t grown(int16_t offset, bool is_at_target, int16_t step)
{
    if (is_at_target || offset == kNone) {
        return is_at_target ? int16_t{0} : kNone;
    }
    return static_cast<int16_t>(offset + step);
}

int16_t nearer(int16_t below, int16_t above)
{
    return above == kNone || (below != kNone && -below <= above) ? below : above;
}

/// The rows that a change in `changed` can reach: as far as the next target beyond it, if there is
/// one, which has not changed.
Places reach_in_column(const Line &column, Places changed, int32_t n)
{
    int32_t first = changed.first, last = changed.last;
    while (first > 0 && (first == changed.first || column.at(first).along != 0)) {
        --first;
    }
    while (last + 1 < n && (last == changed.last || column.at(last).along != 0)) {
        ++last;
    }
    return {static_cast<int16_t>(first), static_cast<int16_t>(last)};
}

/// Sweep a column up and down. The field's envelope is room for the offsets of the way up. The ends
/// of the reach stay targets if they were, even if the raster has changed meanwhile: the next
/// comparison finds them.
uint64_t sweep_column(gpom_distances &field, const Layer &layer, Target target, uint32_t kx)
{
    const Window &w = field.window;
    const uint32_t slot_x = slot_along(w.ix0, kx, w.nx);
    const Line column(field.nearest[target] + slot_x, w.iy0, w.ny, w.nx);
    const Places changed = field.columns[kx].of[target];
    const Places reach = reach_in_column(column, changed, static_cast<int32_t>(w.ny));
    const auto is_kept = [&](int32_t ky) {
        return (ky < changed.first || ky > changed.last) && column.at(ky).along == 0;
    };
    Parabola *const below = field.envelope;
    int16_t offset = kNone;
    for (int32_t ky = reach.first; ky <= reach.last; ++ky) {
        const uint32_t value = load(layer.cells[slot_x + column.slot(ky)].value);
        offset = grown(offset, is_kept(ky) || is_target(value, target), -1);
        below[ky].first = offset;
    }
    offset = kNone;
    for (int32_t ky = reach.last; ky >= reach.first; --ky) {
        offset = grown(offset, below[ky].first == 0, 1);
        const int16_t along = nearer(below[ky].first, offset);
        if (along != column.at(ky).along) {
            column.at(ky).along = along;
            mark(field.rows[ky], target, static_cast<int32_t>(kx), field.n_rows);
        }
    }
    return static_cast<uint64_t>(reach.last) - static_cast<uint64_t>(reach.first) + 1;
}

/// The columns of a row that a change can reach, and the columns that can be nearest to them.
struct RowReach {
    int32_t first, last;
    int32_t first_column, last_column;
};

/// True if cell x is at least as near to its nearest column as to any column beyond `changed`. Then
/// so are all cells on the other side of x (the difference of two parabolas is linear in x).
bool is_settled(const Line &row, int32_t x, int32_t changed, int32_t &column)
{
    const int16_t across = row.at(x).across;
    if (across == kNone) {
        return false;
    }
    column = x + across;
    const bool is_on_this_side = x < changed ? column < changed : column > changed;
    return is_on_this_side && square(across) + square(row.at(column).along) <= square(x - changed);
}

RowReach reach_in_row(const Line &row, Places changed, int32_t n)
{
    RowReach reach = {changed.first, changed.last, 0, n - 1};
    int32_t column = 0;
    while (reach.first > 0 && !is_settled(row, reach.first - 1, changed.first, column)) {
        --reach.first;
    }
    reach.first_column = reach.first > 0 ? column : 0;
    while (reach.last + 1 < n && !is_settled(row, reach.last + 1, changed.last, column)) {
        ++reach.last;
    }
    reach.last_column = reach.last + 1 < n ? column : n - 1;
    return reach;
}

/// The first x from which on column `next` is nearer than the column of the parabola. The parabola
/// is at least as near at its first place.
int32_t takes_over_at(const Parabola &parabola, int32_t next, uint32_t along2)
{
    const int32_t sum = next + parabola.column;
    if (along2 == parabola.along2) {
        return sum / 2 + 1;
    }
    const int32_t apart = next - parabola.column;
    const uint32_t ahead =
        static_cast<uint32_t>(apart * sum) + along2 - parabola.along2; // never negative
    return static_cast<int32_t>(ahead / (2 * static_cast<uint32_t>(apart))) + 1;
}

/// The lower envelope, over the reach, of the parabolas of its columns, from the left to the right.
/// Returns their number.
uint32_t build_envelope(const Line &row, const RowReach &reach, Parabola *envelope)
{
    uint32_t n = 0;
    for (int32_t x = reach.first_column; x <= reach.last_column; ++x) {
        const int16_t along = row.at(x).along;
        if (along == kNone) {
            continue;
        }
        const uint32_t along2 = square(along);
        while (n > 0) {
            const Parabola &top = envelope[n - 1];
            if (square(top.first - top.column) + top.along2 <= square(top.first - x) + along2) {
                break;
            }
            --n;
        }
        const int32_t first = n > 0 ? takes_over_at(envelope[n - 1], x, along2) : reach.first;
        if (first <= reach.last) {
            envelope[n++] = {static_cast<int16_t>(x), static_cast<int16_t>(first), along2};
        }
    }
    return n;
}

uint64_t sweep_row(gpom_distances &field, Target target, uint32_t ky)
{
    const Window &w = field.window;
    const size_t first_slot = size_t{slot_along(w.iy0, ky, w.ny)} * w.nx;
    const Line row(field.nearest[target] + first_slot, w.ix0, w.nx, 1);
    const RowReach reach = reach_in_row(row, field.rows[ky].of[target], static_cast<int32_t>(w.nx));
    const uint32_t n = build_envelope(row, reach, field.envelope);
    uint32_t i = 0;
    for (int32_t x = reach.first; x <= reach.last; ++x) {
        while (i + 1 < n && field.envelope[i + 1].first <= x) {
            ++i;
        }
        row.at(x).across = n > 0 ? static_cast<int16_t>(field.envelope[i].column - x) : kNone;
    }
    return static_cast<uint64_t>(reach.last_column) - static_cast<uint64_t>(reach.first_column) + 1;
}

/// Mark a cell of the row that is compared. It changed as at least one kind of target.
void mark_cell(gpom_distances &field, uint32_t slot, bool is_occupied_changed, uint32_t value)
{
    const Window &w = field.window;
    const uint32_t slot0 = wrap_index(w.ix0, w.nx);
    const uint32_t kx = slot >= slot0 ? slot - slot0 : slot + w.nx - slot0;
    const size_t first = size_t{slot_along(w.iy0, field.compared, w.ny)} * w.nx;
    const int32_t ky = static_cast<int32_t>(field.compared);
    if (is_occupied_changed) {
        mark(field.columns[kx], kOccupied, ky, field.n_columns);
    }
    if (is_target(value, kNotFree) != (field.nearest[kNotFree][first + slot].along == 0)) {
        mark(field.columns[kx], kNotFree, ky, field.n_columns);
    }
}

} // namespace

void mark_field(gpom_distances &field)
{
    const Window &w = field.window;
    mark_all(field.columns, w.nx, w.ny);
    mark_all(field.rows, w.ny, w.nx);
    field.n_columns = w.nx;
    field.n_rows = w.ny;
}

uint64_t compare_row(gpom_distances &field, const Layer &layer)
{
    const Window &w = field.window;
    const size_t first = size_t{slot_along(w.iy0, field.compared, w.ny)} * w.nx;
    const Cell *const cells = layer.cells + first;
    const Nearest *const occupied = field.nearest[kOccupied] + first;
    const Nearest *const not_free = field.nearest[kNotFree] + first;
    for (uint32_t slot = 0; slot < w.nx; ++slot) { // few cells differ: this loop is short
        const uint32_t value = load(cells[slot].value);
        const bool is_changed = is_target(value, kOccupied) != (occupied[slot].along == 0);
        if (is_changed | (is_target(value, kNotFree) != (not_free[slot].along == 0))) {
            mark_cell(field, slot, is_changed, value);
        }
    }
    ++field.compared;
    return w.nx;
}

uint64_t sweep_next_column(gpom_distances &field, const Layer &layer)
{
    uint64_t ops = 0;
    const uint32_t kx = next_marked(field.columns, field.window.nx, field.column, ops);
    for (const Target target : kAllTargets) {
        if (field.columns[kx].of[target].last >= 0) {
            ops += kSweepOps / kTargets * sweep_column(field, layer, target, kx);
        }
    }
    field.columns[kx] = {{kNoPlaces, kNoPlaces}};
    --field.n_columns;
    return ops;
}

uint64_t sweep_next_row(gpom_distances &field)
{
    uint64_t ops = 0;
    const uint32_t ky = next_marked(field.rows, field.window.ny, field.row, ops);
    for (const Target target : kAllTargets) {
        if (field.rows[ky].of[target].last >= 0) {
            ops += kSweepOps / kTargets * sweep_row(field, target, ky);
        }
    }
    field.rows[ky] = {{kNoPlaces, kNoPlaces}};
    --field.n_rows;
    return ops;
}

Nearest offset_at(const gpom_distances &field, Target target, uint32_t ix, uint32_t iy)
{
    const Window &w = field.window;
    const size_t first_slot = size_t{slot_along(w.iy0, iy, w.ny)} * w.nx;
    const Line row(field.nearest[target] + first_slot, w.ix0, w.nx, 1);
    const int16_t across = row.at(static_cast<int32_t>(ix)).across;
    if (across == kNone) {
        return {kNone, kNone};
    }
    const int32_t column = static_cast<int32_t>(ix) + across;
    const bool is_inside = column >= 0 && column < static_cast<int32_t>(w.nx);
    const int16_t along = is_inside ? row.at(column).along : kNone;
    // Before a row is swept again, the cell may be gone. The distance along x is a lower bound
    // then.
    return {along == kNone ? int16_t{0} : along, across};
}

} // namespace gpom
