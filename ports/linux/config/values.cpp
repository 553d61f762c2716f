#include "ports/linux/config/values.hpp"

#include <cmath>
#include <cstdio>

namespace gpomd
{

using gpom_tools::TomlTable;

double number_in(const TomlTable &table, const std::string &key, const Range &range)
{
    const double value = table.number(key);
    if (!(value >= range.low && value <= range.high)) {
        char text[80];
        std::snprintf(text, sizeof text, ": must be from %g to %g", range.low, range.high);
        table.fail(key, key + text);
    }
    return value;
}

double number_or(const TomlTable &table, const std::string &key, double otherwise,
                 const Range &range)
{
    return table.has(key) ? number_in(table, key, range) : otherwise;
}

std::int64_t whole_or(const TomlTable &table, const std::string &key, std::int64_t otherwise,
                      std::int64_t low, std::int64_t high)
{
    return table.has(key) ? table.whole(key, low, high) : otherwise;
}

bool truth_or(const TomlTable &table, const std::string &key, bool otherwise)
{
    return table.has(key) ? table.truth(key) : otherwise;
}

std::int64_t microseconds(double seconds) { return std::llround(1e6 * seconds); }

std::int64_t seconds_or(const TomlTable &table, const std::string &key, double otherwise_s,
                        const Range &range_s)
{
    return microseconds(number_or(table, key, otherwise_s, range_s));
}

} // namespace gpomd
