// The classical rival: an occupancy grid in log odds, with thin or widened beams.
#ifndef GPOM_TOOLS_EVAL_OCCUPANCY_GRID_HPP
#define GPOM_TOOLS_EVAL_OCCUPANCY_GRID_HPP

#include "gpom/query.h"
#include "ports/host/scan_log.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace gpom_tools
{

/// Inverse sensor model; Thrun, Burgard, Fox (2005), Probabilistic Robotics, chapter 9.
/// Defaults are OctoMap's (Hornung et al., 2013).
struct GridModel {
    double p_hit = 0.7;  ///< Occupancy of a cell after one return from it.
    double p_miss = 0.4; ///< Occupancy of a cell after one beam through it.
    double p_min = 0.12; ///< Clamps.
    double p_max = 0.97;
};

/// One beam in the map frame. It is free from its origin to the range.
struct GridBeam {
    double x_m;
    double y_m;
    double bearing_rad;
    double range_m;
    bool hit;              ///< There is a return at the range.
    double half_width_rad; ///< For widened beams. Under pi / 2.
};

/// Value for half_width_rad: use half the angle between neighbouring beams of a scan.
constexpr double kHalfSpacing = -1.0;

/// The usable beams of scans: those with a return, and those that are free up to the maximum range.
std::vector<GridBeam> beams_of(const std::vector<Scan> &scans, double half_width_rad);

gpom_point_t end_of(const GridBeam &beam);

struct GridCell {
    std::int64_t ix;
    std::int64_t iy;
    bool operator==(const GridCell &other) const { return ix == other.ix && iy == other.iy; }
};

/// Visit the cells of a segment in order; Amanatides and Woo (1987). Only the part inside the
/// raster is visited. Consecutive cells share a side.
void traverse(const gpom_raster_t &raster, gpom_point_t from, gpom_point_t to,
              const std::function<void(GridCell)> &visit);

struct BeamCone;

class OccupancyGrid {
public:
    /// Throws std::runtime_error if the raster has more than kCellsMax cells.
    OccupancyGrid(const gpom_raster_t &raster, const GridModel &model);

    /// Make the cells that the beam passes freer, and the cell of the return more occupied.
    void insert_thin(const GridBeam &beam);

    /// Insert the beam as a cone. Cells nearer than the return become freer. Cells within half a
    /// cell diagonal of the return's arc become more occupied. The evidence decreases with the
    /// angle from the axis, 1 - (angle / half width)^2. The cone is at least one cell wide.
    void insert_wide(const GridBeam &beam);

    /// Probability of occupancy. 0.5 for unknown cells and outside the raster.
    double probability(gpom_point_t point) const;

    const gpom_raster_t &raster() const { return raster_; }

    static constexpr std::size_t kCellsMax = 100'000'000;

private:
    bool contains(GridCell cell) const;
    std::size_t index(GridCell cell) const;
    GridCell cell_at(gpom_point_t point) const;
    void add(GridCell cell, double log_odds);
    void add_wide(GridCell cell, const BeamCone &cone);

    gpom_raster_t raster_;
    double log_odds_hit_;
    double log_odds_miss_;
    double log_odds_min_;
    double log_odds_max_;
    std::vector<float> log_odds_;
};

/// Smallest raster of square cells that covers both corners and a margin.
gpom_raster_t raster_over(gpom_point_t low, gpom_point_t high, double cell_m, double margin_m);

} // namespace gpom_tools

#endif
