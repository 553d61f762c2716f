#include "gpom/query.h"

#include "src/classify.hpp"
#include "src/local_gp.hpp"
#include "src/map.hpp"
#include "src/nearest.hpp"

#include <float.h>

namespace gpom
{
namespace
{

constexpr int kLanes = GPOM_LANES;
using F = lane::Lane<kLanes>::F;
using I = lane::Lane<kLanes>::I;
static_assert(kLanes <= static_cast<int>(GPOM_LANES_MAX),
              "more lanes than GPOM_SCRATCH_BYTES knows");

/// Up to kLanes queries computed together. Unused lanes repeat the first query.
struct Packet {
    F x_m, y_m;              ///< Relative to the map's origin.
    I out_of_reach;          ///< 1: the point was refused; its lane computes the origin instead.
    size_t i_answer[kLanes]; ///< Where the answers go.
    int n;                   ///< Queries in the packet.
};

/// Everything one call works with, carved from the caller's scratch.
struct Workspace {
    Packet *packet;
    Subtree *stack;
    NearestK<F> hits, free;
    Neighbourhood<F> points;
    GpWork<F> gp;
};

/// Byte offsets in the scratch; lanes first, as they are the most strictly aligned.
struct ScratchLayout {
    size_t nearest, points, features, vectors, factor, packet, stack, total;
};

constexpr ScratchLayout scratch_layout(size_t n)
{
    const size_t nearest = 0; // d2, id and slot
    const size_t points = nearest + 3 * n * sizeof(F);
    const size_t features = points + 3 * n * sizeof(F);
    const size_t vectors = features + n * sizeof(Feature<F>); // u, v and 1 / diagonal
    const size_t factor = vectors + 3 * n * sizeof(F);
    const size_t packet = factor + tri(n) * sizeof(F);
    const size_t stack = packet + align8(sizeof(Packet));
    const size_t total = stack + kDepthMax * sizeof(Subtree);
    return {nearest, points, features, vectors, factor, packet, stack, total};
}

/// What the start of the scratch may lose to alignment.
constexpr size_t kScratchSlack = sizeof(F) - 1;

constexpr size_t scratch_bytes(size_t n) { return scratch_layout(n).total + kScratchSlack; }

static_assert(scratch_bytes(2) <= GPOM_SCRATCH_BYTES(2, kLanes), "public macro too small");
static_assert(scratch_bytes(16) <= GPOM_SCRATCH_BYTES(16, kLanes), "public macro too small");
static_assert(scratch_bytes(GPOM_POINTS_MAX) <= GPOM_SCRATCH_BYTES(GPOM_POINTS_MAX, kLanes),
              "public macro too small");

size_t neighbour_count(const gpom_map &map)
{
    return static_cast<size_t>(map.config.params.n_hits) + map.config.params.n_free;
}

NearestK<F> carve_nearest(void *mem, size_t n, size_t first, uint32_t k)
{
    return {carve<F>(mem, 0) + first, carve<I>(mem, n * sizeof(F)) + first,
            carve<I>(mem, 2 * n * sizeof(F)) + first, k};
}

Workspace carve_workspace(const gpom_map &map, void *scratch)
{
    const size_t n = neighbour_count(map);
    const uint32_t n_hits = map.config.params.n_hits;
    const ScratchLayout layout = scratch_layout(n);
    void *const mem =
        reinterpret_cast<void *>(align_up(reinterpret_cast<uintptr_t>(scratch), sizeof(F)));
    F *const xyn = carve<F>(mem, layout.points);
    F *const uvd = carve<F>(mem, layout.vectors);
    Workspace work = {};
    work.packet = carve<Packet>(mem, layout.packet);
    work.stack = carve<Subtree>(mem, layout.stack);
    work.hits = carve_nearest(mem, n, 0, n_hits);
    work.free = carve_nearest(mem, n, n_hits, map.config.params.n_free);
    work.points = {xyn, xyn + n, xyn + 2 * n, n_hits, map.config.params.n_free};
    work.gp = {carve<Feature<F>>(mem, layout.features),
               uvd,
               uvd + n,
               {carve<F>(mem, layout.factor), uvd + 2 * n, F{}}};
    return work;
}

/// Look at the beams that are not in the trees yet, one by one.
void search_recent(const gpom_map &map, Workspace &work, const Offset<F> &at)
{
    for (uint32_t slot = map.n_indexed; slot < map.n_beams; ++slot) {
        offer_beam(work.free, at, map.free_part, map.beams, slot);
        if (map.beams[slot].is_hit != 0) {
            offer_beam(work.hits, at, map.hit_part, map.beams, slot);
        }
    }
}

/// Where the neighbours that gather() brings go, and what kind they are.
struct GatherTo {
    size_t first; ///< Place of the nearest in the neighbourhood.
    float sn2;    ///< Noise variance of a known one.
};

/// Bring what a search found into the neighbourhood: each lane's own beams, as points relative to
/// its query, with their noise; a neighbour that was not found is absent.
template <class Part>
void gather(const gpom_map &map, Workspace &work, const NearestK<F> &nearest, const Part &part,
            const GatherTo &to)
{
    const F zero = lane::splat<F>(0.0f);
    const Offset<F> at = {work.packet->x_m, work.packet->y_m};
    for (uint32_t j = 0; j < nearest.k; ++j) {
        SegmentLanes<F> lanes = {at.x_m, at.y_m, zero, zero, zero};
        F excess = zero;
        for (int i = 0; i < kLanes; ++i) {
            const int32_t slot = lane::get(nearest.slot[j], i);
            if (slot >= 0) {
                set_segment(lanes, i, part(map.beams[slot]));
                lane::set(excess, i, map.beams[slot].excess);
            }
        }
        const Offset<F> point = to_segment(at, lanes);
        const F own_noise = noise_of(to.sn2, map.prior_variance, excess);
        work.points.x_m[to.first + j] = point.x_m;
        work.points.y_m[to.first + j] = point.y_m;
        work.points.noise[to.first + j] =
            lane::select(nearest.slot[j] >= 0, own_noise, lane::splat<F>(kAbsentNoise));
    }
}

void find_neighbours(const gpom_map &map, Workspace &work)
{
    const Offset<F> at = {work.packet->x_m, work.packet->y_m};
    work.hits.clear();
    work.free.clear();
    search_tree(work.hits, at, map.hit_part, map.hit_tree, work.stack);
    search_tree(work.free, at, map.free_part, map.free_tree, work.stack);
    search_recent(map, work, at);
    gather(map, work, work.hits, map.hit_part, {0, map.config.params.sn2});
    gather(map, work, work.free, map.free_part, {work.hits.k, map.config.params.sn2_free});
    const Neighbourhood<F> &p = work.points;
    merge_equal(p.x_m, p.y_m, p.noise, p.n_hits);
    merge_equal(p.x_m + p.n_hits, p.y_m + p.n_hits, p.noise + p.n_hits, p.n_free);
}

uint8_t count_found(const NearestK<F> &nearest, int i_lane)
{
    uint8_t n = 0;
    for (uint32_t j = 0; j < nearest.k; ++j) {
        n = static_cast<uint8_t>(n + (lane::get(nearest.slot[j], i_lane) >= 0 ? 1 : 0));
    }
    return n;
}

gpom_answer_t prior_answer(const gpom_map &map, unsigned flag)
{
    gpom_answer_t answer = {};
    answer.variance = map.prior_variance;
    answer.probability = map.prior_probability;
    answer.cls = static_cast<uint8_t>(class_of(map.config.params, answer.probability));
    answer.flags = static_cast<uint8_t>(flag);
    return answer;
}

gpom_answer_t answer_of(const gpom_map &map, const Workspace &work, const Moments<F> &moments,
                        int i)
{
    if (lane::get(work.packet->out_of_reach, i) != 0) {
        return prior_answer(map, GPOM_ANSWER_OUT_OF_REACH);
    }
    const F probability = squash(map.config.params, moments.mean, moments.variance);
    gpom_answer_t answer = {};
    answer.mean = lane::get(moments.mean, i);
    answer.variance = lane::get(moments.variance, i);
    answer.probability = lane::get(probability, i);
    answer.cls = static_cast<uint8_t>(class_of(map.config.params, answer.probability));
    answer.flags = lane::get(moments.bad, i) > 0.0f ? GPOM_ANSWER_PIVOT : 0;
    answer.n_hits = count_found(work.hits, i);
    answer.n_free = count_found(work.free, i);
    return answer;
}

/// Answer one packet. Returns the flags of its answers, or-ed.
template <gpom_kernel_t K>
unsigned answer_packet(const gpom_map &map, Workspace &work, gpom_answer_t *answers)
{
    find_neighbours(map, work);
    const bool in_map_frame = map.config.params.frame == GPOM_FRAME_MAP;
    const F zero = lane::splat<F>(0.0f);
    const Moments<F> moments =
        predict<K>(map.kernel, work.points, work.gp, in_map_frame ? work.packet->x_m : zero,
                   in_map_frame ? work.packet->y_m : zero);
    unsigned flags = 0;
    for (int i = 0; i < work.packet->n; ++i) {
        const gpom_answer_t answer = answer_of(map, work, moments, i);
        answers[work.packet->i_answer[i]] = answer;
        flags |= answer.flags;
    }
    return flags;
}

using AnswerPacket = unsigned (*)(const gpom_map &, Workspace &, gpom_answer_t *);

AnswerPacket answer_packet_for(int32_t kernel)
{
    switch (kernel) {
    case GPOM_KERNEL_NN:
        return answer_packet<GPOM_KERNEL_NN>;
    case GPOM_KERNEL_MATERN12:
        return answer_packet<GPOM_KERNEL_MATERN12>;
    case GPOM_KERNEL_MATERN32:
        return answer_packet<GPOM_KERNEL_MATERN32>;
    case GPOM_KERNEL_SE:
        return answer_packet<GPOM_KERNEL_SE>;
    default:
        return answer_packet<GPOM_KERNEL_ASKEY>;
    }
}

void clear(Packet &packet)
{
    packet.x_m = lane::splat<F>(0.0f);
    packet.y_m = lane::splat<F>(0.0f);
    packet.out_of_reach = lane::splat_int<I>(0);
    packet.n = 0;
}

/// Add a query; the first also fills the lanes that may stay unused.
void add(Packet &packet, const gpom_map &map, const gpom_point_t &point, size_t i_answer)
{
    const double dx_m = point.x_m - map.config.origin_x_m;
    const double dy_m = point.y_m - map.config.origin_y_m;
    const bool in_reach = dx_m * dx_m + dy_m * dy_m <= GPOM_REACH_M * GPOM_REACH_M;
    const float x_m = in_reach ? static_cast<float>(dx_m) : 0.0f;
    const float y_m = in_reach ? static_cast<float>(dy_m) : 0.0f;
    if (packet.n == 0) {
        packet.x_m = lane::splat<F>(x_m);
        packet.y_m = lane::splat<F>(y_m);
    }
    lane::set(packet.x_m, packet.n, x_m);
    lane::set(packet.y_m, packet.n, y_m);
    lane::set(packet.out_of_reach, packet.n, static_cast<int32_t>(in_reach ? 0 : 1));
    packet.i_answer[packet.n++] = i_answer;
}

gpom_status_t status_of(unsigned flags)
{
    if ((flags & GPOM_ANSWER_PIVOT) != 0) {
        return GPOM_ERR_PIVOT;
    }
    return (flags & GPOM_ANSWER_OUT_OF_REACH) != 0 ? GPOM_ERR_REACH : GPOM_OK;
}

gpom_status_t check_scratch(const gpom_map &map, const gpom_scratch_t &scratch)
{
    const size_t needed = scratch_bytes(neighbour_count(map));
    return scratch.mem == nullptr || scratch.mem_bytes < needed ? GPOM_ERR_MEM : GPOM_OK;
}

bool is_raster(const gpom_raster_t &raster)
{
    return raster.cell_m > 0.0 && raster.cell_m <= DBL_MAX && raster.nx <= GPOM_RASTER_SIDE_MAX &&
           raster.ny <= GPOM_RASTER_SIDE_MAX;
}

/// Cells of a raster that one packet covers: near each other, so that they share their search.
constexpr uint32_t kBlockY = kLanes >= 16 ? 4 : kLanes >= 4 ? 2 : 1;
constexpr uint32_t kBlockX = static_cast<uint32_t>(kLanes) / kBlockY;

/// The block of cells whose lower left one is (ix0, iy0), clipped to the raster.
void add_block(Packet &packet, const gpom_map &map, const gpom_raster_t &raster, uint32_t ix0,
               uint32_t iy0)
{
    for (uint32_t iy = iy0; iy < raster.ny && iy - iy0 < kBlockY; ++iy) {
        for (uint32_t ix = ix0; ix < raster.nx && ix - ix0 < kBlockX; ++ix) {
            const gpom_point_t centre = {raster.x0_m + (ix + 0.5) * raster.cell_m,
                                         raster.y0_m + (iy + 0.5) * raster.cell_m};
            add(packet, map, centre, static_cast<size_t>(iy) * raster.nx + ix);
        }
    }
}

} // namespace
} // namespace gpom

