// Formatted text, and probabilities of points as CSV.
#ifndef GPOM_TOOLS_MAP_RASTER_CSV_HPP
#define GPOM_TOOLS_MAP_RASTER_CSV_HPP

#include "tools/map/answer_csv.hpp"

#include <string>
#include <vector>

namespace gpom_tools
{

/// Append text, formatted as by printf.
void append_text(std::string &text, const char *format, ...) __attribute__((format(printf, 2, 3)));

/// Lines `x,y,probability`, for maps that know neither mean nor variance.
std::string probabilities_csv(const std::vector<gpom_point_t> &points,
                              const std::vector<double> &probabilities);

} // namespace gpom_tools

#endif
