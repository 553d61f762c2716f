// Values of the configuration file that have limits and a default.
#ifndef GPOM_LINUX_CONFIG_VALUES_HPP
#define GPOM_LINUX_CONFIG_VALUES_HPP

#include "ports/host/toml_table.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

namespace gpomd
{

/// What to do about a key that gpomd does not know.
constexpr char kRemove[] = "; remove it";

struct Range {
    double low, high;
};

/// A number within a range. The key is required.
double number_in(const gpom_tools::TomlTable &table, const std::string &key, const Range &range);

// `otherwise` is the default for an absent key.

double number_or(const gpom_tools::TomlTable &table, const std::string &key, double otherwise,
                 const Range &range);
std::int64_t whole_or(const gpom_tools::TomlTable &table, const std::string &key,
                      std::int64_t otherwise, std::int64_t low, std::int64_t high);
bool truth_or(const gpom_tools::TomlTable &table, const std::string &key, bool otherwise);

std::int64_t microseconds(double seconds);

/// A number of seconds in the file, in microseconds.
std::int64_t seconds_or(const gpom_tools::TomlTable &table, const std::string &key,
                        double otherwise_s, const Range &range_s);

template <class Type> struct Named {
    const char *name;
    Type type;
};

/// What the word of a key names. The key is required.
template <class Type, std::size_t N>
Type choice_of(const gpom_tools::TomlTable &table, const std::string &key,
               const Named<Type> (&types)[N])
{
    const std::string word = table.word(key);
    std::string names;
    for (const Named<Type> &named : types) {
        if (word == named.name) {
            return named.type;
        }
        names += (names.empty() ? "" : ", ") + std::string(named.name);
    }
    table.fail(key, key + ": \"" + word + "\" is not one of " + names);
}

} // namespace gpomd

#endif
