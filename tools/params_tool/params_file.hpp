// Hyperparameters from a file of any kind: TOML, C header or record.
#ifndef GPOM_TOOLS_PARAMS_TOOL_PARAMS_FILE_HPP
#define GPOM_TOOLS_PARAMS_TOOL_PARAMS_FILE_HPP

#include "gpom/params.h"

#include <string>

namespace gpom_tools
{

enum class ParamsKind { kToml, kHeader, kRecord };

/// What a file holds. Fields that the kernel does not use are at their defaults.
struct ParamsFile {
    ParamsKind kind;
    gpom_params_t params;
    std::string comment; ///< That the file begins with, without marks; a record has none.
};

/// Read and check. The content tells the kind, whatever the file is called. Throws FileError.
ParamsFile read_params_file(const std::string &path);

} // namespace gpom_tools

#endif
