/// \file index.hpp
/// The beams of a map, and the trees that find them while beams come and go.
///
/// There are two static KD-trees, one over hits and one over free segments. Each tree knows the
/// beams up to an id. Younger beams are recent: every search looks at them one by one. When enough
/// beams are recent or gone, the trees are built anew in slices, one tree after the other. Each is
/// built in the memory of a third tree, which then trades places with the old tree. Searches are
/// exact at every moment.
///
/// A slot that a tree lists may have lost its beam and got another beam since. Ids only grow, so
/// that the other beam has an id that the tree does not know, and the tree ignores the beam.
#pragma once

#include "src/beams/kdtree.hpp"
#include "src/beams/nearest.hpp"

namespace gpom
{

/// In place of a slot: none.
constexpr uint32_t kNoSlot = UINT32_MAX;

/// All ids are less than this, because lanes compare ids as signed numbers.
constexpr uint32_t kIdEnd = static_cast<uint32_t>(kNoId);

/// With fewer recent beams or vanished parts than this, building does not start.
constexpr uint32_t kRebuildMin = 32;

/// The phases of building the trees, in their order.
enum class BuildPhase : uint32_t { kIdle, kListHits, kSplitHits, kListFree, kSplitFree };

/// Number of consecutive ids whose recent beams share a box. These beams are mostly neighbours in
/// a scan.
constexpr uint32_t kRecentBlock = 16;

/// Beams with the ids [kRecentBlock number, kRecentBlock (number + 1)).
struct RecentBlock {
    uint32_t number;
    uint32_t slots[kRecentBlock];
    Box hits, free; ///< Boxes around all hits and free segments of the beams that were entered.
};

struct Index {
    Beam *beams; ///< beam_max slots.
    uint32_t beam_max;
    uint32_t n_slots;      ///< Slots ever used: [0, n_slots).
    uint32_t n_beams;      ///< Slots that hold a beam.
    uint32_t first_vacant; ///< Start of the list of vacant slots (next_vacant()). kNoSlot ends it.
    uint32_t next_id;
    uint32_t n_forgotten; ///< How often all beams were forgotten.
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

/// At most this many beams of one scan are recent (scan.h).
constexpr uint32_t kUnindexedMax = 2048;

/// Entries of Index::recent for a map of beam_max beams.
constexpr uint32_t recent_capacity(uint32_t beam_max)
{
    return (beam_max / 8 + kRebuildMin) / kRecentBlock + 1;
}

/// Forget all beams. Ids start again at 0.
void forget_all(Index &index);

/// Put a beam into the store under the next id. Returns its slot. The store must have room, and
/// next_id must be less than kIdEnd.
uint32_t insert(Index &index, const Beam &beam);

inline bool is_full(const Index &index)
{
    return index.first_vacant == kNoSlot && index.n_slots == index.beam_max;
}

/// Empty the entry of Index::recent at `i`.
void reset_recent(Index &index, uint32_t i);

/// Enter a beam of the store into its block of recent beams. Beams must be entered in the order of
/// their ids, without a missing id.
void remember(Index &index, uint32_t slot);

/// Remove a part of a beam, or both parts. If no part is left, the slot becomes vacant.
void remove_hit(Index &index, uint32_t slot);
void remove_free(Index &index, uint32_t slot);
void remove_beam(Index &index, uint32_t slot);

/// Sort the slots that became vacant since the first vacant slot was `before`. A traversal of a
/// tree vacates slots in the order of the tree. The slots of new beams must not depend on this
/// order, because it depends on how far building the trees has come. Cost: O(n log n) for n slots
/// that became vacant.
void sort_vacated(Index &index, uint32_t before);

/// Move the origin by (dx_m, dy_m). All coordinates change to the new origin, and a build in
/// progress is given up.
void shift_origin(Index &index, float dx_m, float dy_m);

/// Continue building for at most `budget` operations, or start if enough has changed. Operations
/// are those of build_some() in kdtree.hpp, and each slot that is listed is one more. Returns the
/// number of operations used. 0: there is nothing to build.
uint32_t build_some(Index &index, uint32_t budget);

/// Build the trees over all beams if kUnindexedMax beams of the scan that begins at first_id are
/// recent. Each traversal looks at all recent beams, so that otherwise the cost of a long scan
/// would grow with the square of its length.
void index_long_scan(Index &index, uint32_t first_id);

/// Start building, even if little has changed. A build in progress is given up.
void start_build(Index &index);

inline bool is_building(const Index &index) { return index.phase != BuildPhase::kIdle; }

inline const KdTree &tree_of(const Index &index, const HitPart &) { return index.hit_tree; }
inline const KdTree &tree_of(const Index &index, const FreePart &) { return index.free_tree; }

inline const Box &box_of(const RecentBlock &block, const HitPart &) { return block.hits; }
inline const Box &box_of(const RecentBlock &block, const FreePart &) { return block.free; }

/// Visit the slots of the beams of a block whose ids are in a range, the youngest first. Visiting
/// ends when visit(slot) returns false; then this returns false too.
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

/// Visit the slots of recent beams, with ids in a range, that may have a part of this kind, the
/// youngest first. Only blocks are visited for whose box touches(box) is true. If there are more
/// recent beams than the blocks hold, all recent beams are visited, in the order of their slots.
/// Visiting ends when visit(slot) returns false; then this returns false too.
template <class Part, class Touches, class Visit>
bool for_each_recent(const Index &index, const IdRange &ids, const Part &part,
                     const Touches &touches, const Visit &visit)
{
    if (index.next_id - ids.first > (index.n_recent_max - 1) * kRecentBlock) {
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

/// What a traversal needs besides the index.
struct Scope {
    Subtree *stack;  ///< kDepthMax entries.
    uint32_t id_end; ///< Beams with this id or a greater one are left out.
};

/// Visit the slots of all beams in scope that have this part and may lie in a box for which
/// touches(box) is true. Beams of the tree come first, then recent beams. Visiting ends when
/// visit(slot) returns false; then this returns false too.
///
/// Both children of a node are compared before one of them is entered, so that the stack holds
/// only subtrees that will be visited. The box of the root is not compared.
template <class Part, class Touches, class Visit>
bool traverse(const Index &index, const Part &part, const Scope &scope, const Touches &touches,
              const Visit &visit)
{
    const KdTree &tree = tree_of(index, part);
    const uint32_t tree_end = scope.id_end < tree.id_end ? scope.id_end : tree.id_end;
    const auto visit_member = [&](uint32_t slot) {
        return !Part::is_in(index.beams[slot]) || visit(slot);
    };
    uint32_t depth = tree.n_items > 0 ? 1 : 0;
    scope.stack[0] = root_of(tree);
    while (depth > 0) {
        Subtree t = scope.stack[--depth];
        bool is_near = true;
        while (is_near && t.n_leaves > 1) {
            const Subtree left = left_of(t);
            const Subtree right = right_of(t);
            const bool is_right_near = touches(tree.boxes[right.node]);
            is_near = touches(tree.boxes[left.node]);
            t = is_near ? left : right;
            if (is_near && is_right_near) {
                scope.stack[depth++] = right;
            }
            is_near = is_near || is_right_near;
        }
        const Stretch slots = is_near ? slots_of(tree, t) : Stretch{0, 0};
        for (uint32_t i = slots.first; i < slots.first + slots.n; ++i) {
            const uint32_t slot = tree.slots[i];
            if (index.beams[slot].id < tree_end && !visit_member(slot)) {
                return false;
            }
        }
    }
    return for_each_recent(index, {tree_end, scope.id_end}, part, touches, visit_member);
}

/// True if a free segment is nearer to a place than reach_m.
bool is_near_free(const Index &index, Subtree *stack, const Point &at, float reach_m);

/// Find the k nearest parts of one kind among all beams. Returns false if the walks down the tree
/// were too few to find all of them. Recent beams are never missed.
template <class F, class Part>
bool search(NearestK<F> &nearest, const Offset<F> &at, const Index &index, const Part &part,
            const Walks &walks)
{
    const KdTree &tree = tree_of(index, part);
    const bool is_whole = search_tree(nearest, at, part, tree, walks);
    for_each_recent(
        index, {tree.id_end, index.next_id}, part,
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
