/// \file index.hpp
/// The beams of a map and where to find them, while they come and go.
///
/// Two static KD-trees, over hits and over free segments, know the beams up to an id each; younger
/// beams are recent, and every search looks at them one by one. When enough is recent or gone, the
/// trees are built anew in slices: one after the other in the memory of a third, which then trades
/// places with the old one. Searches are exact at every moment.
///
/// A slot that a tree lists may have lost its beam and got another since; ids only grow, so that a
/// beam whose id the tree does not know is not its own.
#pragma once

#include "src/beams/kdtree.hpp"
#include "src/beams/nearest.hpp"

namespace gpom
{

/// No slot.
constexpr uint32_t kNoSlot = UINT32_MAX;

/// Ids stay below: the lanes compare them as signed numbers.
constexpr uint32_t kIdEnd = static_cast<uint32_t>(kNoId);

/// Recent or vanished beams for which building is worth starting.
constexpr uint32_t kRebuildMin = 32;

/// What building is at.
enum class BuildPhase : uint32_t { kIdle, kListHits, kSplitHits, kListFree, kSplitFree };

/// Ids that share a box while they are recent: neighbours in a scan, mostly.
constexpr uint32_t kRecentBlock = 16;

/// Beams with the ids [kRecentBlock number, kRecentBlock (number + 1)).
struct RecentBlock {
    uint32_t number;
    uint32_t slots[kRecentBlock];
    Box hits, free; ///< Around the parts of the beams that were entered.
};

struct Index {
    Beam *beams; ///< beam_max slots.
    uint32_t beam_max;
    uint32_t n_slots;      ///< Slots ever used: [0, n_slots).
    uint32_t n_beams;      ///< Slots that hold a beam.
    uint32_t first_vacant; ///< First of the list of vacant slots (next_vacant()); kNoSlot ends it.
    uint32_t next_id;
    uint32_t n_forgotten; ///< Times that all beams were forgotten.
    RecentBlock *recent;  ///< The youngest blocks, each at number % n_recent_max.
    uint32_t n_recent_max;
    uint32_t n_vanished; ///< Parts removed since the last build started.
    HitPart hit_part;
    FreePart free_part;
    KdTree hit_tree, free_tree;
    KdTree spare; ///< Where the next tree is built.
    BuildPhase phase;
    uint32_t i_slot; ///< Slots listed so far.
    TreeBuild build;
};

/// Most beams of one scan that are not indexed (scan.h).
constexpr uint32_t kUnindexedMax = 2048;

/// Entries of Index::recent for a map of beam_max beams.
constexpr uint32_t recent_capacity(uint32_t beam_max)
{
    return (beam_max / 8 + kRebuildMin) / kRecentBlock + 1;
}

/// Forget all beams; ids start again at 0.
void forget_all(Index &index);

/// Put a beam into the store under the next id. The store must have room, and ids.
/// Returns its slot.
uint32_t insert(Index &index, const Beam &beam);

inline bool is_full(const Index &index)
{
    return index.first_vacant == kNoSlot && index.n_slots == index.beam_max;
}

/// Empty the entry of Index::recent at `i`.
void reset_recent(Index &index, uint32_t i);

/// Enter a beam of the store into its block of recent ones. Ids come one after the other.
void remember(Index &index, uint32_t slot);

/// Take a part of a beam away. Without any part its slot is vacant.
void remove_hit(Index &index, uint32_t slot);
void remove_free(Index &index, uint32_t slot);
void remove_beam(Index &index, uint32_t slot);

/// Sort the slots that became vacant since the first vacant one was `before`. A walk over a tree
/// vacates them in the tree's order, but the slots of new beams must not depend on how far building
/// the trees is. Cost: O(n log n) for n such slots.
void sort_vacated(Index &index, uint32_t before);

/// The origin moves by (dx_m, dy_m): all coordinates follow, and what is being built is dropped.
void shift_origin(Index &index, float dx_m, float dy_m);

/// Go on building, or start if it is worth it, for at most `budget` operations (see build_some();
/// listing a slot is one). Returns those used; 0: nothing to do.
uint32_t build_some(Index &index, uint32_t budget);

/// Index all beams once those of one scan, from first_id on, that are not indexed are
/// kUnindexedMax: each walk looks at them all, so that the cost of a long scan would grow with the
/// square of its length.
void index_long_scan(Index &index, uint32_t first_id);

/// Start building whether it is worth it or not, dropping what was under way.
void start_build(Index &index);

inline bool is_building(const Index &index) { return index.phase != BuildPhase::kIdle; }

inline const KdTree &tree_of(const Index &index, const HitPart &) { return index.hit_tree; }
inline const KdTree &tree_of(const Index &index, const FreePart &) { return index.free_tree; }

inline const Box &box_of(const RecentBlock &block, const HitPart &) { return block.hits; }
inline const Box &box_of(const RecentBlock &block, const FreePart &) { return block.free; }

/// Visit the slots of a block's beams whose ids are in a range, the youngest first, while
/// visit(slot) is true. False if a visit was not.
template <class Visit>
bool for_each_of_block(const Index &index, const RecentBlock &block, const IdRange &ids,
                       const Visit &visit)
{
    for (uint32_t id = ids.end; id > ids.first;) {
        const uint32_t slot = block.slots[--id % kRecentBlock];
        if (index.beams[slot].id == id && !visit(slot)) {
            return false;
        }
    }
    return true;
}

/// Visit the slots of the recent beams that may have a part of this kind in touches(box), the
/// youngest first, while visit(slot) is true: those in blocks whose box does, or, once the recent
/// are more than the blocks hold, the whole store. False if a visit was not.
template <class Part, class Touches, class Visit>
bool for_each_recent(const Index &index, const Part &part, const Touches &touches,
                     const Visit &visit)
{
    const IdRange ids = {tree_of(index, part).id_end, index.next_id};
    if (ids.end - ids.first > (index.n_recent_max - 1) * kRecentBlock) {
        for (uint32_t slot = 0; slot < index.n_slots; ++slot) {
            if (ids.has(index.beams[slot].id) && !visit(slot)) {
                return false;
            }
        }
        return true;
    }
    for (uint32_t end = ids.end; end > ids.first;) {
        const uint32_t number = (end - 1) / kRecentBlock;
        const uint32_t block_first = number * kRecentBlock;
        const uint32_t first = block_first > ids.first ? block_first : ids.first;
        const RecentBlock &block = index.recent[number % index.n_recent_max];
        if (block.number == number && touches(box_of(block, part)) &&
            !for_each_of_block(index, block, {first, end}, visit)) {
            return false;
        }
        end = first;
    }
    return true;
}

/// Visit the slots of a kind that may satisfy touches(box), while visit(slot) is true: those of the
/// tree's boxes that do, then the recent ones. Visited slots hold a beam with this part. False if a
/// visit was not.
template <class Part, class Touches, class Visit>
bool walk(const Index &index, const Part &part, Subtree *stack, const Touches &touches,
          const Visit &visit)
{
    const KdTree &tree = tree_of(index, part);
    const auto visit_member = [&](uint32_t slot) {
        return !Part::is_in(index.beams[slot]) || visit(slot);
    };
    uint32_t depth = 0;
    if (tree.n_items > 0) {
        stack[depth++] = root_of(tree);
    }
    while (depth > 0) {
        Subtree t = stack[--depth];
        bool is_near = touches(tree.boxes[t.node]);
        while (is_near && t.n_leaves > 1) {
            stack[depth++] = right_of(t);
            t = left_of(t);
            is_near = touches(tree.boxes[t.node]);
        }
        const Stretch slots = is_near ? slots_of(tree, t) : Stretch{0, 0};
        for (uint32_t i = slots.first; i < slots.first + slots.n; ++i) {
            const uint32_t slot = tree.slots[i];
            if (index.beams[slot].id < tree.id_end && !visit_member(slot)) {
                return false;
            }
        }
    }
    return for_each_recent(index, part, touches, visit_member);
}

/// True if a place is nearer than reach_m to a free segment.
bool is_near_free(const Index &index, Subtree *stack, const Point &at, float reach_m);

/// The k nearest parts of one kind among all beams. Returns false if the walks down the tree did
/// not suffice; recent beams are all looked at.
template <class F, class Part>
bool search(NearestK<F> &nearest, const Offset<F> &at, const Index &index, const Part &part,
            const Walks &walks)
{
    const KdTree &tree = tree_of(index, part);
    const bool is_whole = search_tree(nearest, at, part, tree, walks);
    for_each_recent(
        index, part,
        [&](const Box &box) {
            return lane::any(box_distance2(box, at.x_m, at.y_m) <= box_reach2(nearest.worst()));
        },
        [&](uint32_t slot) {
            offer_beam(nearest, at, part, {index.beams, slot, {tree.id_end, index.next_id}});
            return true;
        });
    return is_whole;
}

} // namespace gpom
