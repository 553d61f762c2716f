// Reads hyperparameters from TOML.
#ifndef GPOM_PORTS_HOST_PARAMS_TOML_HPP
#define GPOM_PORTS_HOST_PARAMS_TOML_HPP

#include "gpom/params.h"

#include <cstdint>
#include <string>

namespace gpom_tools
{

/// Read and check a parameters file. Keys: kernel, sf2, s0, s1 (nn), ell_m (others), sn2, sn2_free
/// (optional: sn2), alpha, beta, hits, free, gap_m, p_occupied, p_free, frame (optional: query).
/// Throws FileError: missing file, TOML syntax, an unknown, missing or mistyped key, a refused
/// value.
gpom_params_t read_params(const std::string &path);

/// "nn", "matern12", …
const char *kernel_name(std::int32_t kernel);

} // namespace gpom_tools

#endif
