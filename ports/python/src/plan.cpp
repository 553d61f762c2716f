// For planners: distances and sectors of the low-resolution map.
#include "ports/python/src/parts.hpp"

#include <cstddef>

namespace gpom_python
{

namespace
{

/// Distances of a map, with their memory.
struct DistanceField {
    gpom_distances_t *field;
    std::unique_ptr<std::uint64_t[]> memory;
};

/// A field that has seen the whole raster.
DistanceField whole_field(const Map &map)
{
    const std::size_t n_bytes = GPOM_DISTANCES_BYTES(map.config.lowres_nx, map.config.lowres_ny);
    DistanceField made = {nullptr, std::make_unique<std::uint64_t[]>((n_bytes + 7) / 8)};
    gpom_status_t status = gpom_distances_init(&made.field, map.map, made.memory.get(), n_bytes);
    if (status == GPOM_OK) {
        status = gpom_distances_step(made.field, map.map, UINT64_MAX, nullptr);
    }
    require(status, "distances");
    return made;
}

nb::object distances(const Map &map, const nb::handle &values)
{
    const Points points(values);
    const nb::object dtype =
        struct_dtype({{"distance_m", "f4", offsetof(gpom_distance_t, distance_m)},
                      {"grad_x", "f4", offsetof(gpom_distance_t, grad_x)},
                      {"grad_y", "f4", offsetof(gpom_distance_t, grad_y)}},
                     sizeof(gpom_distance_t));
    const NewArray occupied = new_array(nb::make_tuple(points.size()), dtype);
    const NewArray not_free = new_array(nb::make_tuple(points.size()), dtype);
    reading(map, [&] {
        const DistanceField made = whole_field(map);
        for (std::size_t i = 0; i < points.size(); ++i) {
            require(gpom_distances_at(made.field, points.data() + i,
                                      static_cast<gpom_distance_t *>(occupied.data) + i,
                                      static_cast<gpom_distance_t *>(not_free.data) + i),
                    "point " + std::to_string(i));
        }
    });
    nb::dict result;
    result["occupied"] = occupied.array;
    result["not_free"] = not_free.array;
    return result;
}

nb::object sectors(const Map &map, const nb::handle &xyyaw, float range_m, float radius_m,
                   std::size_t n_sectors)
{
    const Pose pose(xyyaw, nb::none());
    const gpom_lookout_t lookout = {pose.get()->x_m, pose.get()->y_m, pose.get()->yaw_rad, range_m,
                                    radius_m};
    const nb::object dtype =
        struct_dtype({{"free_m", "f4", offsetof(gpom_sector_t, free_m)},
                      {"distance_m", "f4", offsetof(gpom_sector_t, distance_m)},
                      {"probability", "u2", offsetof(gpom_sector_t, probability)},
                      {"variance", "u1", offsetof(gpom_sector_t, variance)},
                      {"cls", "u1", offsetof(gpom_sector_t, cls)},
                      {"flags", "u1", offsetof(gpom_sector_t, flags)}},
                     sizeof(gpom_sector_t));
    const NewArray found = new_array(nb::make_tuple(n_sectors), dtype);
    gpom_status_t status;
    {
        nb::gil_scoped_release no_gil; // no lock: gpom_sectors() may run beside any other call
        status = gpom_sectors(map.map, &lookout, static_cast<gpom_sector_t *>(found.data),
                              n_sectors, nullptr);
    }
    require(status, "sectors");
    return found.array;
}

} // namespace

void add_planning(nb::class_<Map> &map)
{
    map.def(
        "distances", &distances, nb::arg("points"),
        "Distances of n points to cells of the low-resolution map (gpom/distances.h).\n\n"
        "points   n x 2, map frame [m], inside the coarse layer\n"
        "Returns  a dict: occupied, not_free: n elements each, with distance_m [m] between the\n"
        "         centres of cells, and the gradient grad_x, grad_y.\n"
        "Raises Error, which names the point. Cost: a field of the whole layer for each call.");
    map.def("sectors", &sectors, nb::arg("pose"), nb::arg("range_m"), nb::arg("radius_m") = 0.0f,
            nb::arg("n_sectors") = 72,
            "How far it is free about a pose in the low-resolution map (gpom_sectors()).\n\n"
            "pose      x [m], y [m], yaw [rad]\n"
            "range_m   cells farther away are ignored [m]\n"
            "radius_m  cells within it are the robot's own place [m]\n"
            "Returns   n_sectors elements, sector 0 ahead, counter-clockwise: free_m, distance_m "
            "[m],\n          probability [1 / 65535], variance, cls, flags.\n"
            "Raises Error.");
}

} // namespace gpom_python
