// Finds the known word that a mistyped word probably means, for "did you mean".
#ifndef GPOM_PORTS_HOST_NEAREST_WORD_HPP
#define GPOM_PORTS_HOST_NEAREST_WORD_HPP

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

namespace gpom_tools
{

/// Number of letters to insert, delete, replace or swap with their neighbour to change one word
/// into the other.
inline std::size_t edit_distance(const std::string &from, const std::string &to)
{
    const std::size_t width = to.size() + 1;
    std::vector<std::size_t> cost((from.size() + 1) * width);
    for (std::size_t i = 0; i <= from.size(); ++i) {
        for (std::size_t j = 0; j <= to.size(); ++j) {
            std::size_t &here = cost[i * width + j];
            if (i == 0 || j == 0) {
                here = i + j;
                continue;
            }
            const std::size_t is_other = from[i - 1] != to[j - 1] ? 1 : 0;
            here = std::min({cost[(i - 1) * width + j] + 1, cost[i * width + j - 1] + 1,
                             cost[(i - 1) * width + j - 1] + is_other});
            if (i > 1 && j > 1 && from[i - 1] == to[j - 2] && from[i - 2] == to[j - 1]) {
                here = std::min(here, cost[(i - 2) * width + j - 2] + 1);
            }
        }
    }
    return cost.back();
}

/// The nearest of the known words. Empty: no word is near enough.
template <class Words> std::string nearest_word(const std::string &word, const Words &known)
{
    std::string nearest;
    std::size_t least = std::max<std::size_t>(1, word.size() / 3) + 1;
    for (const std::string &candidate : known) {
        const std::size_t distance = edit_distance(word, candidate);
        if (distance < least) {
            least = distance;
            nearest = candidate;
        }
    }
    return nearest;
}

} // namespace gpom_tools

#endif
