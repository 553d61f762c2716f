// Minimises a smooth function in a box: L-BFGS-B by LBFGS++.
#ifndef GPOM_TOOLS_LEARN_OPTIMISER_HPP
#define GPOM_TOOLS_LEARN_OPTIMISER_HPP

#include <Eigen/Dense>

#include <functional>

namespace gpom_tools
{

/// Returns the value at x and fills the gradient.
using Objective = std::function<double(const Eigen::VectorXd &x, Eigen::VectorXd &gradient)>;

struct Box {
    Eigen::VectorXd low, high;
};

struct Minimum {
    Eigen::VectorXd x;
    double value;
    int n_evaluations;
};

/// The best point seen from a start. The start is moved into the box.
Minimum minimise(const Objective &objective, const Eigen::VectorXd &start, const Box &box,
                 int iterations_max);

} // namespace gpom_tools

#endif
