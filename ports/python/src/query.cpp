// Queries of points, rasters and paths, and exploration.
#include "ports/python/src/parts.hpp"

#include <nanobind/stl/string.h>

#include <cstddef>

namespace gpom_python
{

namespace
{

nb::object answer_dtype()
{
    return struct_dtype({{"mean", "f4", offsetof(gpom_answer_t, mean)},
                         {"variance", "f4", offsetof(gpom_answer_t, variance)},
                         {"probability", "f4", offsetof(gpom_answer_t, probability)},
                         {"cls", "u1", offsetof(gpom_answer_t, cls)},
                         {"flags", "u1", offsetof(gpom_answer_t, flags)},
                         {"n_hits", "u1", offsetof(gpom_answer_t, n_hits)},
                         {"n_free", "u1", offsetof(gpom_answer_t, n_free)}},
                        sizeof(gpom_answer_t));
}

nb::object query_points(const Map &map, const nb::handle &values)
{
    const Points points(values);
    const NewArray answers = new_array(nb::make_tuple(points.size()), answer_dtype());
    const Scratch scratch(map);
    require_answers(reading(map, [&] {
        return gpom_query_points(map.map, points.data(), points.size(),
                                 static_cast<gpom_answer_t *>(answers.data), scratch.get());
    }));
    return answers.array;
}

nb::object query_raster(const Map &map, double x0_m, double y0_m, double cell_m, std::uint32_t nx,
                        std::uint32_t ny)
{
    const gpom_raster_t raster = {x0_m, y0_m, cell_m, nx, ny};
    const NewArray answers = new_array(nb::make_tuple(ny, nx), answer_dtype());
    const Scratch scratch(map);
    require_answers(reading(map, [&] {
        return gpom_query_raster(map.map, &raster, static_cast<gpom_answer_t *>(answers.data),
                                 scratch.get());
    }));
    return answers.array;
}

nb::object query_path(const Map &map, const nb::handle &values, double radius_m, double spacing_m,
                      float stop_probability)
{
    const Points points(values);
    const gpom_path_t path = {points.data(), points.size(), radius_m, spacing_m, stop_probability};
    gpom_path_result_t result;
    const Scratch scratch(map);
    require_answers(
        reading(map, [&] { return gpom_path_query(map.map, &path, &result, scratch.get()); }));
    nb::dict dict;
    dict["x_m"] = result.x_m;
    dict["y_m"] = result.y_m;
    dict["arc_m"] = result.arc_m;
    dict["probability"] = result.probability;
    dict["cls"] = result.cls;
    dict["flags"] = result.flags;
    dict["n_samples"] = result.n_samples;
    return dict;
}

nb::object explore(const Map &map, double x_m, double y_m, std::uint32_t n_goals_max)
{
    const nb::object dtype = struct_dtype({{"ix", "u4", offsetof(gpom_goal_t, ix)},
                                           {"iy", "u4", offsetof(gpom_goal_t, iy)},
                                           {"n_steps", "u4", offsetof(gpom_goal_t, n_steps)},
                                           {"variance", "u1", offsetof(gpom_goal_t, variance)},
                                           {"cls", "u1", offsetof(gpom_goal_t, cls)}},
                                          sizeof(gpom_goal_t));
    const NewArray found = new_array(nb::make_tuple(n_goals_max), dtype);
    const gpom_point_t from = {x_m, y_m};
    gpom_goals_t goals = {static_cast<gpom_goal_t *>(found.data), n_goals_max, 0};
    const Scratch scratch(GPOM_EXPLORE_BYTES(map.config.lowres_nx, map.config.lowres_ny));
    require(reading(map, [&] { return gpom_explore(map.map, &from, &goals, scratch.get()); }),
            "explore");
    return found.array[nb::slice(nb::int_(0), nb::int_(goals.n_goals), nb::int_(1))];
}

} // namespace

void add_queries(nb::module_ &module, nb::class_<Map> &map)
{
    module.attr("ANSWER") = answer_dtype();
    module.attr("LANES") = gpom_lanes();
    map.def("query", &query_points, nb::arg("points"),
            "Answer n points (gpom_query_points()).\n\n"
            "points   n x 2 float64, without a copy: x, y in the map frame [m]\n"
            "Returns  n answers, a structured array of dtype ANSWER: mean, variance, probability, "
            "cls\n         (0 free, 1 unsure, 2 occupied), flags (1 out of reach, 2 bad matrix, 4 "
            "cut search),\n         n_hits, n_free.\n"
            "Raises ValueError (a shape), Error.");
    map.def("query_raster", &query_raster, nb::arg("x0_m"), nb::arg("y0_m"), nb::arg("cell_m"),
            nb::arg("nx"), nb::arg("ny"),
            "Answer the centres of nx x ny cells (gpom_query_raster()).\n\n"
            "x0_m, y0_m  lower left corner of cell (0, 0), map frame [m]\n"
            "cell_m      side of a cell [m]\n"
            "Returns     ny x nx answers as query(); row 0 is the lowest y.");
    map.def("query_path", &query_path, nb::arg("points"), nb::arg("radius_m"),
            nb::arg("spacing_m") = 0.1, nb::arg("stop_probability") = 2.0f,
            "The likeliest obstacle in the area that a disc sweeps along a polyline "
            "(gpom_path_query()).\n\n"
            "points     n x 2 corners, map frame [m]\n"
            "radius_m   of the disc [m]\n"
            "spacing_m  largest step between samples [m]\n"
            "Returns    dict: x_m, y_m, arc_m, probability, cls, flags, n_samples.");
    map.def("explore", &explore, nb::arg("x_m"), nb::arg("y_m"), nb::arg("n_goals_max") = 16,
            "Cells of the coarse layer that are worth exploring from x, y [m] (gpom_explore()).\n"
            "Returns a structured array: ix, iy, n_steps, variance, cls.");
}

} // namespace gpom_python
