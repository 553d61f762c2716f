// Points in, answers out: the CSV files of gpom-query.
#ifndef GPOM_TOOLS_MAP_ANSWER_CSV_HPP
#define GPOM_TOOLS_MAP_ANSWER_CSV_HPP

#include "gpom/query.h"

#include <string>
#include <vector>

namespace gpom_tools
{

/// Most cells that one raster may have here.
constexpr double kRasterCellsMax = 1e8;

/// Points `x,y` a line [m]; `#` comments, blank lines and a first line "x,y" are skipped. Plain or
/// gzipped. Throws FileError.
std::vector<gpom_point_t> read_points(const std::string &path);

/// Centres of a raster's cells, in the order of gpom_query_raster().
std::vector<gpom_point_t> cell_centres(const gpom_raster_t &raster);

/// "x,y,mean,variance,probability,class", then a line for each point; class is free, unsure or
/// occupied. Numbers read back to the same bits.
std::string answers_csv(const std::vector<gpom_point_t> &points,
                        const std::vector<gpom_answer_t> &answers);

/// Kept beams, one a line with the fields of gpom_beam_t named in the first. Numbers read back to
/// the same bits.
std::string beams_csv(const std::vector<gpom_beam_t> &beams);

} // namespace gpom_tools

#endif
