#include "gpom/sectors.h"

#include "src/base/check.hpp"
#include "src/lane/elementary.hpp"
#include "src/map/map.hpp"
#include "src/raster/reading.hpp"

namespace gpom
{
namespace
{

constexpr double kPi = 3.1415926535897932;
/// More than the error of a bearing [rad].
constexpr float kSlack_rad = 2e-6f;
/// Lengths are shortened by this part, which is more than their rounding.
constexpr float kShorter = 1.0f - 5e-7f;
/// Shorter components of a direction count as 0.
constexpr float kLevel = 1e-7f;
/// Greatest range [cells]. Offsets of cells are exact in float32.
constexpr double kRangeMax = 1048576.0;
/// A sector is unknown if it ends in unknown cells within this many cells of the robot's edge.
constexpr float kEdgeCells = 2.0f;
/// Angles are at most this, as for direction_of() [rad].
constexpr double kYawMax_rad = 1e6;

constexpr gpom_cell_t kUnknownCell = {0, 255, GPOM_UNKNOWN, 0};

/// One look about. Lengths are in cells.
struct Look {
    const Layer &layer;
    Window window;
    int32_t ix, iy; ///< The robot's cell.
    float fx, fy;   ///< The robot's place in its cell, 0 .. 1.
    double yaw_rad;
    Direction forward;
    float range, radius;
    gpom_sector_t *sectors;
    int32_t n_sectors;
};

/// A vector, or the corner of a cell relative to the robot [cells].
struct Arrow {
    float x, y;
};

float length_of(Arrow a) { return lane::sqrt(a.x * a.x + a.y * a.y); }

/// The arrow `b` as seen from the direction `a`: along it and to its left.
Arrow turned(Arrow a, Arrow b) { return {a.x * b.x + a.y * b.y, a.x * b.y - a.y * b.x}; }

/// Angle of an arrow, -pi .. pi. 0 for no length. Absolute error <= 6e-7.
float angle_of(Arrow a)
{
    constexpr float kHalfPi = 1.57079637f;
    const float along = lane::abs(a.x), aside = lane::abs(a.y);
    const float longer = lane::max(along, aside);
    if (!(longer > 0.0f)) {
        return 0.0f;
    }
    const float t = lane::min(along, aside) / longer;
    const float small = acute_asin_of_complement(1.0f - t / lane::sqrt(1.0f + t * t));
    const float acute = aside > along ? kHalfPi - small : small;
    const float angle = a.x < 0.0f ? 2.0f * kHalfPi - acute : acute;
    return a.y < 0.0f ? -angle : angle;
}

/// Number of the sector whose middle is nearest to a bearing. It may be below 0 or beyond the last.
int32_t sector_at(const Look &look, float bearing_rad)
{
    const float turns = bearing_rad * static_cast<float>(0.5 / kPi);
    const float place = turns * static_cast<float>(look.n_sectors) + 0.5f;
    const int32_t whole = static_cast<int32_t>(place);
    return static_cast<float>(whole) > place ? whole - 1 : whole;
}

gpom_sector_t &sector_of(const Look &look, int32_t i)
{
    return look.sectors[wrap_index(i, static_cast<uint32_t>(look.n_sectors))];
}

gpom_cell_t cell_beside(const Look &look, int32_t dx, int32_t dy)
{
    const Window &w = look.window;
    const int32_t ix = look.ix + dx, iy = look.iy + dy;
    return contains(w, ix, iy) ? read_cell(look.layer.cells[slot_of(w, ix, iy)]) : kUnknownCell;
}

/// Copy what is known of a cell into a sector.
void note(gpom_sector_t &sector, const gpom_cell_t &cell)
{
    sector.probability = cell.probability;
    sector.variance = cell.variance;
    sector.cls = cell.cls;
}

/// A sector ends at the nearest cell. Of cells at the same distance, the most probable ends it.
bool ends_before(const gpom_cell_t &cell, float distance, const gpom_sector_t &sector)
{
    if (distance != sector.distance_m || sector.cls == GPOM_FREE) {
        return distance < sector.distance_m;
    }
    return sector.cls != GPOM_UNKNOWN &&
           (cell.cls == GPOM_UNKNOWN || cell.probability > sector.probability);
}

/// Length of a ray up to the cell with the lower left corner `low`. The ray meets the cell.
float entry_of(Direction ray, Arrow low)
{
    const auto from = [](float slope, float near) {
        const float edge = slope > 0.0f ? near : near + 1.0f;
        return lane::abs(slope) > kLevel ? edge / slope : 0.0f;
    };
    return lane::max(from(ray.x, low.x), from(ray.y, low.y));
}

/// The bearings that a cell covers, from the right to the left.
struct Cover {
    float right_rad, left_rad;
};

Cover cover_of(const Look &look, Arrow low)
{
    const Arrow middle = {low.x + 0.5f, low.y + 0.5f};
    Cover aside = {0.0f, 0.0f};
    for (int i = 0; i < 4; ++i) {
        const Arrow corner = {low.x + static_cast<float>(i & 1),
                              low.y + static_cast<float>(i >> 1)};
        const float aside_rad = angle_of(turned(middle, corner));
        aside.right_rad = lane::min(aside.right_rad, aside_rad);
        aside.left_rad = lane::max(aside.left_rad, aside_rad);
    }
    const float middle_rad = angle_of(turned({look.forward.x, look.forward.y}, middle));
    return {middle_rad + aside.right_rad - kSlack_rad, middle_rad + aside.left_rad + kSlack_rad};
}

/// A cell that is not free ends every sector that it overlaps, unless a nearer cell already did.
void end_sectors(const Look &look, Arrow low, float distance, const gpom_cell_t &cell)
{
    const bool is_about = !(distance > 0.0f); // the robot stands in the cell
    const Cover cover = cover_of(look, low);
    const int32_t first = sector_at(look, cover.right_rad);
    const int32_t n = sector_at(look, cover.left_rad) - first + 1;
    const float width_rad = static_cast<float>(2.0 * kPi) / static_cast<float>(look.n_sectors);
    for (int32_t i = 0; i < (is_about || n > look.n_sectors ? look.n_sectors : n); ++i) {
        gpom_sector_t &sector = sector_of(look, first + i);
        const float bearing_rad = width_rad * static_cast<float>(first + i);
        const bool is_ahead = bearing_rad >= cover.right_rad && bearing_rad <= cover.left_rad;
        if (ends_before(cell, distance, sector)) {
            sector.distance_m = distance;
            note(sector, cell);
        }
        if ((is_ahead || is_about) && distance < sector.free_m) {
            const double turn = static_cast<double>(bearing_rad);
            const float entry = is_about ? 0.0f : entry_of(direction_of(look.yaw_rad + turn), low);
            sector.free_m = lane::min(sector.free_m, lane::max(entry, distance));
        }
    }
}

/// A free cell is noted in the sector of its centre, if it is the most probable so far.
void note_free(const Look &look, Arrow low, const gpom_cell_t &cell)
{
    const Arrow middle = {low.x + 0.5f, low.y + 0.5f};
    gpom_sector_t &sector = sector_of(
        look, sector_at(look, angle_of(turned({look.forward.x, look.forward.y}, middle))));
    if (sector.cls == GPOM_FREE && cell.probability >= sector.probability) {
        note(sector, cell);
    }
}

void visit(const Look &look, int32_t dx, int32_t dy)
{
    const Arrow low = {static_cast<float>(dx) - look.fx, static_cast<float>(dy) - look.fy};
    const Arrow gap = {lane::max(lane::max(low.x, -1.0f - low.x), 0.0f),
                       lane::max(lane::max(low.y, -1.0f - low.y), 0.0f)};
    const float distance = length_of(gap);
    const bool is_robot =
        look.radius > 0.0f && length_of({low.x + 0.5f, low.y + 0.5f}) <= look.radius;
    if (distance >= look.range || is_robot) {
        return;
    }
    const gpom_cell_t cell = cell_beside(look, dx, dy);
    if (cell.cls == GPOM_FREE) {
        note_free(look, low, cell);
    } else {
        end_sectors(look, low, distance, cell);
    }
}

/// The longest way that is free straight ahead.
float farthest(const Look &look)
{
    float most = 0.0f;
    for (int32_t i = 0; i < look.n_sectors; ++i) {
        most = lane::max(most, look.sectors[i].free_m);
    }
    return most;
}

int32_t larger(int32_t a, int32_t b) { return a > b ? a : b; }
int32_t smaller(int32_t a, int32_t b) { return a < b ? a : b; }

/// A part of a row of a ring, relative to the robot.
struct RingRow {
    int32_t dy, first, last, step;
};

void visit_row(const Look &look, const RingRow &row, int32_t left)
{
    for (int32_t dx = row.first; dx <= row.last; dx += row.step) {
        if (dx >= left) {
            visit(look, dx, row.dy);
        }
    }
}

/// Visit the cells ring by ring, the nearest first: those of the raster, and those beside its edge,
/// which stand for all that is outside. Stop before the ring behind the ends of all sectors.
void visit_rings(const Look &look)
{
    const Window &w = look.window;
    const int32_t left = w.ix0 - 1 - look.ix, right = left + static_cast<int32_t>(w.nx) + 1;
    const int32_t low = w.iy0 - 1 - look.iy, high = low + static_cast<int32_t>(w.ny) + 1;
    const int32_t n_rings = larger(larger(-left, right), larger(-low, high));
    for (int32_t ring = 0; ring <= n_rings; ++ring) {
        if (static_cast<float>(ring - 1) >= farthest(look)) {
            return;
        }
        for (int32_t dy = larger(-ring, low); dy <= smaller(ring, high); ++dy) {
            const bool is_whole = dy == -ring || dy == ring;
            visit_row(look,
                      {dy, is_whole ? larger(-ring, left) : -ring, smaller(ring, right),
                       is_whole ? 1 : 2 * ring},
                      left);
        }
    }
}

/// All sectors end nowhere, or if `is_known` is false, at once.
void begin_sectors(const Look &look, bool is_known)
{
    const float length = is_known ? look.range : 0.0f;
    const gpom_sector_t begun = {length, length, 0, 0, GPOM_FREE, 0};
    for (int32_t i = 0; i < look.n_sectors; ++i) {
        look.sectors[i] = begun;
        if (!is_known) {
            note(look.sectors[i], kUnknownCell);
            look.sectors[i].flags = GPOM_SECTOR_UNKNOWN;
        }
    }
}

/// Set the flags, and turn cells into metres.
void finish_sectors(const Look &look, float range_m)
{
    const float cell_m = static_cast<float>(look.window.cell_m) * kShorter;
    for (int32_t i = 0; i < look.n_sectors; ++i) {
        gpom_sector_t &sector = look.sectors[i];
        const bool is_at_edge = sector.distance_m < look.radius + kEdgeCells;
        sector.flags = sector.cls == GPOM_UNKNOWN && is_at_edge ? GPOM_SECTOR_UNKNOWN : 0;
        sector.free_m = sector.free_m < look.range ? sector.free_m * cell_m : range_m;
        sector.distance_m = sector.distance_m < look.range ? sector.distance_m * cell_m : range_m;
    }
}

bool look_about(const Layer &layer, const Window &w, const gpom_lookout_t &lookout,
                gpom_sector_t *sectors, size_t n_sectors)
{
    const int32_t ix = cell_number(lookout.x_m, w.x0_m, w.cell_m);
    const int32_t iy = cell_number(lookout.y_m, w.y0_m, w.cell_m);
    const double fx = (lookout.x_m - w.x0_m) / w.cell_m - ix;
    const double fy = (lookout.y_m - w.y0_m) / w.cell_m - iy;
    const double range = lane::min(static_cast<double>(lookout.range_m) / w.cell_m, kRangeMax);
    const double radius = static_cast<double>(lookout.radius_m) / w.cell_m;
    const Look look = {layer,
                       w,
                       ix,
                       iy,
                       static_cast<float>(fx),
                       static_cast<float>(fy),
                       lookout.yaw_rad,
                       direction_of(lookout.yaw_rad),
                       static_cast<float>(range),
                       static_cast<float>(radius),
                       sectors,
                       static_cast<int32_t>(n_sectors)};
    const bool is_inside = contains(w, ix, iy);
    begin_sectors(look, is_inside);
    if (is_inside) {
        visit_rings(look);
        finish_sectors(look, lookout.range_m);
    }
    return is_inside;
}

bool is_lookout(const gpom_lookout_t &lookout)
{
    return is_finite(lookout.x_m) && is_finite(lookout.y_m) &&
           is_within(lookout.yaw_rad, kYawMax_rad) && lookout.range_m > 0.0f &&
           lookout.range_m <= FLT_MAX && is_between(lookout.radius_m, 0.0f, FLT_MAX);
}

} // namespace
} // namespace gpom

