// Problems and drops in words of the log.
#ifndef GPOM_LINUX_WORDS_HPP
#define GPOM_LINUX_WORDS_HPP

#include "ports/linux/config/config.hpp"
#include "ports/linux/config/problems.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

namespace gpomd
{

/// A counter of what is dropped.
struct Drop {
    std::size_t place;  ///< GPOM_WIRE_SCANS_LOST, say.
    const char *name;   ///< "3 lost", say.
    std::int32_t kind;  ///< GPOM_WIRE_PROBLEM_... to be noted when it rises; -1: who counts notes.
    const char *remedy; ///< Static storage; NULL if kind is -1.
};

/// All of them. Fragments of messages too long for gpomd are not told: they are others', or of its
/// own grid.
constexpr std::size_t kDropCount = 38;
extern const Drop kDrops[kDropCount];

/// A problem in one sentence: channel, type, value, and what to do.
std::string sentence(const Problem &problem, const Config &config);

} // namespace gpomd

#endif
