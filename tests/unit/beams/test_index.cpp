// The index of a map whose beams come and go: searches against brute force over a copy of the
// beams, at every moment of a random life.
#include "tests/common/reference.hpp"

#include "src/map/map.hpp"

#include <set>

using namespace reference;
using gpom::Index;

namespace
{

constexpr std::uint32_t kBeamMax = 300;
constexpr std::uint32_t kNearest = 8;

gpom_config_t index_config()
{
    gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12), kBeamMax);
    config.params.gap_m = 0.2f;
    config.params.depth_m = 0.3f;
    return config;
}

gpom::Beam random_beam(Random &random)
{
    const double yaw_rad = random.uniform(-4, 4);
    gpom::Beam beam = {};
    beam.x_m = random.uniform_f(-20, 20);
    beam.y_m = random.uniform_f(-20, 20);
    beam.dir_x = static_cast<float>(std::cos(yaw_rad));
    beam.dir_y = static_cast<float>(std::sin(yaw_rad));
    beam.range_m = random.uniform_f(0.05, 15.0);
    beam.returned = random.below(5) != 0 ? 1 : 0;
    if (beam.returned != 0) {
        const std::uint32_t state = random.below(7);
        beam.hit = state == 0 ? gpom::kProvisional : state == 1 ? gpom::kPast : gpom::kStanding;
    }
    beam.has_free = beam.hit == gpom::kNoHit || random.below(9) != 0 ? 1 : 0;
    return beam;
}

struct Ranked {
    float d2;
    std::int32_t id;
    double distance; ///< In double, from the definition.

    bool operator<(const Ranked &o) const { return d2 != o.d2 ? d2 < o.d2 : id < o.id; }
};

/// From a point to the stretch of a beam between two ranges.
double true_distance(const gpom::Beam &b, Xy q, double from_m, double to_m)
{
    const double dir_x = static_cast<double>(b.dir_x), dir_y = static_cast<double>(b.dir_y);
    const double dx = q.x - static_cast<double>(b.x_m), dy = q.y - static_cast<double>(b.y_m);
    const double t = std::clamp(dx * dir_x + dy * dir_y, from_m, to_m);
    return std::hypot(dx - t * dir_x, dy - t * dir_y);
}

double true_distance(const gpom::Beam &b, Xy q, const gpom::HitPart &part)
{
    const double range_m = static_cast<double>(b.range_m);
    return true_distance(b, q, range_m, range_m + static_cast<double>(part.depth_m));
}

double true_distance(const gpom::Beam &b, Xy q, const gpom::FreePart &part)
{
    const double gap_m = b.returned != 0 ? static_cast<double>(part.gap_m) : 0.0;
    return true_distance(b, q, 0.0, std::max(0.0, static_cast<double>(b.range_m) - gap_m));
}

/// An index, a copy of what must be in it by slot, and what happened.
struct Life {
    Index &index;
    Random random;
    std::vector<gpom::Beam> copy;
    std::set<const void *> memories = memories_of();
    int n_overflows = 0, n_reused_in_build = 0, n_full = 0, n_builds = 0;

    Life(Index &index_, std::uint64_t stream) : index(index_), random(stream), copy(kBeamMax) {}

    std::set<const void *> memories_of() const
    {
        return {index.hit_tree.boxes, index.free_tree.boxes, index.spare.boxes,
                index.hit_tree.slots, index.free_tree.slots, index.spare.slots};
    }

    static bool has_part(const gpom::Beam &b) { return gpom::has_hit(b) || b.has_free != 0; }

    void insert_one()
    {
        const gpom::Beam beam = random_beam(random);
        const std::uint32_t id = index.next_id, n_slots = index.n_slots;
        const std::uint32_t slot = gpom::insert(index, beam);
        REQUIRE(slot < kBeamMax);
        REQUIRE_FALSE(has_part(copy[slot])); // nobody's place is taken
        REQUIRE(index.next_id == id + 1);
        copy[slot] = beam;
        copy[slot].id = id;
        n_reused_in_build += gpom::is_building(index) && slot < n_slots ? 1 : 0;
    }

    /// Take a random part of a random beam, or show one that was provisional.
    void change_one()
    {
        std::vector<std::uint32_t> slots;
        for (std::uint32_t slot = 0; slot < kBeamMax; ++slot) {
            if (has_part(copy[slot])) {
                slots.push_back(slot);
            }
        }
        if (slots.empty()) {
            return;
        }
        const std::uint32_t slot = slots[random.below(static_cast<std::uint32_t>(slots.size()))];
        gpom::Beam &beam = copy[slot];
        const std::uint32_t what = random.below(4);
        if (gpom::is_provisional(beam) && random.below(2) == 0) {
            beam.hit = index.beams[slot].hit = gpom::kStanding;
        } else if (what == 0 && gpom::has_hit(beam)) {
            gpom::remove_hit(index, slot);
            beam.hit = gpom::kNoHit;
        } else if (what == 1 && beam.has_free != 0) {
            gpom::remove_free(index, slot);
            beam.has_free = 0;
        } else {
            gpom::remove_beam(index, slot);
            beam.hit = gpom::kNoHit;
            beam.has_free = 0;
        }
    }

