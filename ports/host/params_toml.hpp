// Reads hyperparameters from TOML.
#ifndef GPOM_PORTS_HOST_PARAMS_TOML_HPP
#define GPOM_PORTS_HOST_PARAMS_TOML_HPP

#include "gpom/params.h"

#include <cstdint>
#include <string>

namespace gpom_tools
{

/// Read and check a parameters file. Keys: kernel, frame (optional: query) and those of
/// params_fields.hpp. Throws FileError: missing file, TOML syntax, an unknown, missing or mistyped
/// key, a refused value.
gpom_params_t read_params(const std::string &path);

/// The same from a text; `path` is for errors alone.
gpom_params_t params_of_toml(const std::string &path, const std::string &text);

/// A text of gpom_params_check() with the values of all fields that it names:
/// "sf2: must be from 1e-6 to 1e6 (here sf2 = 1e+07)".
std::string problem_with_values(const gpom_params_t &params, const std::string &problem);

/// Throws std::runtime_error with that text if gpom_params_check() refuses them.
void require_good(const gpom_params_t &params);

/// "nn", "matern12", …
const char *kernel_name(std::int32_t kernel);

/// "query", "map".
const char *frame_name(std::int32_t frame);

} // namespace gpom_tools

#endif
