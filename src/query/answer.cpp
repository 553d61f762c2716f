/// \file answer.cpp
/// The hot path of queries for one lane width. A library that chooses the instruction set at run
/// time contains this file several times. Each time it is compiled for another instruction set and
/// in another namespace, whose name the build gives (-Dgpom=...). The namespaces stop the linker
/// from mixing functions of different instruction sets.
#include "src/query/hot_path.hpp"

#include "src/query/packet.hpp"
#include "src/query/sparse_lanes.hpp"

namespace gpom
{
namespace
{

/// Where answers go. distances: NULL, or as many as answers.
struct AnswerArrays {
    gpom_answer_t *answers;
    gpom_distances *distances;
};

void put_distances(const Workspace &work, gpom_distances *distances)
{
    const Packet &packet = *work.packet;
    const F hit_m = lane::sqrt(work.hits.best[0].d2);
    const F last_hit_m = lane::sqrt(work.hits.best[work.points.n_hits - 1].d2);
    const F free_m = lane::sqrt(work.free.best[0].d2);
    for (int i = 0; i < packet.n; ++i) {
        distances[packet.i_answer[i]] = {lane::get(hit_m, i), lane::get(last_hit_m, i),
                                         lane::get(free_m, i)};
    }
}

/// Answer a packet whose neighbours were found. Returns the bitwise or of the flags of the answers.
template <gpom_kernel_t K>
unsigned answer_found(const gpom_map &map, Workspace &work, const AnswerArrays &out)
{
    const Packet &packet = *work.packet;
    const gpom_params_t &params = map.config.params;
    Evidence<F> evidence = {};
    evidence.offset = prepare_neighbours(map, work);
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
        out.answers[packet.i_answer[i]] = answer;
        flags |= answer.flags;
    }
    if (out.distances != nullptr) {
        put_distances(work, out.distances);
    }
    return flags;
}

AnswerFound<AnswerArrays> answer_found_for(int32_t kernel)
{
    switch (kernel) {
    case GPOM_KERNEL_NN:
        return answer_found<GPOM_KERNEL_NN>;
    case GPOM_KERNEL_MATERN12:
        return answer_found<GPOM_KERNEL_MATERN12>;
    case GPOM_KERNEL_MATERN32:
        return answer_found<GPOM_KERNEL_MATERN32>;
    case GPOM_KERNEL_SE:
        return answer_found<GPOM_KERNEL_SE>;
    default:
        return answer_found<GPOM_KERNEL_ASKEY>;
    }
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

unsigned probe_points(const gpom_map &map, const gpom_point_list &points, gpom_answer_t *answers,
                      gpom_distances *distances, void *scratch)
{
    Workspace work = carve_workspace(map, scratch);
    const AnswerArrays out = {answers, distances};
    return answer_list(map, work, points, answer_found_for(map.config.params.kernel), out);
}

unsigned answer_points(const gpom_map &map, const gpom_point_list &points, gpom_answer_t *answers,
                       void *scratch)
{
    return probe_points(map, points, answers, nullptr, scratch);
}

/// Answer a raster block by block. Every second row of blocks goes backwards, so that each block is
/// next to the block before it.
unsigned answer_raster(const gpom_map &map, const gpom_raster_t &raster, gpom_answer_t *answers,
                       void *scratch)
{
    Workspace work = carve_workspace(map, scratch);
    const AnswerFound<AnswerArrays> found = answer_found_for(map.config.params.kernel);
    const AnswerArrays out = {answers, nullptr};
    const uint32_t last_ix = (raster.nx - 1) / kBlockX * kBlockX;
    unsigned flags = 0;
    for (uint32_t iy = 0; iy < raster.ny; iy += kBlockY) {
        const bool is_backward = iy / kBlockY % 2 != 0;
        for (uint32_t i = 0; i < raster.nx; i += kBlockX) {
            clear(*work.packet);
            add_block(*work.packet, map, raster, is_backward ? last_ix - i : i, iy);
            flags |= answer_packet(map, work, found, out);
        }
    }
    lane::clear_upper_parts();
    return flags;
}

} // namespace

gpom_hot_path hot_path_here()
{
    return {static_cast<uint32_t>(kLanes), scratch_bytes_for, answer_points, probe_points,
            answer_raster};
}

} // namespace gpom
