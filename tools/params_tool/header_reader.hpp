// Hyperparameters from a C header.
#ifndef GPOM_TOOLS_PARAMS_TOOL_HEADER_READER_HPP
#define GPOM_TOOLS_PARAMS_TOOL_HEADER_READER_HPP

#include "gpom/params.h"

#include <string>

namespace gpom_tools
{

/// Is there the word gpom_params_t, outside of comments and of lines that begin with '#', or does
/// such a line include a file? TOML has neither.
bool looks_like_header(const std::string &text);

/// The one constant `gpom_params_t NAME = { .field = value, ... }` of a C text, checked. What it
/// does not name is 0, as in C. `path` is for errors alone. Throws FileError: no such constant or
/// two, a field that is unknown, given twice or without a value, a refused value.
gpom_params_t params_of_header(const std::string &path, const std::string &text);

} // namespace gpom_tools

#endif
