/// \file answer.cpp
/// The hot path of queries for one lane width. A library that chooses the instruction set at run
/// time contains this file several times. Each time it is compiled for another instruction set and
/// in another namespace, whose name the build gives (-Dgpom=...). The namespaces stop the linker
/// from mixing functions of different instruction sets.
#include "src/query/hot_path.hpp"

#include "src/gp/classify.hpp"
#include "src/query/list_order.hpp"
#include "src/query/neighbours.hpp"
#include "src/query/sparse_lanes.hpp"

namespace gpom
{
namespace
{

gpom_answer_t prior_answer(const gpom_map &map, unsigned flag)
{
    gpom_answer_t answer = {};
    answer.variance = map.prior_variance;
    answer.probability = map.prior_probability;
    answer.cls = static_cast<uint8_t>(class_of(map.config.params, answer.probability));
    answer.flags = static_cast<uint8_t>(flag);
    return answer;
}

/// The answers of a packet, before they are written lane by lane.
struct Answers {
    Moments<F> moments;
    F probability, n_hits, n_free;
    bool is_cut;
};

/// A count in one byte. 255 means 255 or more.
uint8_t count_in_byte(float n) { return static_cast<uint8_t>(lane::min(n, 255.0f)); }

gpom_answer_t answer_of(const gpom_map &map, const Packet &packet, const Answers &answers, int i)
{
    if (lane::get(packet.out_of_reach, i) != 0) {
        return prior_answer(map, GPOM_ANSWER_OUT_OF_REACH);
    }
    gpom_answer_t answer = {};
    answer.mean = lane::get(answers.moments.mean, i);
    answer.variance = lane::get(answers.moments.variance, i);
    answer.probability = lane::get(answers.probability, i);
    if (lane::get(answers.moments.bad, i) > 0.0f) {
        answer.probability = map.prior_probability;
        answer.flags = GPOM_ANSWER_PIVOT;
    }
    if (answers.is_cut) {
        answer.flags = static_cast<uint8_t>(answer.flags | GPOM_ANSWER_CUT);
    }
    answer.cls = static_cast<uint8_t>(class_of(map.config.params, answer.probability));
    answer.n_hits = count_in_byte(lane::get(answers.n_hits, i));
    answer.n_free = count_in_byte(lane::get(answers.n_free, i));
    return answer;
}

/// Answer a packet. Its neighbourhoods were found before; `offset` is what find_neighbours()
/// returned. Returns the bitwise or of the flags of the answers.
template <gpom_kernel_t K>
unsigned answer_prepared(const gpom_map &map, Workspace &work, F offset, gpom_answer_t *answers)
{
    const Packet &packet = *work.packet;
    const gpom_params_t &params = map.config.params;
    Evidence<F> evidence = {};
    evidence.offset = offset;
    evidence.moments = moments_of<K>(map, work);
    if (params.fade_m > 0.0f) {
        const F nearest2_m2 = lane::min(work.hits.best[0].d2, work.free.best[0].d2);
        evidence = faded(params, map.prior_variance, nearest2_m2, evidence);
    }
    Answers lanes = {};
    lanes.moments = evidence.moments;
    lanes.probability = squash(params, lanes.moments.mean, lanes.moments.variance, evidence.offset);
    lanes.n_hits = count_found(work.hits, work.points.n_hits);
    lanes.n_free = count_found(work.free, work.points.n_free);
    lanes.is_cut = work.is_cut;
    unsigned flags = 0;
    for (int i = 0; i < packet.n; ++i) {
        const gpom_answer_t answer = answer_of(map, packet, lanes, i);
        answers[packet.i_answer[i]] = answer;
        flags |= answer.flags;
    }
    return flags;
}

/// Make a packet that holds one query of another packet in all lanes.
void take_one(Packet &packet, const Packet &from, int i)
{
    packet.at = {lane::splat<F>(lane::get(from.at.x_m, i)),
                 lane::splat<F>(lane::get(from.at.y_m, i))};
    packet.out_of_reach = lane::splat_int<I>(lane::get(from.out_of_reach, i));
    packet.i_answer[0] = from.i_answer[i];
    packet.n = 1;
}

/// Answer one packet. Returns the bitwise or of the flags of the answers.
///
/// If the walks down a tree are too few for the packet, each query is searched alone, with the same
/// number of walks. So a cut answer does not depend on the other queries of the packet.
template <gpom_kernel_t K>
unsigned answer_packet(const gpom_map &map, Workspace &work, gpom_answer_t *answers)
{
    const F offset = find_neighbours(map, work);
    if (!work.is_cut || work.packet->n == 1) {
        return answer_prepared<K>(map, work, offset, answers);
    }
    *work.cut = *work.packet;
    unsigned flags = 0;
    for (int i = 0; i < work.cut->n; ++i) {
        take_one(*work.packet, *work.cut, i);
        work.has_searched = false; // no earlier result is used, as for a query that is asked alone
        const F own_offset = find_neighbours(map, work);
        flags |= answer_prepared<K>(map, work, own_offset, answers);
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
    packet.at = {lane::splat<F>(0.0f), lane::splat<F>(0.0f)};
    packet.out_of_reach = lane::splat_int<I>(0);
    packet.n = 0;
}

/// Add a query. The first query also fills the other lanes, because some may stay unused.
void add(Packet &packet, const gpom_map &map, const gpom_point_t &point, size_t i_answer)
{
    const double dx_m = point.x_m - map.config.origin_x_m;
    const double dy_m = point.y_m - map.config.origin_y_m;
    const bool in_reach = dx_m * dx_m + dy_m * dy_m <= GPOM_REACH_M * GPOM_REACH_M;
    const float x_m = in_reach ? static_cast<float>(dx_m) : 0.0f;
    const float y_m = in_reach ? static_cast<float>(dy_m) : 0.0f;
    if (packet.n == 0) {
        packet.at = {lane::splat<F>(x_m), lane::splat<F>(y_m)};
    }
    lane::set(packet.at.x_m, packet.n, x_m);
    lane::set(packet.at.y_m, packet.n, y_m);
    lane::set(packet.out_of_reach, packet.n, static_cast<int32_t>(in_reach ? 0 : 1));
    packet.i_answer[packet.n++] = i_answer;
}

/// A packet covers a block of kBlockX x kBlockY cells of a raster. Cells of a block are near each
/// other, so that they share their search.
constexpr uint32_t kBlockY = kLanes >= 16 ? 4 : kLanes >= 4 ? 2 : 1;
constexpr uint32_t kBlockX = static_cast<uint32_t>(kLanes) / kBlockY;

/// Add the block of cells whose lower left cell is (ix0, iy0), without cells outside the raster.
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

size_t scratch_bytes_for(const gpom_map &map) { return scratch_bytes(scratch_need(map)); }

unsigned answer_points(const gpom_map &map, const gpom_point_list &points, gpom_answer_t *answers,
                       void *scratch)
{
    Workspace work = carve_workspace(map, scratch);
    const AnswerPacket answer_packet = answer_packet_for(map.config.params.kernel);
    unsigned flags = 0;
    for (size_t first = 0; first < points.n; first += kListBlock) {
        const size_t n_left = points.n - first;
        const ListBlock block = {points.points + first, n_left < kListBlock ? n_left : kListBlock};
        const bool is_ordered = kLanes > 1 && block.n > static_cast<size_t>(kLanes);
        if (is_ordered) {
            order_along_curve(*work.order, block);
        }
        for (size_t i = 0; i < block.n;) {
            clear(*work.packet);
            for (; i < block.n && work.packet->n < kLanes; ++i) {
                const size_t place = is_ordered ? work.order->places[i] : i;
                add(*work.packet, map, block.points[place], first + place);
            }
            flags |= answer_packet(map, work, answers);
        }
    }
    lane::clear_upper_parts();
    return flags;
}

/// Answer a raster block by block. Every second row of blocks goes backwards, so that each block is
/// next to the block before it.
unsigned answer_raster(const gpom_map &map, const gpom_raster_t &raster, gpom_answer_t *answers,
                       void *scratch)
{
    Workspace work = carve_workspace(map, scratch);
    const AnswerPacket answer_packet = answer_packet_for(map.config.params.kernel);
    const uint32_t last_ix = (raster.nx - 1) / kBlockX * kBlockX;
    unsigned flags = 0;
    for (uint32_t iy = 0; iy < raster.ny; iy += kBlockY) {
        const bool is_backward = iy / kBlockY % 2 != 0;
        for (uint32_t i = 0; i < raster.nx; i += kBlockX) {
            clear(*work.packet);
            add_block(*work.packet, map, raster, is_backward ? last_ix - i : i, iy);
            flags |= answer_packet(map, work, answers);
        }
    }
    lane::clear_upper_parts();
    return flags;
}

} // namespace

gpom_hot_path hot_path_here()
{
    return {static_cast<uint32_t>(kLanes), scratch_bytes_for, answer_points, answer_raster};
}

} // namespace gpom
