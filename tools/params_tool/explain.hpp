// Hyperparameters in words.
#ifndef GPOM_TOOLS_PARAMS_TOOL_EXPLAIN_HPP
#define GPOM_TOOLS_PARAMS_TOOL_EXPLAIN_HPP

#include "tools/params_tool/params_file.hpp"

#include <string>

namespace gpom_tools
{

/// Each field with its value, unit, what it does and its neutral value, then what follows from
/// them: the prior and what the classes mean.
std::string explained(const std::string &path, const ParamsFile &file);

} // namespace gpom_tools

#endif
