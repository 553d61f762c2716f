// The true occupancy of a simulated world, as a raster.
#ifndef GPOM_TOOLS_SIM_TRUTH_HPP
#define GPOM_TOOLS_SIM_TRUTH_HPP

#include "ports/host/file_error.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace gpom_tools
{

/// Most cells of a raster, for reading and writing files.
constexpr int kTruthCellsMax = 500'000'000;

/// The lower left corner of cell (0, 0) is at (x0, y0) in the map frame. ix grows to the east, iy
/// to the north.
struct Truth {
    double x0_m = 0.0;
    double y0_m = 0.0;
    double cell_m = 0.25;
    int nx = 0;
    int ny = 0;
    std::vector<std::uint8_t> occupied; ///< nx * ny values 0 or 1. Cell (ix, iy) is at [iy * nx +
                                        ///< ix].

    std::size_t index(int ix, int iy) const
    {
        return static_cast<std::size_t>(iy) * static_cast<std::size_t>(nx) +
               static_cast<std::size_t>(ix);
    }
    bool at(int ix, int iy) const { return occupied[index(ix, iy)] != 0; }
};

/// Read a file that truth_pgm() made. Throws FileError.
Truth read_truth(const std::string &path);

/// A binary PGM image for any viewer, north up, 0 = occupied and 255 = free:
///   P5
///   # gpom-truth 1 x0_m y0_m cell_m
///   # header comment
///   nx ny
///   255
///   nx * ny bytes
std::string truth_pgm(const Truth &truth, const std::string &header_comment);

/// Write truth_pgm() to a file, either the whole image or nothing. Throws FileError.
void write_truth(const std::string &path, const Truth &truth, const std::string &header_comment);

} // namespace gpom_tools

#endif
