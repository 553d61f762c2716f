// The map: its configuration, counters, beams, and what changes it apart from scans.
#include "ports/python/src/parts.hpp"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>

#include <cstring>
#include <optional>

namespace gpom_python
{

namespace
{

template <class Number>
bool take(const nb::dict &words, const char *name, Number &field, std::size_t &n_taken)
{
    if (!words.contains(name)) {
        return false;
    }
    field = nb::cast<Number>(words[name]);
    ++n_taken;
    return true;
}

/// Configuration of keyword arguments with the names of gpom_config_t.
gpom_config_t config_of(const Params &params, const nb::dict &words)
{
    gpom_config_t config;
    gpom_config_init(&config);
    config.params = params.values;
    std::size_t n_taken = 0;
    take(words, "beam_max", config.beam_max, n_taken);
    take(words, "clear_scans", config.clear_scans, n_taken);
    take(words, "keep_m", config.keep_m, n_taken);
    take(words, "far_m", config.far_m, n_taken);
    take(words, "old_s", config.old_s, n_taken);
    take(words, "rebase_m", config.rebase_m, n_taken);
    take(words, "origin_x_m", config.origin_x_m, n_taken);
    take(words, "origin_y_m", config.origin_y_m, n_taken);
    take(words, "walk_max", config.walk_max, n_taken);
    take(words, "lowres_cell_m", config.lowres_cell_m, n_taken);
    take(words, "lowres_x0_m", config.lowres_x0_m, n_taken);
    take(words, "lowres_y0_m", config.lowres_y0_m, n_taken);
    take(words, "focus_cell_max", config.focus_cell_max, n_taken);
    take(words, "lowres_reach_m", config.lowres_reach_m, n_taken);
    take(words, "lowres_unknown", config.lowres_unknown, n_taken);
    take(words, "lowres_nx", config.lowres_nx, n_taken);
    take(words, "lowres_ny", config.lowres_ny, n_taken);
    bool rolling = false;
    if (take(words, "lowres_rolling", rolling, n_taken)) {
        config.lowres_rolling = rolling;
    }
    if (n_taken != words.size()) {
        throw nb::type_error("Map: an argument is no field of gpom_config_t; see gpom/map.h");
    }
    return config;
}

/// The counters, by the names of gpom_stats_t.
nb::dict stats_of(const Map &map)
{
    gpom_stats_t stats;
    require(gpom_map_stats(map.map, &stats), "stats");
    nb::dict dict;
#define GPOM_COUNTER(name) dict[#name] = stats.name
    GPOM_COUNTER(scans_inserted);
    GPOM_COUNTER(scans_bad_pose);
    GPOM_COUNTER(scans_out_of_reach);
    GPOM_COUNTER(beams_hit);
    GPOM_COUNTER(beams_no_return);
    GPOM_COUNTER(beams_nan);
    GPOM_COUNTER(beams_not_positive);
    GPOM_COUNTER(beams_too_near);
    GPOM_COUNTER(beams_masked);
    GPOM_COUNTER(beams_known);
    GPOM_COUNTER(beams_contradicting);
    GPOM_COUNTER(beams_redundant);
    GPOM_COUNTER(beams_ids_spent);
    GPOM_COUNTER(beams_evicted_redundant);
    GPOM_COUNTER(beams_not_confirmed);
    GPOM_COUNTER(hits_cleared);
    GPOM_COUNTER(beams_forgotten);
    GPOM_COUNTER(free_cleared);
    GPOM_COUNTER(cells_cut);
    GPOM_COUNTER(beams_evicted_far);
    GPOM_COUNTER(beams_evicted_old);
    GPOM_COUNTER(beams_evicted_contradicted);
#undef GPOM_COUNTER
    return dict;
}

nb::object beam_dtype()
{
#define GPOM_FIELD(name, format)                                                                   \
    {                                                                                              \
#name, format, offsetof(gpom_beam_t, name)                                                 \
    }
    return struct_dtype(
        {GPOM_FIELD(x_m, "f8"), GPOM_FIELD(y_m, "f8"), GPOM_FIELD(stamp_us, "i8"),
         GPOM_FIELD(dir_x, "f4"), GPOM_FIELD(dir_y, "f4"), GPOM_FIELD(range_m, "f4"),
         GPOM_FIELD(hit_noise, "f4"), GPOM_FIELD(free_noise, "f4"), GPOM_FIELD(id, "u4"),
         GPOM_FIELD(is_hit, "u1"), GPOM_FIELD(is_free, "u1"), GPOM_FIELD(returned, "u1"),
         GPOM_FIELD(provisional, "u1"), GPOM_FIELD(past, "u1"), GPOM_FIELD(n_agreed, "u1"),
         GPOM_FIELD(excess, "f4"), GPOM_FIELD(n_against, "u1"), GPOM_FIELD(arrived, "u1"),
         GPOM_FIELD(scan, "u2")},
        sizeof(gpom_beam_t));
#undef GPOM_FIELD
}

nb::object beams_of(const Map &map)
{
    std::vector<gpom_beam_t> beams;
    reading(map, [&] {
        for (std::uint32_t i = 0; i < gpom_map_slot_count(map.map); ++i) {
            gpom_beam_t beam;
            require(gpom_map_beam(map.map, i, &beam), "beam");
            if (beam.is_hit != 0 || beam.is_free != 0) {
                beams.push_back(beam);
            }
        }
    });
    const NewArray array = new_array(nb::make_tuple(beams.size()), beam_dtype());
    std::memcpy(array.data, beams.data(), sizeof(gpom_beam_t) * beams.size());
    return array.array;
}

gpom_jump_t jump_of(const std::string &rule)
{
    const char *const names[] = {"keep", "forget", "clear"};
    for (int i = 0; i < 3; ++i) {
        if (rule == names[i]) {
            return static_cast<gpom_jump_t>(i);
        }
    }
    throw nb::value_error("rule: must be keep, forget or clear");
}

std::uint64_t step(Map &map, std::uint64_t budget)
{
    const Scratch scratch(map);
    std::uint64_t used = 0;
    require(changing(map, [&] { return gpom_map_step(map.map, budget, scratch.get(), &used); }),
            "step");
    return used;
}

void add_changes(nb::class_<Map> &type)
{
    type.def(
        "build",
        [](Map &map) { require(changing(map, [&] { return gpom_map_build(map.map); }), "build"); },
        "Index all beams: queries become faster, answers stay the same.");
    type.def("step", &step, nb::arg("budget"),
             "Do a slice of the work that scans leave behind (gpom_map_step()). budget: operations."
             "\nReturns the operations done.");
    type.def(
        "clear",
        [](Map &map) { require(changing(map, [&] { return gpom_map_clear(map.map); }), "clear"); },
        "Forget all beams. Counters keep their values.");
    type.def(
        "forget",
        [](Map &map, double x_m, double y_m, double radius_m) {
            const gpom_disc_t disc = {x_m, y_m, radius_m};
            require(changing(map, [&] { return gpom_map_forget(map.map, &disc); }), "forget");
        },
        nb::arg("x_m"), nb::arg("y_m"), nb::arg("radius_m"),
        "Forget what is known inside a disc of the map frame [m].");
    type.def(
        "jump",
        [](Map &map, const std::string &rule, double x_m, double y_m, double radius_m) {
            const gpom_disc_t disc = {x_m, y_m, radius_m};
            const gpom_jump_t jump = jump_of(rule);
            require(changing(map, [&] { return gpom_map_jump(map.map, jump, &disc); }), "jump");
        },
        nb::arg("rule"), nb::arg("x_m") = 0.0, nb::arg("y_m") = 0.0, nb::arg("radius_m") = 1.0,
        "The map frame jumped. rule: keep, forget (a disc [m]) or clear (gpom_map_jump()).");
}

void add_state(nb::class_<Map> &type)
{
    type.def("stats", &stats_of, "The counters, by the names of gpom_stats_t.");
    type.def("beams", &beams_of,
             "The kept beams: a structured array with the fields of gpom_beam_t.");
    type.def_prop_ro(
        "n_beams", [](const Map &map) { return gpom_map_beam_count(map.map); },
        "Number of beams kept now.");
    type.def_prop_ro(
        "n_bytes", [](const Map &map) { return gpom_map_bytes(&map.config); },
        "Bytes of the map's memory.");
    type.def_prop_ro(
        "params", [](const Map &map) { return Params{map.config.params}; },
        "A copy of the hyperparameters.");
    type.def_prop_ro(
        "origin",
        [](const Map &map) {
            gpom_point_t origin;
            require(gpom_map_origin(map.map, &origin), "origin");
            return std::make_pair(origin.x_m, origin.y_m);
        },
        "x, y of the origin, map frame [m].");
}

} // namespace

Map::Map(const gpom_config_t &map_config) : config(map_config)
{
    const char *problem = nullptr;
    const gpom_status_t status = gpom_config_check(&config, &problem);
    require(status, problem != nullptr ? problem : "map");
    const std::size_t n_bytes = gpom_map_bytes(&config);
    memory = std::make_unique<std::uint64_t[]>((n_bytes + 7) / 8);
    require(gpom_map_init(&map, &config, memory.get(), n_bytes), "map");
}

void add_map(nb::module_ &module)
{
    nb::class_<Map> type(
        module, "Map",
        "A map in memory of its own. Threads may share it: queries run side by "
        "side,\nand a call that changes the map waits for them.\n\n"
        "params  Params\n"
        "others  fields of gpom_config_t (gpom/map.h) with its defaults: beam_max, "
        "keep_m [m],\n        clear_scans, far_m [m], old_s [s], rebase_m [m], "
        "origin_x_m, origin_y_m [m],\n        walk_max, lowres_cell_m [m], "
        "lowres_x0_m, lowres_y0_m [m], lowres_nx, lowres_ny,\n        "
        "lowres_rolling, lowres_reach_m [m], lowres_unknown, focus_cell_max\n\n"
        "Raises Error, which names the field.");
    type.def(
        "__init__",
        [](Map *map, const Params &params, const nb::kwargs &words) {
            new (map) Map(config_of(params, words));
        },
        nb::arg("params"), nb::arg("config"));
    add_insertion(type);
    add_changes(type);
    add_state(type);
    add_queries(module, type);
    add_planning(type);
    add_lowres(module, type);
    add_snapshots(type);
}

} // namespace gpom_python
