// The low-resolution map.
#include "ports/python/src/parts.hpp"

#include <nanobind/stl/string.h>

#include <cstddef>

namespace gpom_python
{

namespace
{

std::uint32_t layer_of(const std::string &name)
{
    if (name != "coarse" && name != "focus") {
        throw nb::value_error("layer: must be coarse or focus");
    }
    return name == "coarse" ? GPOM_LAYER_COARSE : GPOM_LAYER_FOCUS;
}

nb::object cell_dtype()
{
    return struct_dtype({{"probability", "u2", offsetof(gpom_cell_t, probability)},
                         {"variance", "u1", offsetof(gpom_cell_t, variance)},
                         {"cls", "u1", offsetof(gpom_cell_t, cls)},
                         {"stamp_ms", "u4", offsetof(gpom_cell_t, stamp_ms)}},
                        sizeof(gpom_cell_t));
}

nb::dict info_dict(const gpom_lowres_info_t &info)
{
    nb::dict dict;
    dict["x0_m"] = info.raster.x0_m;
    dict["y0_m"] = info.raster.y0_m;
    dict["cell_m"] = info.raster.cell_m;
    dict["stamp0_us"] = info.stamp0_us;
    dict["newest_ms"] = info.newest_ms;
    dict["map_sequence"] = info.map_sequence;
    dict["frame_epoch"] = info.frame_epoch;
    dict["n_dirty"] = info.n_dirty;
    return dict;
}

/// gpom_lowres_copy() may run beside a thread that changes the map, so it takes no lock. The raster
/// may move between the two calls; then the array has the wrong shape, and all begins again.
nb::object lowres(const Map &map, const std::string &layer_name)
{
    const std::uint32_t layer = layer_of(layer_name);
    for (;;) {
        gpom_lowres_info_t before, info;
        require(gpom_lowres_info(map.map, layer, &before), "lowres");
        const std::uint32_t nx = before.raster.nx, ny = before.raster.ny;
        const NewArray cells = new_array(nb::make_tuple(ny, nx), cell_dtype());
        gpom_status_t status;
        {
            nb::gil_scoped_release no_gil;
            status = gpom_lowres_copy(map.map, layer, static_cast<gpom_cell_t *>(cells.data),
                                      nx * ny, &info);
        }
        if (status == GPOM_ERR_BUSY || status == GPOM_ERR_MEM ||
            (status == GPOM_OK && (info.raster.nx != nx || info.raster.ny != ny))) {
            continue;
        }
        require(status, "lowres");
        return nb::make_tuple(cells.array, info_dict(info));
    }
}

} // namespace

void add_lowres(nb::module_ &module, nb::class_<Map> &map)
{
    module.attr("CELL") = cell_dtype();
    map.def(
        "lowres", &lowres, nb::arg("layer") = "coarse",
        "Copy the low-resolution map (gpom_lowres_copy()); step() keeps it up to date.\n\n"
        "layer    coarse or focus\n"
        "Returns  ny x nx cells, row 0 the lowest y, of dtype CELL: probability [1 / 65535],\n"
        "         variance [1 / 255 of the prior's], cls (3 unknown), stamp_ms [ms]; and a dict:\n"
        "         x0_m, y0_m (lower left corner), cell_m [m], stamp0_us [us], newest_ms,\n"
        "         map_sequence, frame_epoch, n_dirty.");
    map.def(
        "focus",
        [](Map &self, const nb::handle &values, double half_width_m, double cell_m) {
            const Points points(values);
            require(changing(self,
                             [&] {
                                 return gpom_lowres_focus(self.map, points.data(), points.size(),
                                                          half_width_m, cell_m);
                             }),
                    "focus");
        },
        nb::arg("points"), nb::arg("half_width_m"), nb::arg("cell_m"),
        "Place the focus layer around a polyline of n x 2 points [m]; 0 points end it.");
}

} // namespace gpom_python
