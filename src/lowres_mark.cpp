// Which cells a change of the map can reach: shapes are filled row by row, a span of columns each.
#include "src/map.hpp"

namespace gpom
{
namespace
{

/// Rounding of a capsule's coordinates, in parts of their size.
constexpr float kRounding = 1e-6f;

/// Columns or rows [first, end) of n whose centres k + 0.5 lie in [low, high].
RowRange centres_between(float low, float high, uint32_t n)
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

struct Interval {
    float low, high;
};

/// u with low <= slope u + offset <= high, within `all`.
Interval solve(float slope, float offset, Interval bounds, Interval all)
{
    if (lane::abs(slope) < kRounding) {
        const bool holds = offset >= bounds.low && offset <= bounds.high;
        return holds ? all : Interval{1.0f, 0.0f};
    }
    const float a = (bounds.low - offset) / slope;
    const float b = (bounds.high - offset) / slope;
    return {lane::max(all.low, lane::min(a, b)), lane::min(all.high, lane::max(a, b))};
}

/// Smallest interval around both; one with low > high is empty.
Interval hull(Interval a, Interval b)
{
    if (a.low > a.high) {
        return b;
    }
    if (b.low > b.high) {
        return a;
    }
    return {lane::min(a.low, b.low), lane::max(a.high, b.high)};
}

/// Where the row at height v crosses a disc.
Interval chord(float u0, float v0, float radius, float v)
{
    const float square = radius * radius - (v - v0) * (v - v0);
    if (!(square >= 0.0f)) {
        return {1.0f, 0.0f};
    }
    const float half = lane::sqrt(square);
    return {u0 - half, u0 + half};
}

/// Where it crosses the stretch's rectangle.
Interval rectangle_chord(const Capsule &c, float v)
{
    const float height = v - c.v0;
    const Interval all = {lane::min(c.u0, c.u1) - c.radius, lane::max(c.u0, c.u1) + c.radius};
    const float along = height * c.dir_v - c.u0 * c.dir_u;
    const float across = height * c.dir_u + c.u0 * c.dir_v;
    const Interval ends = solve(c.dir_u, along, {0.0f, c.length}, all);
    return ends.low > ends.high ? ends : solve(-c.dir_v, across, {-c.radius, c.radius}, ends);
}

float cells_from_corner(double origin_m, float offset_m, double corner_m, double cell_m)
{
    return static_cast<float>((origin_m - corner_m + static_cast<double>(offset_m)) / cell_m);
}

void mark(Cell &cell, uint32_t &n_marked)
{
    const uint32_t value = load(cell.value);
    if ((value & (kDirty | kOutside)) == 0) {
        store(cell.value, value | kDirty);
        ++n_marked;
    }
}

void mark_span(Layer &layer, const RowSpan &span, uint32_t &n_marked)
{
    for_cells(layer.cells, layer.window, span, [&n_marked](Cell &cell) { mark(cell, n_marked); });
}

/// After marks in a layer: the round over all cells begins anew.
void count_marks(Layer &layer, uint32_t n_marked)
{
    store(layer.n_dirty, load(layer.n_dirty) + n_marked);
    layer.n_stale = place_count(layer.window);
}

} // namespace

Capsule capsule_of(const Lowres &lowres, const Window &w, Point from, Point to, float reach_m)
{
    const double corner_x_m = w.x0_m + w.ix0 * w.cell_m;
    const double corner_y_m = w.y0_m + w.iy0 * w.cell_m;
    Capsule c = {};
    c.u0 = cells_from_corner(lowres.origin_x_m, from.x_m, corner_x_m, w.cell_m);
    c.v0 = cells_from_corner(lowres.origin_y_m, from.y_m, corner_y_m, w.cell_m);
    c.u1 = cells_from_corner(lowres.origin_x_m, to.x_m, corner_x_m, w.cell_m);
    c.v1 = cells_from_corner(lowres.origin_y_m, to.y_m, corner_y_m, w.cell_m);
    const float du = c.u1 - c.u0;
    const float dv = c.v1 - c.v0;
    c.length = lane::sqrt(du * du + dv * dv);
    c.dir_u = c.length > 0.0f ? du / c.length : 1.0f;
    c.dir_v = c.length > 0.0f ? dv / c.length : 0.0f;
    const float size = lane::abs(c.u0) + lane::abs(c.v0) + lane::abs(c.u1) + lane::abs(c.v1) +
                       static_cast<float>(w.nx) + static_cast<float>(w.ny);
    c.radius = reach_m / static_cast<float>(w.cell_m) + kRounding * size;
    return c;
}

RowRange rows_of(const Window &w, const Capsule &c)
{
    return centres_between(lane::min(c.v0, c.v1) - c.radius, lane::max(c.v0, c.v1) + c.radius,
                           w.ny);
}

RowSpan span_of(const Window &w, const Capsule &c, uint32_t ky)
{
    const float v = static_cast<float>(ky) + 0.5f;
    const Interval discs = hull(chord(c.u0, c.v0, c.radius, v), chord(c.u1, c.v1, c.radius, v));
    const Interval all = hull(discs, rectangle_chord(c, v));
    const RowRange columns = centres_between(all.low, all.high, w.nx);
    return {ky, columns.first, columns.end};
}

void lowres_mark_segment(Lowres &lowres, Point from, Point to, float reach_m)
{
    for (Layer &layer : lowres.layers) {
        const Window &w = layer.window;
        const Capsule capsule = capsule_of(lowres, w, from, to, reach_m);
        const RowRange rows = rows_of(w, capsule);
        uint32_t n_marked = 0;
        for (uint32_t ky = rows.first; ky < rows.end; ++ky) {
            mark_span(layer, span_of(w, capsule, ky), n_marked);
        }
        count_marks(layer, n_marked);
    }
    lowres.near = {0, 0};
}

void lowres_mark_box(Lowres &lowres, Point low, Point high, float reach_m)
{
    for (Layer &layer : lowres.layers) {
        const Window &w = layer.window;
        const Capsule diagonal = capsule_of(lowres, w, low, high, reach_m);
        const float radius = diagonal.radius;
        const RowRange rows = centres_between(diagonal.v0 - radius, diagonal.v1 + radius, w.ny);
        const RowRange columns = centres_between(diagonal.u0 - radius, diagonal.u1 + radius, w.nx);
        uint32_t n_marked = 0;
        for (uint32_t ky = rows.first; ky < rows.end; ++ky) {
            mark_span(layer, {ky, columns.first, columns.end}, n_marked);
        }
        count_marks(layer, n_marked);
    }
    lowres.near = {0, 0};
}

void lowres_mark_all(Lowres &lowres)
{
    for (Layer &layer : lowres.layers) {
        uint32_t n_marked = 0;
        for (uint32_t slot = 0; slot < cell_count(layer.window); ++slot) {
            mark(layer.cells[slot], n_marked);
        }
        count_marks(layer, n_marked);
    }
    lowres.near = {0, 0};
}

} // namespace gpom
