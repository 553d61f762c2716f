// Writes learnt hyperparameters to files: TOML for tools, a C header for firmware.
#ifndef GPOM_TOOLS_LEARN_PARAMS_WRITER_HPP
#define GPOM_TOOLS_LEARN_PARAMS_WRITER_HPP

#include "tools/learn/params.hpp"

#include <string>

namespace gpom_tools
{

/// Text that read_params() reads. Parameters with neutral values are left out. Each line of the
/// comment is written after `# `.
std::string params_toml(const LearntParams &params, const std::string &comment);

/// A C99 and C++ header with one function, gpom_params_learnt(), that fills a gpom_params_t.
std::string params_header(const LearntParams &params, const std::string &comment);

/// The bytes of gpom_params_save(). Throws std::runtime_error.
std::string params_record(const LearntParams &params);

} // namespace gpom_tools

#endif
