// Problems and drops in the words of the log.
#ifndef GPOM_LINUX_WORDS_HPP
#define GPOM_LINUX_WORDS_HPP

#include "ports/linux/config/config.hpp"
#include "ports/linux/config/problems.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

namespace gpomd
{

/// A counter of dropped data.
struct Drop {
    std::size_t place;  ///< For example GPOM_WIRE_SCANS_LOST.
    const char *name;   ///< Name in the log: "lost" gives "3 lost".
    std::int32_t kind;  ///< GPOM_WIRE_PROBLEM_... to note when the counter rises. -1: the part that
                        ///< counts notes the problem.
    const char *remedy; ///< What to do. Static storage, NULL if kind is -1.
};

/// All drop counters that the log reports. Fragments of messages too long for gpomd are not
/// reported, because they belong to other programs or to gpomd's own grid.
constexpr std::size_t kDropCount = 39;
extern const Drop kDrops[kDropCount];

/// One sentence for a problem: channel, type, value, and what to do.
std::string sentence(const Problem &problem, const Config &config);

} // namespace gpomd

#endif
