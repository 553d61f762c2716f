#include "tools/params_tool/writer.hpp"

#include "ports/host/params_fields.hpp"
#include "ports/host/params_toml.hpp"

#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <stdexcept>

namespace gpom_tools
{
namespace
{

/// Digits of which every float reads back to the same bits, at worst.
constexpr int kDigitsMax = 9;

/// 0 with its sign: -0.0 has other bits.
bool is_neutral(float value) { return value == 0.0f && !std::signbit(value); }

bool is_left_out(const ParamField &field, const gpom_params_t &params)
{
    if (!field.is_used_by(params.kernel)) {
        return true;
    }
    return field.presence == Presence::kNeutral &&
           (field.number != nullptr ? is_neutral(params.*field.number) : params.*field.count == 0);
}

std::string commented(const std::string &comment, const char *mark)
{
    std::string text;
    std::istringstream lines(comment);
    for (std::string line; std::getline(lines, line);) {
        text += mark;
        text += line.empty() ? "\n" : " " + line + "\n";
    }
    return text;
}

/// For inside a C comment: nothing ends it or looks like the beginning of another one.
std::string without_comment_marks(std::string text)
{
    for (std::size_t i = 0; i + 1 < text.size(); ++i) {
        if (text.compare(i, 2, "*/") == 0 || text.compare(i, 2, "/*") == 0) {
            text.insert(i + 1, " ");
        }
    }
    return text;
}

std::string upper(const std::string &name)
{
    std::string text = name;
    for (char &c : text) {
        c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
    return text;
}

const char *kernel_constant(std::int32_t kernel)
{
    for (const NamedKernel &named : kKernels) {
        if (named.kernel == kernel) {
            return named.constant;
        }
    }
    throw std::runtime_error("kernel: unknown");
}

/// Every field is named, so that new ones are neutral, and given, so that defaults do not matter.
std::string initialiser(const gpom_params_t &params)
{
    std::string text = "    .struct_bytes = sizeof(gpom_params_t),\n";
    text += std::string("    .kernel = ") + kernel_constant(params.kernel) + ",\n";
    text += std::string("    .frame = ") + kFrames[params.frame].constant + ",\n";
    for (const ParamField &field : kParamFields) {
        const std::string value = field.number != nullptr ? number_text(params.*field.number) + "f"
                                                          : std::to_string(params.*field.count);
        text += std::string("    .") + field.field + " = " + value + ",\n";
    }
    return text;
}

} // namespace

std::string number_text(float value)
{
    char digits[40];
    for (int n_digits = 6; n_digits <= kDigitsMax; ++n_digits) {
        std::snprintf(digits, sizeof digits, "%.*g", n_digits, double{value});
        const bool reads_back = std::strtof(digits, nullptr) == value &&
                                static_cast<float>(std::strtod(digits, nullptr)) == value;
        if (reads_back) {
            break;
        }
    }
    std::string text = digits;
    if (text.find_first_of(".e") == std::string::npos) {
        text += ".0";
    }
    return text;
}

std::string params_toml(const gpom_params_t &params, const std::string &comment)
{
    require_good(params);
    std::string text = commented(comment, "#");
    text += std::string("kernel = \"") + kernel_name(params.kernel) + "\"\n";
    text += std::string("frame = \"") + frame_name(params.frame) + "\"\n";
    for (const ParamField &field : kParamFields) {
        if (!is_left_out(field, params)) {
            text += std::string(field.key) + " = " +
                    (field.number != nullptr ? number_text(params.*field.number)
                                             : std::to_string(params.*field.count)) +
                    "\n";
        }
    }
    return text;
}

std::string params_header(const gpom_params_t &params, const std::string &name,
                          const std::string &comment)
{
    require_good(params);
    const std::string guard = "GPOM_PRESETS_" + upper(name) + "_H";
    std::string text = std::string("/* ") + kHeaderMark + "\n";
    text += comment.empty() ? "" : " *\n" + commented(without_comment_marks(comment), " *");
    text += " */\n#ifndef " + guard + "\n#define " + guard +
            "\n\n#include \"gpom/params.h\"\n\n"
            "#if defined(__cplusplus) && defined(__GNUC__)\n"
            "#pragma GCC system_header /* `.field =` also in C++ before 2020, without warning */\n"
            "#endif\n\n";
    text += "static const gpom_params_t gpom_params_" + name + " = {\n" + initialiser(params);
    return text + "};\n\n#endif\n";
}

std::string params_record(const gpom_params_t &params)
{
    require_good(params);
    std::uint8_t record[GPOM_PARAMS_RECORD_BYTES];
    const gpom_status_t status = gpom_params_save(&params, record);
    if (status != GPOM_OK) {
        throw std::runtime_error(std::string("record: ") + gpom_status_str(status));
    }
    return {record, record + sizeof record};
}

} // namespace gpom_tools
