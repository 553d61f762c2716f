#include "tools/lib/params_toml.hpp"

#include "tools/lib/file_error.hpp"

#include <toml++/toml.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <set>
#include <sstream>
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

/// The file's table, with errors that name its lines.
class Reader {
public:
    Reader(std::string path, const toml::table &table) : path_(std::move(path)), table_(table) {}

    [[noreturn]] void fail(const std::string &key, const std::string &text) const
    {
        const toml::node *const node = table_.get(key);
        const int line = node != nullptr ? static_cast<int>(node->source().begin.line) : 0;
        throw FileError(path_, line, text);
    }

    bool has(const std::string &key) const { return table_.contains(key); }

    float number(const std::string &key) const
    {
        require(key);
        const auto value = table_[key].value<double>();
        if (!value) {
            fail(key, key + ": must be a number");
        }
        return static_cast<float>(*value);
    }

    std::uint16_t count(const std::string &key) const
    {
        require(key);
        const auto value = table_[key].value_exact<std::int64_t>();
        if (!value || *value < 0 || *value > static_cast<std::int64_t>(GPOM_POINTS_MAX)) {
            fail(key, key + ": must be a whole number from 0 to 64");
        }
        return static_cast<std::uint16_t>(*value);
    }

    std::string word(const std::string &key) const
    {
        require(key);
        const auto value = table_[key].value<std::string>();
        if (!value) {
            fail(key, key + ": must be a word in quotes");
        }
        return *value;
    }

    void refuse_keys_beyond(const std::set<std::string> &known) const
    {
        for (const auto &[key, node] : table_) {
            const std::string name(key.str());
            if (known.count(name) == 0) {
                fail(name, name + ": unknown key, or not one of this kernel; remove it");
            }
        }
    }

private:
    void require(const std::string &key) const
    {
        if (!has(key)) {
            fail(key, key + ": missing; add it");
        }
    }

    std::string path_;
    const toml::table &table_;
};

gpom_kernel_t kernel_of(const Reader &reader)
{
    const std::string name = reader.word("kernel");
    for (const NamedKernel &named : kKernels) {
        if (name == named.name) {
            return named.kernel;
        }
    }
    reader.fail("kernel",
                "kernel: \"" + name + "\" is not one of nn, matern12, matern32, se, askey");
}

gpom_frame_t frame_of(const Reader &reader)
{
    const std::string name = reader.has("frame") ? reader.word("frame") : "query";
    if (name != "query" && name != "map") {
        reader.fail("frame", "frame: \"" + name + "\" is not one of query, map");
    }
    return name == "map" ? GPOM_FRAME_MAP : GPOM_FRAME_QUERY;
}

std::set<std::string> keys_of(std::int32_t kernel)
{
    std::set<std::string> keys = {"depth_m",
                                  "anisotropy",
                                  "vote",
                                  "fade_m",
                                  "log_hit_first",
                                  "log_hit_last",
                                  "log_free_first",
                                  "log_free_last",
                                  "scan_points_max",
                                  "kernel",
                                  "frame",
                                  "sf2",
                                  "sn2",
                                  "sn2_free",
                                  "alpha",
                                  "beta",
                                  "hits",
                                  "free",
                                  "gap_m",
                                  "p_occupied",
                                  "p_free"};
    if (kernel == GPOM_KERNEL_NN) {
        keys.insert({"s0", "s1"});
    } else {
        keys.insert("ell_m");
    }
    return keys;
}

/// What goes beyond the paper's model; each is neutral where its key is absent.
void read_context(const Reader &reader, gpom_params_t &params)
{
    const std::pair<const char *, float *> numbers[] = {{"depth_m", &params.depth_m},
                                                        {"anisotropy", &params.anisotropy},
                                                        {"vote", &params.vote},
                                                        {"fade_m", &params.fade_m},
                                                        {"log_hit_first", &params.log_hit_first},
                                                        {"log_hit_last", &params.log_hit_last},
                                                        {"log_free_first", &params.log_free_first},
                                                        {"log_free_last", &params.log_free_last}};
    for (const auto &[key, value] : numbers) {
        if (reader.has(key)) {
            *value = reader.number(key);
        }
    }
    if (reader.has("scan_points_max")) {
        params.scan_points_max = reader.count("scan_points_max");
    }
}

gpom_params_t params_from(const Reader &reader)
{
    gpom_params_t params;
    gpom_params_init(&params);
    params.kernel = kernel_of(reader);
    reader.refuse_keys_beyond(keys_of(params.kernel));
    params.frame = frame_of(reader);
    params.sf2 = reader.number("sf2");
    if (params.kernel == GPOM_KERNEL_NN) {
        params.s0 = reader.number("s0");
        params.s1 = reader.number("s1");
    } else {
        params.ell_m = reader.number("ell_m");
    }
    params.sn2 = reader.number("sn2");
    params.sn2_free = reader.has("sn2_free") ? reader.number("sn2_free") : params.sn2;
    params.alpha = reader.number("alpha");
    params.beta = reader.number("beta");
    params.n_hits = reader.count("hits");
    params.n_free = reader.count("free");
    params.gap_m = reader.number("gap_m");
    params.p_occupied = reader.number("p_occupied");
    params.p_free = reader.number("p_free");
    read_context(reader, params);
    return params;
}

toml::table parse(const std::string &path)
{
    std::ifstream stream(path, std::ios::binary);
    if (!stream) {
        throw FileError(path, 0, "cannot open; give the name of a parameters file");
    }
    std::ostringstream text;
    text << stream.rdbuf();
    if (stream.bad() || text.str().empty()) {
        throw FileError(path, 0, "is empty or cannot be read; give a parameters file");
    }
    try {
        return toml::parse(text.str(), path);
    } catch (const toml::parse_error &error) {
        throw FileError(path, static_cast<int>(error.source().begin.line),
                        "not TOML: " + std::string(error.description()));
    }
}

/// The key that a problem text of gpom_params_check() names first.
std::string key_of(const std::string &problem)
{
    return problem.substr(0, problem.find_first_of(":,"));
}

} // namespace

gpom_params_t read_params(const std::string &path)
{
    const toml::table table = parse(path);
    const Reader reader(path, table);
    const gpom_params_t params = params_from(reader);
    const char *problem = nullptr;
    if (gpom_params_check(&params, &problem) != GPOM_OK) {
        reader.fail(key_of(problem), problem);
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
