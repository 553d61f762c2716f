#include "src/beams/index.hpp"

#include "src/base/assert.hpp"

namespace gpom
{

namespace
{

/// Distance from a place to the line that a beam lies on.
float distance_to_line(const Point &at, const Beam &beam)
{
    return lane::abs((at.x_m - beam.x_m) * beam.dir_y - (at.y_m - beam.y_m) * beam.dir_x);
}

/// True if so many beams are recent, or so many parts vanished, that searches get slower.
bool is_worth_building(const Index &index)
{
    const uint32_t n_recent = index.next_id - index.free_tree.id_end;
    return n_recent >= kRebuildMin || index.n_vanished >= kRebuildMin + index.n_beams / 8;
}

/// Count a part that the slot's beam has lost. A slot whose beam has no part left becomes vacant.
void vanish(Index &index, uint32_t slot)
{
    Beam &beam = index.beams[slot];
    ++index.n_vanished;
    if (!has_hit(beam) && beam.has_free == 0) {
        next_vacant(beam) = index.first_vacant;
        index.first_vacant = slot;
        --index.n_beams;
    }
}

/// One pass of a merge sort of the list of vacant slots, up to the slot `end`. Sorted runs of
/// `width` slots are merged in pairs. Returns the number of pairs.
uint32_t merge_runs(Index &index, uint32_t width, uint32_t end)
{
    uint32_t n_pairs = 0;
    uint32_t *tail = &index.first_vacant;
    for (uint32_t left = index.first_vacant; left != end; ++n_pairs) {
        uint32_t right = left;
        uint32_t n_left = 0;
        for (; n_left < width && right != end; ++n_left) {
            right = next_vacant(index.beams[right]);
        }
        uint32_t n_right = width;
        while (n_left > 0 || (n_right > 0 && right != end)) {
            const bool is_left = n_left > 0 && (n_right == 0 || right == end || left < right);
            uint32_t &from = is_left ? left : right;
            --(is_left ? n_left : n_right);
            *tail = from;
            tail = &next_vacant(index.beams[from]);
            from = *tail;
        }
        left = right;
    }
    *tail = end;
    return n_pairs;
}

/// List the slots of the beams that have this part, until the budget or the store ends. Returns the
/// number of slots looked at.
template <class Part> uint32_t list_some(Index &index, uint32_t budget)
{
    KdTree &tree = index.spare;
    uint32_t used = 0;
    for (; index.i_slot < index.n_slots && used < budget; ++index.i_slot, ++used) {
        const Beam &beam = index.beams[index.i_slot];
        if (Part::is_in(beam) && beam.id < tree.id_end) {
            tree.slots[tree.n_items++] = index.i_slot;
        }
    }
    return used;
}

void start_listing(Index &index, BuildPhase phase)
{
    index.phase = phase;
    index.i_slot = 0;
    index.spare.n_items = 0;
    index.spare.id_end = index.next_id;
}

/// The tree that was built takes the place of the old tree. The next build will use the memory of
/// the old tree.
void trade(KdTree &old, KdTree &built)
{
    const KdTree kept = old;
    old = built;
    built = kept;
}

/// Do one slice of listing or splitting. When a phase is complete, the next phase starts.
uint32_t run_phase(Index &index, uint32_t budget)
{
    const bool hits = index.phase == BuildPhase::kListHits || index.phase == BuildPhase::kSplitHits;
    if (index.phase == BuildPhase::kListHits || index.phase == BuildPhase::kListFree) {
        const uint32_t used =
            hits ? list_some<HitPart>(index, budget) : list_some<FreePart>(index, budget);
        if (index.i_slot == index.n_slots) {
            start_build(index.build, index.spare);
            index.phase = hits ? BuildPhase::kSplitHits : BuildPhase::kSplitFree;
        }
        return used;
    }
    const uint32_t used = hits ? build_some(index.build, index.spare, index.hit_part, budget)
                               : build_some(index.build, index.spare, index.free_part, budget);
    if (is_done(index.build)) {
        trade(hits ? index.hit_tree : index.free_tree, index.spare);
        index.phase = BuildPhase::kIdle;
        if (hits) {
            start_listing(index, BuildPhase::kListFree);
        }
    }
    return used;
}

/// A box relative to another origin. It is widened by the distance that rounding may have moved its
/// items. An empty box stays empty.
Box shifted(const Box &box, float dx_m, float dy_m)
{
    if (box.x_min_m > box.x_max_m) {
        return box;
    }
    const float reach_m = lane::abs(box.x_min_m) + lane::abs(box.y_min_m) + lane::abs(box.x_max_m) +
                          lane::abs(box.y_max_m) + lane::abs(dx_m) + lane::abs(dy_m);
    const float slack_m = kBoxSlack * reach_m;
    return {box.x_min_m - dx_m - slack_m, box.y_min_m - dy_m - slack_m,
            box.x_max_m - dx_m + slack_m, box.y_max_m - dy_m + slack_m};
}

} // namespace

void forget_all(Index &index)
{
    ++index.n_forgotten;
    index.next_id = 0;
    index.n_slots = 0;
    index.n_beams = 0;
    index.first_vacant = kNoSlot;
    index.n_vanished = 0;
    index.phase = BuildPhase::kIdle;
    index.hit_tree.n_items = 0;
    index.hit_tree.id_end = 0;
    index.free_tree.n_items = 0;
    index.free_tree.id_end = 0;
}

void reset_recent(Index &index, uint32_t i)
{
    index.recent[i] = {};
    index.recent[i].number = kNoSlot;
}

void remember(Index &index, uint32_t slot)
{
    const Beam &beam = index.beams[slot];
    const uint32_t number = beam.id / kRecentBlock;
    RecentBlock &block = index.recent[number % index.n_recent_max];
    if (beam.id % kRecentBlock == 0) { // its old contents may belong to ids before forget_all()
        block = {};
        block.number = number;
        block.hits = empty_box();
        block.free = empty_box();
    }
    block.slots[beam.id % kRecentBlock] = slot;
    if (has_hit(beam)) {
        include(block.hits, index.hit_part(beam));
    }
    if (beam.has_free != 0) {
        include(block.free, index.free_part(beam));
    }
}

uint32_t insert(Index &index, const Beam &beam)
{
    GPOM_ASSERT(!is_full(index) && index.next_id < kIdEnd);
    uint32_t slot = index.first_vacant;
    if (slot != kNoSlot) {
        index.first_vacant = next_vacant(index.beams[slot]);
    } else {
        slot = index.n_slots++;
    }
    index.beams[slot] = beam;
    index.beams[slot].id = index.next_id;
    ++index.next_id;
    remember(index, slot);
    ++index.n_beams;
    return slot;
}

void remove_hit(Index &index, uint32_t slot)
{
    GPOM_ASSERT(has_hit(index.beams[slot]));
    index.beams[slot].hit = kNoHit;
    vanish(index, slot);
}

void remove_free(Index &index, uint32_t slot)
{
    GPOM_ASSERT(index.beams[slot].has_free != 0);
    index.beams[slot].has_free = 0;
    vanish(index, slot);
}

void remove_beam(Index &index, uint32_t slot)
{
    index.beams[slot].hit = kNoHit;
    index.beams[slot].has_free = 0;
    vanish(index, slot);
}

bool is_near_free(const Index &index, Subtree *stack, const Point &at, float reach_m)
{
    const Area around(widened({at.x_m, at.y_m, at.x_m, at.y_m}, reach_m));
    const Offset<float> from = {at.x_m, at.y_m};
    return !traverse(
        index, index.free_part, {stack, index.next_id},
        [&](const Box &box) { return around.touches(box); },
        [&](uint32_t slot) {
            const Beam &beam = index.beams[slot];
            if (distance_to_line(at, beam) > 1.01f * reach_m) { // most segments; more for rounding
                return true;
            }
            return !(distance2(from, index.free_part, beam) < reach_m * reach_m);
        });
}

void sort_vacated(Index &index, uint32_t before)
{
    for (uint32_t width = 1; merge_runs(index, width, before) > 1; width *= 2) {
    }
}

void shift_origin(Index &index, float dx_m, float dy_m)
{
    for (uint32_t slot = 0; slot < index.n_slots; ++slot) {
        index.beams[slot].x_m -= dx_m;
        index.beams[slot].y_m -= dy_m;
    }
    KdTree *const trees[2] = {&index.hit_tree, &index.free_tree};
    for (KdTree *tree : trees) {
        for (uint32_t i = 0; tree->n_items > 0 && i + 1 < node_count(tree->n_items); ++i) {
            tree->boxes[i] = shifted(tree->boxes[i], dx_m, dy_m);
        }
    }
    for (uint32_t i = 0; i < index.n_recent_max; ++i) {
        index.recent[i].hits = shifted(index.recent[i].hits, dx_m, dy_m);
        index.recent[i].free = shifted(index.recent[i].free, dx_m, dy_m);
    }
    index.phase = BuildPhase::kIdle;
}

void start_build(Index &index)
{
    index.n_vanished = 0;
    start_listing(index, BuildPhase::kListHits);
}

uint32_t build_some(Index &index, uint32_t budget)
{
    if (!is_building(index) && is_worth_building(index)) {
        start_build(index);
    }
    uint32_t used = 0;
    while (is_building(index) && used < budget) {
        used += run_phase(index, budget - used);
    }
    return used;
}

void index_long_scan(Index &index, uint32_t first_id)
{
    const uint32_t id_end = index.hit_tree.id_end;
    if (index.next_id - (id_end > first_id ? id_end : first_id) >= kUnindexedMax) {
        build_some(index, UINT32_MAX);
    }
}

} // namespace gpom
