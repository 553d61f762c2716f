/// \file reindex.hpp
/// The index of beams that all moved at once.
#pragma once

#include "src/beams/index.hpp"

namespace gpom
{

/// All beams may have moved: no tree knows any of them until the trees are built anew, which starts
/// now. Searches are exact at once, because they look at every beam. Cost: O(recent_capacity()).
void restart_index(Index &index);

} // namespace gpom