    /// One insertion or removal. Times when the store fills alternate with times when it empties.
    void change(int i_change)
    {
        const bool fills = i_change / 700 % 2 == 0;
        n_full += gpom::is_full(index) ? 1 : 0;
        if (!gpom::is_full(index) && random.below(10) < (fills ? 7u : 3u)) {
            insert_one();
        } else {
            change_one();
        }
        const std::uint32_t n_recent = index.next_id - index.free_tree.id_end;
        n_overflows += n_recent > (index.n_recent_max - 1) * gpom::kRecentBlock ? 1 : 0;
    }

    /// A slice of building. For some time nobody builds, or too slowly to keep up.
    void build(int i_change)
    {
        const int pace = i_change / 400 % 4;
        if (pace == 0) {
            return;
        }
        const std::uint32_t budget = pace == 1 ? random.below(12) : random.below(3000);
        const bool was_building = gpom::is_building(index);
        REQUIRE(gpom::build_some(index, budget) <= budget);
        n_builds += was_building && !gpom::is_building(index) ? 1 : 0;
    }

    /// Every slot is a beam's as in the copy, or in the list of free ones exactly once.
    void check_store() const
    {
        std::vector<bool> is_listed(kBeamMax, false);
        std::uint32_t n_free = 0, n_beams = 0;
        for (std::uint32_t slot = index.first_vacant; slot != gpom::kNoSlot;
             slot = index.beams[slot].stamp_ms) {
            REQUIRE(slot < index.n_slots);
            REQUIRE_FALSE(is_listed[slot]);
            is_listed[slot] = true;
            ++n_free;
        }
        bool is_same = true;
        for (std::uint32_t slot = 0; slot < index.n_slots; ++slot) {
            const bool has_beam = has_part(copy[slot]);
            is_same = is_same && has_beam != is_listed[slot] &&
                      (!has_beam ||
                       std::memcmp(&copy[slot], &index.beams[slot], sizeof(gpom::Beam)) == 0);
            n_beams += has_beam ? 1 : 0;
        }
        REQUIRE(is_same);
        REQUIRE(index.n_beams == n_beams);
        REQUIRE(n_beams + n_free == index.n_slots);
        REQUIRE(memories_of() == memories); // three trees, three memories
    }

    template <class Part> std::vector<Ranked> brute_force(Xy q, const Part &part) const
    {
        std::vector<Ranked> all;
        const gpom::Offset<float> at = {static_cast<float>(q.x), static_cast<float>(q.y)};
        const Xy rounded = {static_cast<double>(at.x_m), static_cast<double>(at.y_m)};
        for (const gpom::Beam &beam : copy) {
            if (Part::is_seen(beam)) {
                all.push_back({gpom::distance2(at, part, beam), static_cast<std::int32_t>(beam.id),
                               true_distance(beam, rounded, part)});
            }
        }
        std::sort(all.begin(), all.end());
        return all;
    }

    template <int W, class Part> void check_search(const Part &part)
    {
        using F = Lanes<W>;
        gpom::Found<F> best[kNearest];
        gpom::Subtree stack[gpom::kDepthMax];
        gpom::Offset<F> at = {};
        std::vector<Xy> queries;
        for (int i = 0; i < W; ++i) {
            queries.push_back({random.uniform(-25, 25), random.uniform(-25, 25)});
            gpom::lane::set(at.x_m, i, static_cast<float>(queries.back().x));
            gpom::lane::set(at.y_m, i, static_cast<float>(queries.back().y));
        }
        gpom::NearestK<F> nearest = {best, kNearest, 0};
        nearest.clear();
        gpom::search(nearest, at, index, part, gpom::from_root(gpom::tree_of(index, part), stack));
        bool is_same = true;
        for (int i = 0; i < W; ++i) {
            const std::vector<Ranked> truth =
                brute_force(queries[static_cast<std::size_t>(i)], part);
            for (std::uint32_t j = 0; j < kNearest; ++j) {
                const std::int32_t found = gpom::lane::get(best[j].slot, i);
                if (j >= truth.size()) {
                    is_same = is_same && found == -1;
                    continue;
                }
                is_same = is_same && found >= 0 && gpom::lane::get(best[j].id, i) == truth[j].id &&
                          copy[static_cast<std::uint32_t>(found)].id ==
                              static_cast<std::uint32_t>(truth[j].id) &&
                          same_bits(gpom::lane::get(best[j].d2, i), truth[j].d2) &&
                          std::abs(std::sqrt(static_cast<double>(truth[j].d2)) -
                                   truth[j].distance) <= 1e-4;
            }
        }
        REQUIRE(is_same);
    }

    /// Is a free segment near a place? As brute force has it. Returns it.
    bool check_near_free()
    {
        const Xy q = {random.uniform(-25, 25), random.uniform(-25, 25)};
        const gpom::Point at = {static_cast<float>(q.x), static_cast<float>(q.y)};
        const float reach_m = random.uniform_f(0.05, 4.0);
        gpom::Subtree stack[gpom::kDepthMax];
        const std::vector<Ranked> truth = brute_force(q, index.free_part);
        const bool is_near = !truth.empty() && truth.front().d2 < reach_m * reach_m;
        REQUIRE(gpom::is_near_free(index, stack, at, reach_m) == is_near);
        return is_near;
    }
};