gpom_status_t gpom_sectors(const gpom_map_t *map, const gpom_lookout_t *lookout,
                           gpom_sector_t *sectors, size_t n_sectors, gpom_lowres_info_t *info)
{
    if (!gpom::is_map(map) || lookout == nullptr || sectors == nullptr) {
        return GPOM_ERR_ARG;
    }
    const gpom::Lowres &lowres = map->lowres;
    const gpom::Layer &layer = lowres.layers[GPOM_LAYER_COARSE];
    if (layer.cell_max == 0 || n_sectors == 0 || n_sectors > GPOM_SECTORS_MAX ||
        !gpom::is_lookout(*lookout)) {
        return GPOM_ERR_ARG;
    }
    for (uint32_t i = 0; i < GPOM_LOWRES_TRIES; ++i) {
        uint32_t counter;
        gpom::Window window;
        if (!gpom::begin_read(lowres, counter)) {
            continue;
        }
        const gpom_lowres_info_t read = gpom::read_info(lowres, layer, window);
        if (!gpom::end_read(lowres, counter)) {
            continue; // the window may mix words of two windows
        }
        const bool is_inside = gpom::look_about(layer, window, *lookout, sectors, n_sectors);
        if (gpom::end_read(lowres, counter)) {
            if (info != nullptr) {
                *info = read;
            }
            return is_inside ? GPOM_OK : GPOM_ERR_REACH;
        }
    }
    return GPOM_ERR_BUSY;
}
