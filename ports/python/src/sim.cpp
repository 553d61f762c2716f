// The simulator of streets.
#include "ports/python/src/parts.hpp"

#include "tools/sim/street.hpp"

#include <nanobind/stl/string.h>

#include <cstring>

namespace gpom_python
{

namespace
{

nb::object simulate(const gpom_tools::StreetConfig &config)
{
    const std::string absurd = gpom_tools::street_config_error(config);
    if (!absurd.empty()) {
        throw nb::value_error(absurd.c_str());
    }
    std::vector<gpom_tools::Scan> scans;
    gpom_tools::Truth truth;
    {
        nb::gil_scoped_release no_gil;
        const gpom_tools::StreetWorld world = gpom_tools::make_street_world(config);
        scans = gpom_tools::simulate_scans(world, config, [](std::size_t, std::size_t) {});
        truth = gpom_tools::street_truth(world, config.truth_cell_m);
    }
    const NewArray occupied = new_array(nb::make_tuple(truth.ny, truth.nx), nb::cast("uint8"));
    std::memcpy(occupied.data, truth.occupied.data(), truth.occupied.size());
    return nb::make_tuple(scan_tuples(scans), occupied.array, truth.x0_m, truth.y0_m, truth.cell_m);
}

/// Keyword arguments with the names of StreetConfig.
gpom_tools::StreetConfig street_config(const nb::dict &words)
{
    gpom_tools::StreetConfig config;
    const auto take = [&words](const char *name, auto &field) {
        if (words.contains(name)) {
            field = nb::cast<std::remove_reference_t<decltype(field)>>(words[name]);
        }
    };
    take("seed", config.seed);
    take("width_m", config.width_m);
    take("height_m", config.height_m);
    take("n_scans", config.n_scans);
    take("n_beams", config.n_beams);
    take("fov_deg", config.fov_deg);
    take("range_max_m", config.range_max_m);
    take("range_noise_m", config.range_noise_m);
    take("step_m", config.step_m);
    take("truth_cell_m", config.truth_cell_m);
    take("cars_arrive_at", config.cars_arrive_at);
    take("cars_leave_at", config.cars_leave_at);
    take("there_and_back", config.there_and_back);
    return config;
}

} // namespace

void add_simulator(nb::module_ &module)
{
    module.def(
        "simulate_street", [](const nb::dict &words) { return simulate(street_config(words)); },
        nb::arg("options"), "Scans and truth; gpom.simulate_street() is for users.");
}

} // namespace gpom_python