/// A life of n changes; returns the bytes of the map afterwards. The same memory and the same fill
/// each time, so that nothing but the calls can make a difference.
std::vector<unsigned char> bytes_after(GuardedMemory &memory, std::uint64_t stream, int n_changes)
{
    const gpom_config_t config = index_config();
    std::memset(memory.mem(), 0x5c, memory.bytes());
    gpom_map_t *map = nullptr;
    REQUIRE(gpom_map_init(&map, &config, memory.mem(), memory.bytes()) == GPOM_OK);
    Life life(map->index, stream);
    for (int i = 0; i < n_changes; ++i) {
        life.change(i);
        life.build(i);
    }
    const auto *const first = static_cast<const unsigned char *>(memory.mem());
    return {first, first + memory.bytes()};
}

} // namespace

// After each of 10,000 random insertions and removals, with slices of building between them, a
// search finds item by item what brute force finds, budgets are kept, and no slot is lost.
TEST_CASE("searches equal brute force while beams come and go")
{
    GPOM_TELL_SEED();
    TestMap map(index_config());
    Life life(map.get()->index, 120);
    int n_near = 0, n_checks = 0;
    for (int i = 0; i < 10000; ++i) {
        CAPTURE(i);
        life.change(i);
        if (i % 2 == 0) {
            life.build(i);
        }
        life.check_store();
        life.check_search<1>(life.index.hit_part);
        life.check_search<1>(life.index.free_part);
        n_near += life.check_near_free() ? 1 : 0;
        ++n_checks;
        if (i % 20 == 0) {
            life.check_search<16>(life.index.hit_part);
            life.check_search<16>(life.index.free_part);
        }
        if (i % 2 == 1) {
            life.build(i);
        }
    }
    CHECK(n_near > n_checks / 10);
    CHECK(n_near < n_checks * 9 / 10);
    CHECK(life.n_overflows > 100); // the ring of recent beams was too short
    CHECK(life.n_reused_in_build > 100);
    CHECK(life.n_full > 100);
    CHECK(life.n_builds > 20);
}

// Forgetting everything leaves an empty store that fills and searches as before, from id 0 on.
TEST_CASE("searches equal brute force after everything was forgotten, in a build or not")
{
    GPOM_TELL_SEED();
    TestMap map(index_config());
    Life life(map.get()->index, 121);
    for (int i = 0; i < 2000; ++i) {
        CAPTURE(i);
        if (i % 300 == 299) {
            gpom::forget_all(life.index);
            life.copy.assign(kBeamMax, gpom::Beam{});
            REQUIRE(life.index.next_id == 0);
            REQUIRE(life.index.n_beams == 0);
        }
        life.change(0);
        life.build(400 + i);
        life.check_store();
        life.check_search<4>(life.index.hit_part);
        life.check_search<4>(life.index.free_part);
    }
}

// However small the slices, building ends within the bound of kdtree.hpp, and then nothing is
// recent any more.
TEST_CASE("building ends for slices of any size")
{
    GPOM_TELL_SEED();
    for (const std::uint32_t slice :
         std::initializer_list<std::uint32_t>{1, 2, 13, 1000, UINT32_MAX}) {
        CAPTURE(slice);
        TestMap map(index_config());
        Life life(map.get()->index, 122);
        while (!gpom::is_full(life.index)) {
            life.insert_one();
        }
        std::uint64_t n_operations = 0;
        gpom::start_build(life.index);
        while (gpom::is_building(life.index)) {
            const std::uint32_t used = gpom::build_some(life.index, slice);
            REQUIRE(used >= 1);
            REQUIRE(used <= slice);
            n_operations += used;
        }
        const double levels = std::ceil(std::log2(gpom::leaf_count(kBeamMax)));
        CHECK(static_cast<double>(n_operations) <=
              2.0 * kBeamMax * (2.0 + levels * (gpom::kSplitsMax + 1.0)));
        CHECK(life.index.hit_tree.id_end == life.index.next_id);
        CHECK(life.index.free_tree.id_end == life.index.next_id);
        CHECK(gpom::build_some(life.index, slice) == 0); // nothing to do
        life.check_store();
    }
}

// The same calls leave the same bytes.
TEST_CASE("the index is a function of the calls, byte for byte")
{
    GPOM_TELL_SEED();
    const gpom_config_t config = index_config();
    GuardedMemory memory(gpom_map_bytes(&config));
    for (const int n_changes : {1, 100, 2500}) {
        const auto once = bytes_after(memory, 123, n_changes);
        CHECK(bytes_after(memory, 123, n_changes) == once);
        if (n_changes > 1) { // one may find nothing to change
            CHECK(bytes_after(memory, 124, n_changes) != once);
        }
    }
    CHECK(memory.is_intact());
}
