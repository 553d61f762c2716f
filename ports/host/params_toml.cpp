#include "ports/host/params_toml.hpp"

#include "ports/host/params_fields.hpp"
#include "ports/host/toml_table.hpp"

#include <cctype>
#include <charconv>
#include <cstdint>
#include <set>
#include <stdexcept>

namespace gpom_tools
{

namespace
{

std::int32_t kernel_of(const TomlTable &table)
{
    const std::string name = table.word("kernel");
    for (const NamedKernel &named : kKernels) {
        if (name == named.name) {
            return named.kernel;
        }
    }
    table.fail("kernel",
               "kernel: \"" + name + "\" is not one of nn, matern12, matern32, se, askey");
}

std::int32_t frame_of(const TomlTable &table)
{
    const std::string name = table.has("frame") ? table.word("frame") : "query";
    for (const NamedFrame &named : kFrames) {
        if (name == named.name) {
            return named.frame;
        }
    }
    table.fail("frame", "frame: \"" + name + "\" is not one of query, map");
}

std::set<std::string> keys_of(std::int32_t kernel)
{
    std::set<std::string> keys = {"kernel", "frame"};
    for (const ParamField &field : kParamFields) {
        if (field.is_used_by(kernel)) {
            keys.insert(field.key);
        }
    }
    return keys;
}

void read_field(const TomlTable &table, const ParamField &field, gpom_params_t &params)
{
    const bool is_optional =
        field.presence == Presence::kNeutral || field.presence == Presence::kAsHits;
    if (is_optional && !table.has(field.key)) {
        if (field.number != nullptr) {
            params.*field.number = field.presence == Presence::kAsHits ? params.sn2 : 0.0f;
        } else {
            params.*field.count = 0;
        }
    } else if (field.number != nullptr) {
        params.*field.number = static_cast<float>(table.number(field.key));
    } else {
        params.*field.count =
            static_cast<std::uint16_t>(table.whole(field.key, 0, field.count_max));
    }
}

gpom_params_t params_from(const TomlTable &table)
{
    gpom_params_t params;
    gpom_params_init(&params);
    params.kernel = kernel_of(table);
    table.refuse_keys_beyond(keys_of(params.kernel), ", or not one of this kernel; remove it");
    params.frame = frame_of(table);
    for (const ParamField &field : kParamFields) {
        if (field.is_used_by(params.kernel)) {
            read_field(table, field, params);
        }
    }
    return params;
}

/// The key that a text of gpom_params_check() names first.
std::string key_of(const std::string &problem)
{
    return problem.substr(0, problem.find_first_of(":,"));
}

std::string value_text(const gpom_params_t &params, const std::string &key)
{
    if (key == "kernel") {
        return kernel_name(params.kernel);
    }
    if (key == "frame") {
        return frame_name(params.frame);
    }
    for (const ParamField &field : kParamFields) {
        if (key == field.key) {
            if (field.number == nullptr) {
                return std::to_string(params.*field.count);
            }
            char text[40]; // the fewest digits that read back to the same bits
            return {text, std::to_chars(text, text + sizeof text, params.*field.number).ptr};
        }
    }
    return "";
}

bool is_of_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

} // namespace

gpom_params_t read_params(const std::string &path)
{
    return params_of_toml(path, read_small_file(path, "parameters"));
}

gpom_params_t params_of_toml(const std::string &path, const std::string &text)
{
    const toml::table root = parse_toml_text(path, text);
    const TomlTable table(path, root);
    const gpom_params_t params = params_from(table);
    const char *problem = nullptr;
    if (gpom_params_check(&params, &problem) != GPOM_OK) {
        table.fail(key_of(problem), problem_with_values(params, problem));
    }
    return params;
}

std::string problem_with_values(const gpom_params_t &params, const std::string &problem)
{
    std::string values;
    std::set<std::string> named;
    for (std::size_t i = 0; i < problem.size();) {
        std::size_t end = i;
        while (end < problem.size() && is_of_word(problem[end])) {
            ++end;
        }
        const std::string word = problem.substr(i, end - i);
        const std::string value = value_text(params, word);
        if (!value.empty() && named.insert(word).second) {
            values += (values.empty() ? "" : ", ") + word + " = " + value;
        }
        i = end + 1;
    }
    return problem + (values.empty() ? "" : " (here " + values + ")");
}

void require_good(const gpom_params_t &params)
{
    const char *problem = nullptr;
    if (gpom_params_check(&params, &problem) != GPOM_OK) {
        throw std::runtime_error("these parameters are refused: " +
                                 problem_with_values(params, problem));
    }
}

const char *kernel_name(std::int32_t kernel)
{
    for (const NamedKernel &named : kKernels) {
        if (named.kernel == kernel) {
            return named.name;
        }
    }
    return "unknown";
}

const char *frame_name(std::int32_t frame)
{
    for (const NamedFrame &named : kFrames) {
        if (named.frame == frame) {
            return named.name;
        }
    }
    return "unknown";
}

} // namespace gpom_tools
