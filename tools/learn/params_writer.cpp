#include "tools/learn/params_writer.hpp"

#include "ports/host/params_toml.hpp"
#include "ports/host/text_lines.hpp"

#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

namespace gpom_tools
{
namespace
{

constexpr const char *kLogWeightNames[] = {"log_hit_first", "log_hit_last", "log_free_first",
                                           "log_free_last"};

struct Entry {
    std::string name;
    std::string value; ///< The text of the value, the same in both formats.
    bool whole;
};

/// Six digits are as exact as learning is. They read back to the same float from any file.
std::string number_text(double value)
{
    char digits[40];
    std::snprintf(digits, sizeof digits, "%.6g", value);
    std::string text = digits;
    if (text.find_first_of(".e") == std::string::npos) {
        text += ".0";
    }
    return text;
}

/// Every parameter that is not neutral, with its TOML name, in the order of a parameters file.
std::vector<Entry> entries_of(const LearntParams &params)
{
    std::vector<Entry> entries;
    const auto real = [&](const char *name, double value) {
        entries.push_back({name, number_text(value), false});
    };
    const auto real_unless_0 = [&](const char *name, double value) {
        if (value != 0.0) {
            real(name, value);
        }
    };
    const auto whole = [&](const char *name, int value) {
        entries.push_back({name, std::to_string(value), true});
    };
    real("sf2", params.sf2);
    if (params.kernel == GPOM_KERNEL_NN) {
        real("s0", params.s0);
        real("s1", params.s1);
    } else {
        real("ell_m", params.ell_m);
    }
    real("sn2", params.sn2);
    real("sn2_free", params.sn2_free);
    real_unless_0("sn2_once", params.sn2_once);
    real("alpha", params.alpha);
    real("beta", params.beta);
    whole("hits", params.n_hits);
    whole("free", params.n_free);
    real("gap_m", params.gap_m);
    real_unless_0("depth_m", params.depth_m);
    if (params.scan_points_max != 0) {
        whole("scan_points_max", params.scan_points_max);
    }
    if (params.n_fading != 0) {
        whole("fading", params.n_fading);
    }
    real_unless_0("anisotropy", params.anisotropy);
    real_unless_0("vote", params.vote);
    real_unless_0("line", params.line);
    real_unless_0("fade_m", params.fade_m);
    real_unless_0("beta_far", params.beta_far);
    for (std::size_t i = 0; i < params.log_weights.size(); ++i) {
        real_unless_0(kLogWeightNames[i], params.log_weights[i]);
    }
    real("p_occupied", params.p_occupied);
    real("p_free", params.p_free);
    return entries;
}

std::string commented(const std::string &comment, const char *mark)
{
    std::string text;
    std::istringstream lines(comment);
    for (std::string line; std::getline(lines, line);) {
        text += std::string(trimmed(std::string(mark) + " " + line)) + "\n";
    }
    return text;
}

const char *kernel_constant(std::int32_t kernel)
{
    constexpr const char *kNames[] = {"GPOM_KERNEL_NN", "GPOM_KERNEL_MATERN12",
                                      "GPOM_KERNEL_MATERN32", "GPOM_KERNEL_SE",
                                      "GPOM_KERNEL_ASKEY"};
    return kNames[kernel];
}

/// The C field for a TOML key.
std::string field_of(const std::string &key)
{
    return key == "hits" || key == "free" || key == "fading" ? "n_" + key : key;
}

} // namespace

std::string params_toml(const LearntParams &params, const std::string &comment)
{
    std::string text = commented(comment, "#");
    text += std::string("kernel = \"") + kernel_name(params.kernel) + "\"\nframe = \"query\"\n";
    for (const Entry &entry : entries_of(params)) {
        text += entry.name + " = " + entry.value + "\n";
    }
    return text;
}

std::string params_header(const LearntParams &params, const std::string &comment)
{
    std::string text = "/* Written by gpom-learn.\n" + commented(comment, " *") + " */\n";
    text += "#ifndef GPOM_PARAMS_LEARNT_H\n"
            "#define GPOM_PARAMS_LEARNT_H\n\n"
            "#include \"gpom/params.h\"\n\n"
            "static inline void gpom_params_learnt(gpom_params_t *params)\n"
            "{\n"
            "    gpom_params_init(params);\n";
    const auto set = [&](const std::string &field, const std::string &value) {
        text += "    params->" + field + " = " + value + ";\n";
    };
    set("kernel", kernel_constant(params.kernel));
    set("frame", "GPOM_FRAME_QUERY");
    for (const Entry &entry : entries_of(params)) {
        set(field_of(entry.name), entry.value + (entry.whole ? "u" : "f"));
    }
    return text + "}\n\n#endif\n";
}

std::string params_record(const LearntParams &params)
{
    const gpom_params_t converted = to_library(params);
    std::uint8_t record[GPOM_PARAMS_RECORD_BYTES];
    const gpom_status_t status = gpom_params_save(&converted, record);
    if (status != GPOM_OK) {
        throw std::runtime_error(std::string("record: ") + gpom_status_str(status));
    }
    return {record, record + sizeof record};
}

} // namespace gpom_tools