uint32_t gpom_lanes(void) { return static_cast<uint32_t>(gpom::kLanes); }

size_t gpom_scratch_bytes(const gpom_map_t *map)
{
    return gpom::is_map(map) ? gpom::scratch_bytes(gpom::neighbour_count(*map)) : 0;
}

gpom_status_t gpom_query_points(const gpom_map_t *map, const gpom_point_t *points, size_t n_points,
                                gpom_answer_t *answers, const gpom_scratch_t *scratch)
{
    if (!gpom::is_map(map) || scratch == nullptr) {
        return GPOM_ERR_ARG;
    }
    if (n_points > 0 && (points == nullptr || answers == nullptr)) {
        return GPOM_ERR_ARG;
    }
    const gpom_status_t status = gpom::check_scratch(*map, *scratch);
    if (status != GPOM_OK) {
        return status;
    }
    gpom::Workspace work = gpom::carve_workspace(*map, scratch->mem);
    const gpom::AnswerPacket answer_packet = gpom::answer_packet_for(map->config.params.kernel);
    unsigned flags = 0;
    for (size_t i = 0; i < n_points;) {
        gpom::clear(*work.packet);
        while (i < n_points && work.packet->n < gpom::kLanes) {
            gpom::add(*work.packet, *map, points[i], i);
            ++i;
        }
        flags |= answer_packet(*map, work, answers);
    }
    return gpom::status_of(flags);
}

gpom_status_t gpom_query_raster(const gpom_map_t *map, const gpom_raster_t *raster,
                                gpom_answer_t *answers, const gpom_scratch_t *scratch)
{
    if (!gpom::is_map(map) || raster == nullptr || scratch == nullptr) {
        return GPOM_ERR_ARG;
    }
    if (answers == nullptr || !gpom::is_raster(*raster)) {
        return GPOM_ERR_ARG;
    }
    const gpom_status_t status = gpom::check_scratch(*map, *scratch);
    if (status != GPOM_OK) {
        return status;
    }
    gpom::Workspace work = gpom::carve_workspace(*map, scratch->mem);
    const gpom::AnswerPacket answer_packet = gpom::answer_packet_for(map->config.params.kernel);
    unsigned flags = 0;
    for (uint32_t iy = 0; iy < raster->ny; iy += gpom::kBlockY) {
        for (uint32_t ix = 0; ix < raster->nx; ix += gpom::kBlockX) {
            gpom::clear(*work.packet);
            gpom::add_block(*work.packet, *map, *raster, ix, iy);
            flags |= answer_packet(*map, work, answers);
        }
    }
    return gpom::status_of(flags);
}
