#include "ports/host/params_toml.hpp"

#include "ports/host/toml_table.hpp"

#include <array>
#include <cstdint>
#include <set>
#include <utility>

namespace gpom_tools
{

namespace
{

struct NamedKernel {
    const char *name;
    gpom_kernel_t kernel;
};

constexpr std::array<NamedKernel, 5> kKernels = {{{"nn", GPOM_KERNEL_NN},
                                                  {"matern12", GPOM_KERNEL_MATERN12},
                                                  {"matern32", GPOM_KERNEL_MATERN32},
                                                  {"se", GPOM_KERNEL_SE},
                                                  {"askey", GPOM_KERNEL_ASKEY}}};

float number(const TomlTable &table, const std::string &key)
{
    return static_cast<float>(table.number(key));
}

std::uint16_t count(const TomlTable &table, const std::string &key, unsigned most)
{
    return static_cast<std::uint16_t>(table.whole(key, 0, most));
}

gpom_kernel_t kernel_of(const TomlTable &table)
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

gpom_frame_t frame_of(const TomlTable &table)
{
    const std::string name = table.has("frame") ? table.word("frame") : "query";
    if (name != "query" && name != "map") {
        table.fail("frame", "frame: \"" + name + "\" is not one of query, map");
    }
    return name == "map" ? GPOM_FRAME_MAP : GPOM_FRAME_QUERY;
}

std::set<std::string> keys_of(std::int32_t kernel)
{
    std::set<std::string> keys = {"depth_m",       "anisotropy",
                                  "vote",          "line",
                                  "fade_m",        "log_hit_first",
                                  "log_hit_last",  "log_free_first",
                                  "log_free_last", "scan_points_max",
                                  "kernel",        "frame",
                                  "sf2",           "sn2",
                                  "sn2_free",      "sn2_once",
                                  "alpha",         "beta",
                                  "beta_far",      "fading",
                                  "hits",          "free",
                                  "gap_m",         "p_occupied",
                                  "p_free"};
    if (kernel == GPOM_KERNEL_NN) {
        keys.insert({"s0", "s1"});
    } else {
        keys.insert("ell_m");
    }
    return keys;
}

/// Read the keys that go beyond the paper's model. An absent key has no effect.
void read_context(const TomlTable &table, gpom_params_t &params)
{
    const std::pair<const char *, float *> numbers[] = {{"depth_m", &params.depth_m},
                                                        {"anisotropy", &params.anisotropy},
                                                        {"vote", &params.vote},
                                                        {"line", &params.line},
                                                        {"fade_m", &params.fade_m},
                                                        {"beta_far", &params.beta_far},
                                                        {"sn2_once", &params.sn2_once},
                                                        {"log_hit_first", &params.log_hit_first},
                                                        {"log_hit_last", &params.log_hit_last},
                                                        {"log_free_first", &params.log_free_first},
                                                        {"log_free_last", &params.log_free_last}};
    for (const auto &[key, value] : numbers) {
        if (table.has(key)) {
            *value = number(table, key);
        }
    }
    if (table.has("scan_points_max")) {
        params.scan_points_max = count(table, "scan_points_max", GPOM_POINTS_MAX);
    }
    if (table.has("fading")) {
        params.n_fading = count(table, "fading", GPOM_SPARSE_POINTS_MAX);
    }
}

gpom_params_t params_from(const TomlTable &table)
{
    gpom_params_t params;
    gpom_params_init(&params);
    params.kernel = kernel_of(table);
    table.refuse_keys_beyond(keys_of(params.kernel), ", or not one of this kernel; remove it");
    params.frame = frame_of(table);
    params.sf2 = number(table, "sf2");
    if (params.kernel == GPOM_KERNEL_NN) {
        params.s0 = number(table, "s0");
        params.s1 = number(table, "s1");
    } else {
        params.ell_m = number(table, "ell_m");
    }
    params.sn2 = number(table, "sn2");
    params.sn2_free = table.has("sn2_free") ? number(table, "sn2_free") : params.sn2;
    params.alpha = number(table, "alpha");
    params.beta = number(table, "beta");
    params.n_hits = count(table, "hits", GPOM_SPARSE_POINTS_MAX);
    params.n_free = count(table, "free", GPOM_SPARSE_POINTS_MAX);
    params.gap_m = number(table, "gap_m");
    params.p_occupied = number(table, "p_occupied");
    params.p_free = number(table, "p_free");
    read_context(table, params);
    return params;
}

/// The key that a text of gpom_params_check() names first.
std::string key_of(const std::string &problem)
{
    return problem.substr(0, problem.find_first_of(":,"));
}

} // namespace

gpom_params_t read_params(const std::string &path)
{
    const toml::table root = parse_toml(path, "parameters");
    const TomlTable table(path, root);
    const gpom_params_t params = params_from(table);
    const char *problem = nullptr;
    if (gpom_params_check(&params, &problem) != GPOM_OK) {
        table.fail(key_of(problem), problem);
    }
    return params;
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

} // namespace gpom_tools
