// The CSV files of gpom-query: points in, answers out.
#ifndef GPOM_TOOLS_MAP_ANSWER_CSV_HPP
#define GPOM_TOOLS_MAP_ANSWER_CSV_HPP

#include "gpom/gradient.h"

#include <string>
#include <vector>

namespace gpom_tools
{

/// Most cells of one raster in these programs.
constexpr double kRasterCellsMax = 1e8;

/// Read points, `x,y` a line [m], plain or gzipped. Skips `#` comments, blank lines and a first
/// line "x,y". Throws FileError.
std::vector<gpom_point_t> read_points(const std::string &path);

/// Centres of a raster's cells, in the order of gpom_query_raster().
std::vector<gpom_point_t> cell_centres(const gpom_raster_t &raster);

/// "x,y,mean,variance,probability,class", then one line for each point. The class is free, unsure
/// or occupied. Numbers read back to the same bits.
std::string answers_csv(const std::vector<gpom_point_t> &points,
                        const std::vector<gpom_answer_t> &answers);

/// The same, and mean_x,mean_y,variance_x,variance_y,probability_x,probability_y [1/m] behind the
/// class.
std::string gradients_csv(const std::vector<gpom_point_t> &points,
                          const std::vector<gpom_gradient_t> &gradients);

/// Kept beams, one a line. The first line names the fields of gpom_beam_t. Numbers read back to the
/// same bits.
std::string beams_csv(const std::vector<gpom_beam_t> &beams);

} // namespace gpom_tools

#endif
