#include "src/align/lines.hpp"

#include "src/map/map.hpp"

namespace gpom
{

namespace
{

/// A hit was seen from the other side if its beam runs against the beam of the return: if the
/// cosine between them is below this.
constexpr float kSameSide = -0.3f;

/// Hits farther from the return than the nearest one by more than this do not count [m].
constexpr float kLineReach_m = 0.25f;

/// The hits form a line if their variance across it is at most this part of that along it.
constexpr float kLineRatio = 0.15f;

/// A hit that a return is compared with: the place where its beam ended.
struct FacedHit : HitPart {
    float dir_x, dir_y; ///< Of the beam of the return.

    static bool is_seen(const Beam &beam) { return beam.hit == kStanding; }
};

/// The squared distance of a hit. A hit that was seen from the other side is beyond any reach.
/// search_tree() finds this function by its arguments.
inline float distance2(const Offset<float> &at, const FacedHit &part, const Beam &beam)
{
    if (beam.dir_x * part.dir_x + beam.dir_y * part.dir_y < kSameSide) {
        return 2.0f * kNoDistance2;
    }
    const Point hit = end_of(beam);
    return Offset<float>{hit.x_m - at.x_m, hit.y_m - at.y_m}.distance2();
}

/// The number of hits found within a squared distance.
uint32_t search_within(const gpom_map &map, const Placed &placed, float reach2_m2,
                       LineSearch &memory)
{
    NearestK<float> nearest = {memory.found, kLineHits, 0};
    nearest.clear(reach2_m2);
    const FacedHit part = {{0.0f}, placed.direction.x(), placed.direction.y()};
    const Offset<float> at = {placed.at_m.x(), placed.at_m.y()};
    (void)search(nearest, at, map.index, part,
                 from_root(map.index.hit_tree, memory.stack, map.config.walk_max));
    ++memory.n_searches;
    uint32_t n = 0;
    while (n < kLineHits && memory.found[n].slot >= 0) {
        ++n;
    }
    return n;
}

Eigen::Vector2f hit_of(const gpom_map &map, const Found<float> &found)
{
    const Point hit = end_of(map.index.beams[found.slot]);
    return {hit.x_m, hit.y_m};
}

/// Lay the line through the first n hits: their main axis.
void fit_line(const gpom_map &map, const LineSearch &memory, uint32_t n, Line &line)
{
    Eigen::Vector2f sum(0.0f, 0.0f); // from the first hit, where float is fine
    const Eigen::Vector2f first_m = hit_of(map, memory.found[0]);
    for (uint32_t i = 1; i < n; ++i) {
        sum += hit_of(map, memory.found[i]) - first_m;
    }
    const Eigen::Vector2f mean_m = sum / static_cast<float>(n);
    float xx = 0.0f;
    float xy = 0.0f;
    float yy = 0.0f;
    for (uint32_t i = 0; i < n; ++i) {
        const Eigen::Vector2f d = hit_of(map, memory.found[i]) - first_m - mean_m;
        xx += d.x() * d.x();
        xy += d.x() * d.y();
        yy += d.y() * d.y();
    }
    const float spread = lane::sqrt((xx - yy) * (xx - yy) + 4.0f * xy * xy);
    const Eigen::Vector2f axis = xx >= yy ? Eigen::Vector2f(xx - yy + spread, 2.0f * xy)
                                          : Eigen::Vector2f(2.0f * xy, yy - xx + spread);
    const float length = lane::sqrt(axis.squaredNorm());
    line.middle_m = first_m + mean_m;
    const bool is_line = length > 0.0f && xx + yy - spread <= kLineRatio * (xx + yy + spread);
    line.shape = is_line ? Shape::kLine : Shape::kSpot;
    line.normal = is_line ? Eigen::Vector2f(-axis.y() / length, axis.x() / length)
                          : Eigen::Vector2f(0.0f, 0.0f);
}

} // namespace

void find_line(const gpom_map &map, const Placed &placed, float reach_m, LineSearch &memory,
               Line &line)
{
    const float whole2_m2 = reach_m * reach_m;
    const Eigen::Vector2f moved_m = placed.at_m - line.searched_m;
    const float bound2_m2 =
        line.n_hits == kLineHits
            ? reach2_after(line.found2_m2, Offset<float>{moved_m.x(), moved_m.y()})
            : whole2_m2;
    uint32_t n = search_within(map, placed, lane::min(bound2_m2, whole2_m2), memory);
    if (n < kLineHits && bound2_m2 < whole2_m2) { // the return turned, so that other hits count
        n = search_within(map, placed, whole2_m2, memory);
    }
    line.searched_m = placed.at_m;
    line.n_hits = static_cast<uint8_t>(n);
    line.found2_m2 = n > 0 ? memory.found[n - 1].d2 : 0.0f;
    line.shape = Shape::kNone;
    if (n < 2) {
        return;
    }
    const float far_m = lane::sqrt(memory.found[0].d2) + kLineReach_m;
    while (n > 2 && memory.found[n - 1].d2 > far_m * far_m) {
        --n;
    }
    fit_line(map, memory, n, line);
}

} // namespace gpom
