#include "gpom/path.h"

#include "src/base/check.hpp"
#include "src/lane/elementary.hpp"
#include "src/query/workspace.hpp"

#include <Eigen/Core>
#include <float.h>

namespace gpom
{
namespace
{

using Vector = Eigen::Vector2d;

constexpr double kPi = 3.1415926535897932;
/// A sector is left out if it is narrower than this part of the spacing. The stretches beside it
/// are sampled anyway.
constexpr double kNarrow = 1e-3;

struct Sample {
    Vector place_m; ///< Map frame.
    double arc_m;
};

/// A part of the swept area that is sampled row by row. It is the rectangle of a stretch, with rows
/// across the stretch, or the sector of a corner, with rings as rows.
struct Piece {
    Vector corner_m;
    Vector axis;  ///< Rectangle: direction of the stretch. Sector: direction of its first side.
    double arc_m; ///< Length of the polyline up to the corner.
    double length_m;
    double sweep_rad; ///< Angle of a sector. Negative: clockwise.
    bool is_sector;
    uint32_t n_rows; ///< Steps from the first row to the last row.
};

/// Generates the samples of a path, one after the other.
struct SampleCursor {
    const gpom_path_t &path;
    size_t i_corner, i_next; ///< i_next: next corner at another place. n_points: there is none.
    Vector in, out;          ///< Unit directions before and after the corner. 0: there is none.
    Piece piece;
    uint32_t row, i_across, n_across;
    bool is_done;
};

/// Number of equal steps of at most spacing_m that cover length_m. 0 for no length. Limited to
/// GPOM_PATH_SAMPLES_MAX: a path with this many steps has too many samples.
uint32_t step_count(double length_m, double spacing_m)
{
    const double steps = length_m / spacing_m;
    if (!(steps < static_cast<double>(GPOM_PATH_SAMPLES_MAX))) {
        return GPOM_PATH_SAMPLES_MAX;
    }
    const uint32_t whole = static_cast<uint32_t>(steps);
    return static_cast<double>(whole) < steps ? whole + 1 : whole;
}

Vector left_of(const Vector &direction) { return {-direction.y(), direction.x()}; }

Vector corner_of(const gpom_path_t &path, size_t i)
{
    return {path.points[i].x_m, path.points[i].y_m};
}

/// The unit direction of `offset`. 0 if the offset is 0.
Vector direction_of_offset(const Vector &offset)
{
    const double length = offset.norm();
    return length > 0.0 ? Vector(offset / length) : Vector(0.0, 0.0);
}

/// Angle from one unit vector to another, -pi .. pi. It is computed from the distance of `out` to
/// `in` or to -in, whichever is nearer. The cosine is not used, because it hardly changes with the
/// angle if the angle is small.
double turn_between(const Vector &in, const Vector &out)
{
    const double side = in.dot(out) < 0.0 ? -1.0 : 1.0;
    const double half_square = 0.5 * (out - side * in).squaredNorm();
    const double cross = in.x() * out.y() - in.y() * out.x();
    const float arc = acute_asin_of_complement(static_cast<float>(half_square));
    const double angle_rad = 0.5 * kPi - side * static_cast<double>(arc);
    return cross < 0.0 ? -angle_rad : angle_rad;
}

/// Set the sides of the corner's sector. It holds all directions d with d.in >= 0 and d.out <= 0.
void aim_sector(const SampleCursor &cursor, Piece &sector)
{
    if (cursor.in.isZero(0.0)) { // the half disc behind, or the whole disc if the path stands still
        sector.sweep_rad = cursor.out.isZero(0.0) ? 2.0 * kPi : kPi;
        sector.axis = cursor.out.isZero(0.0) ? Vector(1.0, 0.0) : left_of(cursor.out);
        return;
    }
    sector.sweep_rad = cursor.out.isZero(0.0) ? kPi : turn_between(cursor.in, cursor.out);
    sector.axis = sector.sweep_rad < 0.0 ? left_of(cursor.in) : Vector(-left_of(cursor.in));
}

bool is_narrow(const SampleCursor &cursor, const Piece &sector)
{
    const double width_m = cursor.path.radius_m * lane::max(sector.sweep_rad, -sector.sweep_rad);
    return !cursor.in.isZero(0.0) && width_m <= kNarrow * cursor.path.spacing_m;
}

void begin_row(SampleCursor &cursor)
{
    const Piece &piece = cursor.piece;
    double width_m = 2.0 * cursor.path.radius_m;
    if (piece.is_sector) {
        const double part = piece.n_rows > 0 ? static_cast<double>(cursor.row) / piece.n_rows : 0.0;
        width_m = part * cursor.path.radius_m * lane::max(piece.sweep_rad, -piece.sweep_rad);
    }
    cursor.n_across = step_count(width_m, cursor.path.spacing_m);
    cursor.i_across = 0;
}

/// Begin the sector of the next corner. False if the sector is too narrow.
bool begin_sector(SampleCursor &cursor)
{
    const gpom_path_t &path = cursor.path;
    cursor.i_next = cursor.i_corner + 1;
    const Vector corner_m = corner_of(path, cursor.i_corner);
    while (cursor.i_next < path.n_points && corner_of(path, cursor.i_next) == corner_m) {
        ++cursor.i_next;
    }
    cursor.in = cursor.out;
    cursor.out = cursor.i_next < path.n_points
                     ? direction_of_offset(corner_of(path, cursor.i_next) - corner_m)
                     : Vector(0.0, 0.0);
    Piece &sector = cursor.piece;
    sector.arc_m += sector.length_m;
    sector.length_m = 0.0;
    sector.corner_m = corner_m;
    sector.is_sector = true;
    sector.n_rows = step_count(path.radius_m, path.spacing_m);
    aim_sector(cursor, sector);
    cursor.row = 0;
    begin_row(cursor);
    return !is_narrow(cursor, sector);
}

/// Begin the stretch from the corner to the next one. False if there is no next corner.
bool begin_stretch(SampleCursor &cursor)
{
    if (cursor.i_next >= cursor.path.n_points) {
        return false;
    }
    Piece &stretch = cursor.piece;
    stretch.axis = cursor.out;
    stretch.length_m = (corner_of(cursor.path, cursor.i_next) - stretch.corner_m).norm();
    stretch.is_sector = false;
    stretch.n_rows = step_count(stretch.length_m, cursor.path.spacing_m);
    cursor.row = 0;
    begin_row(cursor);
    return true;
}

SampleCursor samples_along(const gpom_path_t &path)
{
    SampleCursor cursor = {path, 0, 0, Vector(0.0, 0.0), Vector(0.0, 0.0), {}, 0, 0, 0, false};
    cursor.piece.length_m = 0.0;
    cursor.piece.arc_m = 0.0;
    (void)begin_sector(cursor); // the sector of the first corner is never narrow
    return cursor;
}

Sample sample_at(const SampleCursor &cursor)
{
    const Piece &piece = cursor.piece;
    const double along = piece.n_rows > 0 ? static_cast<double>(cursor.row) / piece.n_rows : 0.0;
    const double across =
        cursor.n_across > 0 ? static_cast<double>(cursor.i_across) / cursor.n_across : 0.0;
    const double radius_m = cursor.path.radius_m;
    if (!piece.is_sector) {
        const double t_m = along * piece.length_m;
        const double s_m = (2.0 * across - 1.0) * radius_m;
        return {piece.corner_m + t_m * piece.axis + s_m * left_of(piece.axis), piece.arc_m + t_m};
    }
    const Direction turned = direction_of(across * piece.sweep_rad);
    const Vector direction = static_cast<double>(turned.x) * piece.axis +
                             static_cast<double>(turned.y) * left_of(piece.axis);
    return {piece.corner_m + along * radius_m * direction, piece.arc_m};
}

void begin_next_piece(SampleCursor &cursor)
{
    if (cursor.piece.is_sector && begin_stretch(cursor)) {
        return;
    }
    if (cursor.i_next >= cursor.path.n_points) {
        cursor.is_done = true;
        return;
    }
    cursor.i_corner = cursor.i_next;
    if (!begin_sector(cursor)) {
        (void)begin_stretch(cursor); // a narrow corner is never the last: a stretch follows it
    }
}

/// Get the next sample. False if there is none left.
bool next_sample(SampleCursor &cursor, Sample &sample)
{
    if (cursor.is_done) {
        return false;
    }
    sample = sample_at(cursor);
    if (++cursor.i_across > cursor.n_across) {
        if (++cursor.row > cursor.piece.n_rows) {
            begin_next_piece(cursor);
        } else {
            begin_row(cursor);
        }
    }
    return true;
}

/// Upper bound of the number of samples of a path. It is greater than GPOM_PATH_SAMPLES_MAX if the
/// length of the path is not finite.
double sample_bound(const gpom_path_t &path)
{
    const double across = step_count(2.0 * path.radius_m, path.spacing_m) + 1.0;
    const double rings = step_count(path.radius_m, path.spacing_m) + 1.0;
    const double around = step_count(2.0 * kPi * path.radius_m, path.spacing_m) + 2.0;
    double bound = 2.0 * rings * around;
    for (size_t i = 1; i < path.n_points; ++i) {
        const Vector offset = corner_of(path, i) - corner_of(path, i - 1);
        bound += (step_count(offset.norm(), path.spacing_m) + 1.0) * across + rings * around;
    }
    return bound;
}

bool is_path(const gpom_path_t &path)
{
    if (path.points == nullptr || path.n_points == 0) {
        return false;
    }
    for (size_t i = 0; i < path.n_points; ++i) {
        if (!is_finite(path.points[i].x_m) || !is_finite(path.points[i].y_m)) {
            return false;
        }
    }
    return path.radius_m >= 0.0 && path.radius_m <= DBL_MAX && path.spacing_m > 0.0 &&
           path.spacing_m <= DBL_MAX && path.stop_probability == path.stop_probability &&
           sample_bound(path) <= static_cast<double>(GPOM_PATH_SAMPLES_MAX);
}

/// Add the answers of one batch to the result. `cursor` generates the samples of the batch again.
void regard(const PointBatch &batch, size_t n, SampleCursor &cursor, gpom_path_result_t &result)
{
    for (size_t i = 0; i < n && (result.flags & GPOM_PATH_STOPPED) == 0; ++i) {
        Sample sample;
        (void)next_sample(cursor, sample);
        const gpom_answer_t &answer = batch.answers[i];
        result.flags |= (answer.flags & GPOM_ANSWER_OUT_OF_REACH) != 0 ? GPOM_PATH_OUT_OF_REACH : 0;
        result.flags |= (answer.flags & GPOM_ANSWER_PIVOT) != 0 ? GPOM_PATH_PIVOT : 0;
        result.flags |= (answer.flags & GPOM_ANSWER_CUT) != 0 ? GPOM_PATH_CUT : 0;
        ++result.n_samples;
        if (answer.probability > result.probability) {
            result.x_m = sample.place_m.x();
            result.y_m = sample.place_m.y();
            result.arc_m = sample.arc_m;
            result.probability = answer.probability;
            result.cls = answer.cls;
        }
        result.flags |= answer.probability >= cursor.path.stop_probability ? GPOM_PATH_STOPPED : 0;
    }
}

/// Fill the batch with the next samples. Returns their number.
size_t gather(PointBatch &batch, SampleCursor &cursor)
{
    size_t n = 0;
    Sample sample;
    while (n < kBatchSize && next_sample(cursor, sample)) {
        batch.points[n++] = {sample.place_m.x(), sample.place_m.y()};
    }
    return n;
}

gpom_status_t status_of(const gpom_path_result_t &result)
{
    if ((result.flags & GPOM_PATH_PIVOT) != 0) {
        return GPOM_ERR_PIVOT;
    }
    if ((result.flags & GPOM_PATH_OUT_OF_REACH) != 0) {
        return GPOM_ERR_REACH;
    }
    return (result.flags & GPOM_PATH_CUT) != 0 ? GPOM_ERR_CUT : GPOM_OK;
}

} // namespace
} // namespace gpom

