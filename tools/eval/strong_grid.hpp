// The honest grid: counts of returns and of passing beams, blurred, then calibrated.
#ifndef GPOM_TOOLS_EVAL_STRONG_GRID_HPP
#define GPOM_TOOLS_EVAL_STRONG_GRID_HPP

#include "tools/eval/occupancy_grid.hpp"

#include <Eigen/Core>

#include <array>
#include <vector>

namespace gpom_tools
{

/// One number a cell: rows are iy, columns ix.
using CellCounts = Eigen::Array<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Convolved with a normalised Gaussian of the given standard deviation [cells], cut at four of
/// them; outside are zeros. As wide as or narrower than an eighth of a cell changes nothing.
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

/// Platt scaling: greatest likelihood under a weak prior on the weights, w' w / 2000, by Newton's
/// method. Throws std::runtime_error if samples of one kind are missing.
Logistic fit_logistic(const std::vector<LogisticSample> &samples);

/// Returns and passing beams are counted by cell (a beam two samples a cell, each half a count),
/// the counts blurred, returns weighing four times. From the share q of returns among all and their
/// sum n a logistic function of logit q and logit q log(1 + n) makes probabilities. That function,
/// and with it the width of the blur, is chosen on 3000 points along a fifth of the beams which is
/// left out of the counts meanwhile.
class StrongGrid {
public:
    /// Throws std::runtime_error if the beams left out have no returns or the raster is too large.
    StrongGrid(const std::vector<GridBeam> &beams, const gpom_raster_t &raster,
               const std::vector<double> &sigmas_m);

    double probability(gpom_point_t point) const;

    double sigma_m() const { return sigma_m_; }
    double left_out_nll() const { return left_out_nll_; }

private:
    std::array<double, 2> features(gpom_point_t point) const;
    void blur(const CellCounts &hits, const CellCounts &free, double sigma_m);

    gpom_raster_t raster_;
    CellCounts hits_; ///< Blurred, weighted.
    CellCounts free_;
    double sigma_m_ = 0.0;
    double left_out_nll_ = 0.0;
    Logistic scaling_;
};

} // namespace gpom_tools

#endif
