#include "gpom/query.h"

#include "src/map/map.hpp"
#include "src/query/hot_path.hpp"
#include "src/query/status.hpp"

#include <float.h>

#if GPOM_DISPATCH
namespace gpom_avx2
{
gpom_hot_path hot_path_here();
}
namespace gpom_avx512
{
gpom_hot_path hot_path_here();
}
#endif

namespace gpom
{

/// The hot path with the widest lanes that the processor supports. The processor is asked each
/// time, because the library keeps no state.
gpom_hot_path hot_path()
{
#if GPOM_DISPATCH
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq")) {
        return gpom_avx512::hot_path_here();
    }
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
        return gpom_avx2::hot_path_here();
    }
#endif
    return hot_path_here();
}

gpom_status_t check_scratch(const gpom_map &map, const gpom_scratch_t &scratch)
{
    const size_t needed = hot_path().scratch_bytes(map);
    return scratch.mem == nullptr || scratch.mem_bytes < needed ? GPOM_ERR_MEM : GPOM_OK;
}

namespace
{

bool is_raster(const gpom_raster_t &raster)
{
    return raster.cell_m > 0.0 && raster.cell_m <= DBL_MAX && raster.nx <= GPOM_RASTER_SIDE_MAX &&
           raster.ny <= GPOM_RASTER_SIDE_MAX;
}

} // namespace
} // namespace gpom

uint32_t gpom_lanes(void) { return gpom::hot_path().lanes; }

size_t gpom_scratch_bytes(const gpom_map_t *map)
{
    return gpom::is_map(map) ? gpom::hot_path().scratch_bytes(*map) : 0;
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
    return gpom::status_of(
        gpom::hot_path().answer_points(*map, {points, n_points}, answers, scratch->mem));
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
    return gpom::status_of(gpom::hot_path().answer_raster(*map, *raster, answers, scratch->mem));
}