gpom_status_t gpom_path_query(const gpom_map_t *map, const gpom_path_t *path,
                              gpom_path_result_t *result, const gpom_scratch_t *scratch)
{
    if (!gpom::is_map(map) || path == nullptr || result == nullptr || scratch == nullptr) {
        return GPOM_ERR_ARG;
    }
    if (!gpom::is_path(*path)) {
        return GPOM_ERR_ARG;
    }
    if (scratch->mem == nullptr || scratch->mem_bytes < gpom_scratch_bytes(map)) {
        return GPOM_ERR_MEM;
    }
    gpom::PointBatch &batch = *gpom::carve_batch(scratch->mem);
    gpom::SampleCursor ahead = gpom::samples_along(*path);
    gpom::SampleCursor behind = ahead; // generates the samples again when their answers are known
    *result = gpom_path_result_t{};
    result->probability = -1.0f;
    size_t n = gpom::gather(batch, ahead);
    while (n > 0 && (result->flags & GPOM_PATH_STOPPED) == 0) {
        const gpom_status_t status =
            gpom_query_points(map, batch.points, n, batch.answers, scratch);
        if (status == GPOM_ERR_ARG || status == GPOM_ERR_MEM) {
            return status;
        }
        gpom::regard(batch, n, behind, *result);
        n = gpom::gather(batch, ahead);
    }
    return gpom::status_of(*result);
}
