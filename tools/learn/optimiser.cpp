#include "tools/learn/optimiser.hpp"

#include <LBFGSB.h>

#include <limits>
#include <stdexcept>

namespace gpom_tools
{
namespace
{

/// A failed line search ends the solver. It starts again from the best point, this many times.
constexpr int kRoundsMax = 3;
constexpr double kGainMin = 1e-5;

} // namespace

Minimum minimise(const Objective &objective, const Eigen::VectorXd &start, const Box &box,
                 int iterations_max)
{
    Minimum best{start.cwiseMax(box.low).cwiseMin(box.high),
                 std::numeric_limits<double>::infinity(), 0};
    auto remembering = [&](const Eigen::VectorXd &x, Eigen::VectorXd &gradient) {
        const double value = objective(x, gradient);
        ++best.n_evaluations;
        if (value < best.value) {
            best.value = value;
            best.x = x;
        }
        return value;
    };
    LBFGSpp::LBFGSBParam<double> settings;
    settings.epsilon = 1e-6;
    settings.epsilon_rel = 0.0;
    settings.past = 4;
    settings.delta = 5e-6;
    settings.max_iterations = iterations_max;
    settings.m = 12;
    for (int round = 0; round < kRoundsMax; ++round) {
        const double before = best.value;
        Eigen::VectorXd x = best.x;
        double value = 0.0;
        try {
            LBFGSpp::LBFGSBSolver<double>(settings).minimize(remembering, x, value, box.low,
                                                             box.high);
            break;
        } catch (const std::exception &) { // the line search failed
            if (!(best.value < before - kGainMin)) {
                break;
            }
        }
    }
    best.x = best.x.cwiseMax(box.low).cwiseMin(box.high);
    return best;
}

} // namespace gpom_tools
