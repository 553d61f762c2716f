// gpom._core: the library and the host tools in Python.
#include "ports/python/src/parts.hpp"

#include <nanobind/stl/string.h>

NB_MODULE(_core, module)
{
    using namespace gpom_python;
    module.doc() = "Maps, queries, learning and evaluation: the C++ of the library and its tools.";
    module.attr("VERSION") = std::to_string(GPOM_VERSION_MAJOR) + "." +
                             std::to_string(GPOM_VERSION_MINOR) + "." +
                             std::to_string(GPOM_VERSION_PATCH);
    add_errors(module);
    add_params(module);
    add_scans(module);
    add_map(module);
    add_learning(module);
    add_simulator(module);
    add_octomap(module);
}
