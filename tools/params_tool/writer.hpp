// Hyperparameters as files: TOML for tools, a C header for firmware, a record for either.
#ifndef GPOM_TOOLS_PARAMS_TOOL_WRITER_HPP
#define GPOM_TOOLS_PARAMS_TOOL_WRITER_HPP

#include "gpom/params.h"

#include <string>

namespace gpom_tools
{

/// First line of the comment of a header that params_header() wrote.
inline constexpr const char *kHeaderMark = "Written by gpom-params or gpom-learn; do not edit.";

/// Six digits, or as many more as it takes to read back to the same bits: "0.3", "1e-05", "20.0".
std::string number_text(float value);

/// What read_params() reads; a field at its neutral value is left out. Each line of the comment is
/// written after `# `. Throws std::runtime_error if gpom_params_check() refuses a value, like those
/// below.
std::string params_toml(const gpom_params_t &params, const std::string &comment);

/// A header for C99, C++20, and earlier C++ of GCC and clang: the constant gpom_params_NAME.
std::string params_header(const gpom_params_t &params, const std::string &name,
                          const std::string &comment);

/// The bytes of gpom_params_save().
std::string params_record(const gpom_params_t &params);

} // namespace gpom_tools

#endif
