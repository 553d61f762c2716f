// The library's map with memory from the heap, for host programs.
#ifndef GPOM_TOOLS_LIB_HOST_MAP_HPP
#define GPOM_TOOLS_LIB_HOST_MAP_HPP

#include "gpom/gpom.h"
#include "tools/lib/scan_log.hpp"

#include <cstddef>
#include <memory>
#include <vector>

namespace gpom_tools
{

/// Owns the arena and the scratch of one map. Every failure throws std::runtime_error.
class HostMap {
public:
    HostMap(const gpom_params_t &params, std::size_t beam_max, gpom_point_t origin);

    /// Insert one scan; its pose is the laser's, exactly known.
    void insert(const Scan &scan);
    /// Insert all scans and index them.
    void insert(const std::vector<Scan> &scans);

    void build();

    /// A point whose matrix was not positive definite has the prior and its flag, as in the
    /// library; a point out of reach throws.
    std::vector<gpom_answer_t> query(const std::vector<gpom_point_t> &points) const;
    std::vector<gpom_answer_t> query(const gpom_raster_t &raster) const;

    gpom_stats_t stats() const;
    const gpom_map_t *get() const { return map_; }

private:
    gpom_scratch_t scratch() const;

    std::unique_ptr<std::uint64_t[]> memory_;
    std::unique_ptr<std::uint8_t[]> scratch_;
    gpom_map_t *map_ = nullptr;
};

/// Beams that scans can give at most: a map of this capacity takes them all.
std::size_t beam_count(const std::vector<Scan> &scans);

/// Middle of the scans' positions, to whole metres: an origin that keeps them all in reach.
gpom_point_t middle_of(const std::vector<Scan> &scans);

} // namespace gpom_tools

#endif
