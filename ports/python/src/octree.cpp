// OctoMap files, written by the OctoMap library.
#include "ports/python/src/parts.hpp"

#include <octomap/OcTree.h>

#include <nanobind/stl/string.h>

#include <fstream>
#include <iomanip>
#include <limits>

namespace gpom_python
{

namespace
{

/// One layer of leaves at z = 0 .. cell_m: free and occupied cells. Others stay unknown.
void write_octomap(const std::string &path, const nb::handle &classes, double x0_m, double y0_m,
                   double cell_m)
{
    const nb::object array = as_numpy(classes, "uint8");
    nb::ndarray<const std::uint8_t, nb::ndim<2>, nb::c_contig, nb::device::cpu> cells;
    if (!nb::try_cast(array, cells)) {
        refuse_shape("classes", "ny x nx classes");
    }
    nb::gil_scoped_release no_gil;
    octomap::OcTree tree(cell_m);
    const std::size_t ny = cells.shape(0), nx = cells.shape(1);
    for (std::size_t i = 0; i < nx * ny; ++i) {
        const std::uint8_t cls = cells.data()[i];
        if (cls != GPOM_FREE && cls != GPOM_OCCUPIED) {
            continue;
        }
        const double x_m = x0_m + (static_cast<double>(i % nx) + 0.5) * cell_m;
        const double y_m = y0_m + (static_cast<double>(i / nx) + 0.5) * cell_m;
        tree.updateNode(x_m, y_m, 0.5 * cell_m, cls == GPOM_OCCUPIED, true);
    }
    tree.updateInnerOccupancy();
    tree.toMaxLikelihood();
    tree.prune();
    std::ofstream file(path, std::ios::binary);
    file << std::setprecision(std::numeric_limits<double>::max_digits10)
         << "# Octomap OcTree binary file\nid OcTree\nsize " << tree.size() << "\nres " << cell_m
         << "\ndata\n";
    tree.writeBinaryData(file); // writeBinary() would write on stderr, too
    file.close();
    if (!file) {
        throw gpom_tools::FileError(path, 0, "cannot write this file");
    }
}

} // namespace

void add_octomap(nb::module_ &module)
{
    module.def("write_octomap", &write_octomap, nb::arg("path"), nb::arg("classes"),
               nb::arg("x0_m"), nb::arg("y0_m"), nb::arg("cell_m"),
               "Write an OctoMap .bt file; gpom.io.write_octomap() is for users.");
}

} // namespace gpom_python
