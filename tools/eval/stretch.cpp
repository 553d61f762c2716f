#include "tools/eval/stretch.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace gpom_tools
{

std::vector<Scan> first_metres(std::vector<Scan> scans, double first_m)
{
    double way_m = 0.0;
    for (std::size_t i = 1; i < scans.size() && first_m > 0.0; ++i) {
        way_m += std::hypot(scans[i].x_m - scans[i - 1].x_m, scans[i].y_m - scans[i - 1].y_m);
        if (way_m > first_m) {
            scans.resize(i);
        }
    }
    return scans;
}

std::vector<Scan> after_metres(std::vector<Scan> scans, double first_m)
{
    const std::size_t n_first = first_m > 0.0 ? first_metres(scans, first_m).size() : 0;
    if (n_first == scans.size() && n_first > 0) {
        throw std::runtime_error("--after-metres: the whole way is no longer than that");
    }
    scans.erase(scans.begin(), scans.begin() + static_cast<std::ptrdiff_t>(n_first));
    return scans;
}

} // namespace gpom_tools
