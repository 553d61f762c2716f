// A stronger grid: counts of returns and of passing beams are blurred and then calibrated.
#ifndef GPOM_TOOLS_EVAL_STRONG_GRID_HPP
#define GPOM_TOOLS_EVAL_STRONG_GRID_HPP

#include "tools/eval/occupancy_grid.hpp"

#include <Eigen/Core>

#include <array>
#include <vector>

namespace gpom_tools
{

/// One number for each cell. Rows are iy, columns ix.
using CellCounts = Eigen::Array<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Counts convolved with a normalised Gaussian of this standard deviation [cells], cut at four
/// standard deviations. Outside of the raster there are zeros. A Gaussian of at most an eighth of a
/// cell changes nothing.
CellCounts blurred(const CellCounts &counts, double sigma_cells);

/// p = 1 / (1 + exp(-(bias + w' x))).
struct Logistic {
    double bias = 0.0;
    std::array<double, 2> weights{};
    double probability(const std::array<double, 2> &x) const;
};

struct LogisticSample {
    std::array<double, 2> x;
    bool occupied;
};

/// Platt scaling: maximum likelihood with a weak prior on the weights, w' w / 2000, by Newton's
/// method. Throws std::runtime_error if samples of one kind are missing.
Logistic fit_logistic(const std::vector<LogisticSample> &samples);

/// Counts returns and passing beams in each cell. A beam has two samples in a cell, each half a
/// count. The counts are blurred. A return has a weight of four. Let q be the share of returns
/// among all counts of a cell, and n their sum. A logistic function of logit q and logit q log(1 +
/// n) gives the probability. The function and the width of the blur are fitted on 3000 points along
/// a fifth of the beams, which are left out of the counts for that.
class StrongGrid {
public:
    /// Throws std::runtime_error if the left-out beams have no returns or the raster is too large.
    StrongGrid(const std::vector<GridBeam> &beams, const gpom_raster_t &raster,
               const std::vector<double> &sigmas_m);

    double probability(gpom_point_t point) const;

    double sigma_m() const { return sigma_m_; }
    double left_out_nll() const { return left_out_nll_; }

private:
    std::array<double, 2> features(gpom_point_t point) const;
    void blur(const CellCounts &hits, const CellCounts &free, double sigma_m);

    gpom_raster_t raster_;
    CellCounts hits_; ///< Blurred and weighted.
    CellCounts free_;
    double sigma_m_ = 0.0;
    double left_out_nll_ = 0.0;
    Logistic scaling_;
};

} // namespace gpom_tools

#endif
