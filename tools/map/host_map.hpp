// The library's map with memory from the heap, for host programs.
#ifndef GPOM_TOOLS_MAP_HOST_MAP_HPP
#define GPOM_TOOLS_MAP_HOST_MAP_HPP

#include "gpom/gpom.h"
#include "ports/host/scan_log.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace gpom_tools
{

/// How a vehicle keeps its map (live.h).
struct LiveConfig {
    std::uint32_t beam_max = 16384;
    float keep_m = 0.05f;
    std::uint32_t clear_scans = 3;
    std::uint64_t step_ops = 1000000; ///< Budget of the step after each scan.
};

/// A map that keeps all beams.
gpom_config_t whole_config(const gpom_params_t &params, std::size_t beam_max, gpom_point_t origin);

/// A map that keeps what is worth keeping.
gpom_config_t live_config(const gpom_params_t &params, const LiveConfig &live, gpom_point_t origin);

/// Owns the arena and the scratch of one map. Every failure throws std::runtime_error.
class HostMap {
public:
    explicit HostMap(const gpom_config_t &config);
    HostMap(const gpom_params_t &params, std::size_t beam_max, gpom_point_t origin)
        : HostMap(whole_config(params, beam_max, origin))
    {
    }

    /// Insert one scan; its pose is the laser's, with a covariance as in gpom_pose_t; NULL: exactly
    /// known.
    void insert(const Scan &scan, const float *pose_cov = nullptr);
    /// Insert all scans and index them.
    void insert(const std::vector<Scan> &scans);

    void build();

    /// One slice of the work that scans leave behind. Returns the operations done.
    std::uint64_t step(std::uint64_t budget);

    /// A point whose matrix was not positive definite has the prior and its flag, one whose search
    /// was cut has its flag, as in the library; a point out of reach throws.
    std::vector<gpom_answer_t> query(const std::vector<gpom_point_t> &points) const;
    std::vector<gpom_answer_t> query(const gpom_raster_t &raster) const;
    /// Of the answers of query() the probabilities alone.
    std::vector<double> probabilities(const std::vector<gpom_point_t> &points) const;
    /// Likewise, its flags say which.
    gpom_path_result_t query(const gpom_path_t &path) const;

    /// The cells of the coarse low-resolution map, row by row from the lowest y.
    std::vector<gpom_cell_t> cells() const;

    gpom_stats_t stats() const;
    std::vector<gpom_beam_t> kept() const; ///< By slot, empty ones left out.
    std::size_t bytes() const { return map_bytes_; }
    const gpom_map_t *get() const { return map_; }

private:
    gpom_scratch_t scratch() const;

    std::size_t map_bytes_;
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
