#include "src/beams/reindex.hpp"

namespace gpom
{

namespace
{

/// Boxes around the present parts of the beams of a block.
void include_again(const Index &index, RecentBlock &block)
{
    block.hits = empty_box();
    block.free = empty_box();
    for (uint32_t i = 0; i < kRecentBlock; ++i) {
        const Beam &beam = index.beams[block.slots[i]];
        if (beam.id != block.number * kRecentBlock + i || !is_kept(beam)) {
            continue;
        }
        if (has_hit(beam)) {
            include(block.hits, index.hit_part(beam));
        }
        if (beam.has_free != 0) {
            include(block.free, index.free_part(beam));
        }
    }
}

} // namespace

void restart_index(Index &index)
{
    for (uint32_t i = 0; i < index.n_recent_max; ++i) {
        if (index.recent[i].number != kNoSlot) {
            include_again(index, index.recent[i]);
        }
    }
    index.hit_tree.n_items = 0;
    index.hit_tree.id_end = 0;
    index.free_tree.n_items = 0;
    index.free_tree.id_end = 0;
    start_build(index);
}

} // namespace gpom
