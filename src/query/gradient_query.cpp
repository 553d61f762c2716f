#include "gpom/gradient.h"

#include "src/map/map.hpp"
#include "src/query/gradient_path.hpp"
#include "src/query/status.hpp"

#if GPOM_DISPATCH
namespace gpom_avx2
{
gpom_gradient_path gradient_path_here();
}
namespace gpom_avx512
{
gpom_gradient_path gradient_path_here();
}
#endif

namespace gpom
{
namespace
{

/// The code with the same lanes as the hot path of queries.
gpom_gradient_path gradient_path()
{
#if GPOM_DISPATCH
    const uint32_t lanes = hot_path().lanes;
    if (lanes == 16) {
        return gpom_avx512::gradient_path_here();
    }
    if (lanes == 8) {
        return gpom_avx2::gradient_path_here();
    }
#endif
    return gradient_path_here();
}

} // namespace
} // namespace gpom

size_t gpom_gradient_bytes(const gpom_map_t *map)
{
    return gpom::is_map(map) ? gpom::gradient_path().scratch_bytes(*map) : 0;
}

gpom_status_t gpom_query_gradients(const gpom_map_t *map, const gpom_point_t *points,
                                   size_t n_points, gpom_gradient_t *gradients,
                                   const gpom_scratch_t *scratch)
{
    if (!gpom::is_map(map) || scratch == nullptr) {
        return GPOM_ERR_ARG;
    }
    if (n_points > 0 && (points == nullptr || gradients == nullptr)) {
        return GPOM_ERR_ARG;
    }
    const gpom_gradient_path path = gpom::gradient_path();
    const size_t needed = path.scratch_bytes(*map);
    if (needed == 0) {
        return GPOM_ERR_PARAMS;
    }
    if (scratch->mem == nullptr || scratch->mem_bytes < needed) {
        return GPOM_ERR_MEM;
    }
    return gpom::status_of(path.gradients(*map, {points, n_points}, gradients, scratch->mem));
}
