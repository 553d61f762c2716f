// Trees and the k nearest against brute force, on every shape of beams that could trip a split.
#include "tests/common/reference.hpp"

#include "src/beams/kdtree.hpp"
#include "src/beams/nearest.hpp"
#include "src/beams/search_start.hpp"

#include <functional>
#include <numeric>

using namespace reference;
using gpom::Subtree;

namespace
{

constexpr float kGap_m = 0.1f;
constexpr std::uint32_t kSizes[] = {0, 1, 7, 8, 9, 500, 5000};

gpom::Beam make_beam(Xy origin, double yaw_rad, double range_m, bool is_hit)
{
    gpom::Beam beam = {};
    beam.x_m = static_cast<float>(origin.x);
    beam.y_m = static_cast<float>(origin.y);
    beam.dir_x = static_cast<float>(std::cos(yaw_rad));
    beam.dir_y = static_cast<float>(std::sin(yaw_rad));
    beam.range_m = static_cast<float>(range_m);
    beam.returned = is_hit ? 1 : 0;
    beam.hit = is_hit ? gpom::kStanding : gpom::kNoHit;
    beam.has_free = 1;
    return beam;
}

struct World {
    const char *name;
    std::function<gpom::Beam(Random &, std::uint32_t)> beam;
    Xy centre;      ///< Queries are asked about here,
    double reach_m; ///< as far as this.
};

const World kWorlds[] = {
    {"random",
     [](Random &r, std::uint32_t) {
         return make_beam({r.uniform(-50, 50), r.uniform(-50, 50)}, r.uniform(-4, 4),
                          r.uniform(0.05, 30.0), r.below(5) != 0);
     },
     {0, 0},
     80.0},
    {"collinear",
     [](Random &r, std::uint32_t) {
         const double at = r.uniform(-50, 50);
         return make_beam({at * 0.6, at * 0.8}, std::atan2(0.8, 0.6), r.uniform(0.5, 20.0), true);
     },
     {0, 0},
     80.0},
    {"coincident",
     [](Random &, std::uint32_t) {
         return make_beam({3, 4}, 0.3, 10.0, true);
     },
     {3, 4},
     20.0},
    {"fan",
     [](Random &, std::uint32_t i) {
         return make_beam({-2, 7}, 0.0123 * i, 5.0 + i % 13, i % 7 != 0);
     },
     {-2, 7},
     20.0},
    {"axis-parallel",
     [](Random &r, std::uint32_t i) {
         gpom::Beam beam =
             make_beam({1.0 * r.below(20), 1.0 * r.below(20)}, 0.0, 1.0 + r.below(9), true);
         beam.dir_x = i % 4 == 0 ? 1.0f : i % 4 == 1 ? -1.0f : 0.0f;
         beam.dir_y = i % 4 == 2 ? 1.0f : i % 4 == 3 ? -1.0f : 0.0f;
         return beam;
     },
     {10, 10},
     20.0},
    {"zero-length",
     [](Random &r, std::uint32_t) {
         return make_beam({r.uniform(-9, 9), r.uniform(-9, 9)}, r.uniform(-4, 4),
                          r.uniform(0.01, 0.1), true);
     },
     {0, 0},
     15.0},
    {"long thin",
     [](Random &r, std::uint32_t) {
         return make_beam({r.uniform(-1, 1), r.uniform(-4000, 4000)},
                          kPi / 2 + r.uniform(-1e-3, 1e-3), r.uniform(3000, 8000), r.below(2) == 0);
     },
     {0, 2000},
     3000.0},
    {"far off",
     [](Random &r, std::uint32_t) {
         return make_beam({5580 + r.uniform(-40, 40), -5580 + r.uniform(-40, 40)}, r.uniform(-4, 4),
                          r.uniform(0.05, 60.0), r.below(5) != 0);
     },
     {5580, -5580},
     90.0},
};

std::vector<gpom::Beam> beams_of(const World &world, std::uint32_t n)
{
    Random random(10);
    std::vector<gpom::Beam> beams;
    for (std::uint32_t i = 0; i < n; ++i) {
        beams.push_back(world.beam(random, i));
        beams.back().id = 3 * i + 5; // ids need not start at 0 nor be dense
    }
    return beams;
}

constexpr gpom::HitPart kHits = {0.0f};
constexpr gpom::HitPart kDeepHits = {0.7f};
constexpr gpom::FreePart kFree = {kGap_m};

/// A built tree with its arrays. Built in slices of any size, each within its budget, all together
/// within the header's bound.
struct Tree {
    std::vector<gpom::Beam> beams;
    std::vector<gpom::Box> boxes;
    std::vector<std::uint32_t> slots;
    gpom::KdTree tree;
};

template <class Part>
Tree build(const std::vector<gpom::Beam> &beams, const std::vector<std::uint32_t> &slots,
           const Part &part, std::uint32_t slice = UINT32_MAX)
{
    const auto n = static_cast<std::uint32_t>(slots.size());
    Tree made = {beams, std::vector<gpom::Box>(gpom::node_count(n) + 1), slots, {}};
    std::memset(static_cast<void *>(made.boxes.data()), 0, made.boxes.size() * sizeof(gpom::Box));
    made.slots.push_back(0); // never an empty array
    made.tree = {made.beams.data(), made.boxes.data(), made.slots.data(), n, UINT32_MAX};
    gpom::TreeBuild under_way;
    gpom::start_build(under_way, made.tree);
    std::uint64_t n_operations = 0;
    while (!gpom::is_done(under_way)) {
        const std::uint32_t used = gpom::build_some(under_way, made.tree, part, slice);
        REQUIRE(used >= 1);
        REQUIRE(used <= slice);
        n_operations += used;
    }
    const double levels = std::ceil(std::log2(std::max<std::uint32_t>(1, gpom::leaf_count(n))));
    CHECK(static_cast<double>(n_operations) <= 1.0 * n * (1.0 + levels * (gpom::kSplitsMax + 1.0)));
    return made;
}

/// Indices of the beams that have this part.
template <class Part> std::vector<std::uint32_t> members(const std::vector<gpom::Beam> &beams)
{
    std::vector<std::uint32_t> slots;
    for (std::uint32_t i = 0; i < beams.size(); ++i) {
        if (Part::is_in(beams[i])) {
            slots.push_back(i);
        }
    }
    return slots;
}

struct Ranked {
    float d2;
    std::int32_t id;
    double distance; ///< By the double oracle.

    bool operator<(const Ranked &o) const { return d2 != o.d2 ? d2 < o.d2 : id < o.id; }
};

/// depth_m < 0: of the free segment, else of the occupied part of that depth.
double true_distance(const gpom::Beam &b, Xy q, double depth_m)
{
    const double range = b.range_m;
    const double length =
        b.returned != 0 ? std::max(0.0, range - static_cast<double>(kGap_m)) : range;
    const double along = (q.x - static_cast<double>(b.x_m)) * static_cast<double>(b.dir_x) +
                         (q.y - static_cast<double>(b.y_m)) * static_cast<double>(b.dir_y);
    const double t =
        depth_m >= 0.0 ? std::clamp(along, range, range + depth_m) : std::clamp(along, 0.0, length);
    return std::hypot(static_cast<double>(b.x_m) + t * static_cast<double>(b.dir_x) - q.x,
                      static_cast<double>(b.y_m) + t * static_cast<double>(b.dir_y) - q.y);
}

/// The float32 distance of one beam, without a tree.
template <class Part>
float distance2_of(const gpom::Beam &beam, float x_m, float y_m, const Part &part)
{
    return gpom::distance2(gpom::Offset<float>{x_m, y_m}, part, beam);
}

template <class Part>
std::vector<Ranked> brute_force(const std::vector<gpom::Beam> &beams, Xy q, const Part &part)
{
    double depth_m = -1.0;
    if constexpr (std::is_same_v<Part, gpom::HitPart>) {
        depth_m = static_cast<double>(part.depth_m);
    }
    const auto x_m = static_cast<float>(q.x);
    const auto y_m = static_cast<float>(q.y);
    std::vector<Ranked> all;
    for (const std::uint32_t i : members<Part>(beams)) {
        all.push_back({distance2_of(beams[i], x_m, y_m, part),
                       static_cast<std::int32_t>(beams[i].id),
                       true_distance(beams[i], {x_m, y_m}, depth_m)});
    }
    std::sort(all.begin(), all.end());
    return all;
}

/// The k nearest of each lane are the first k of its brute-force ranking.
template <int W>
bool are_first(const gpom::NearestK<Lanes<W>> &nearest, const std::vector<Ranked> *truth)
{
    bool is_same = true;
    for (int i = 0; i < W; ++i) {
        for (std::uint32_t j = 0; j < nearest.k; ++j) {
            const bool exists = j < truth[i].size();
            const gpom::Found<Lanes<W>> &got = nearest.best[j];
            is_same = is_same &&
                      gpom::lane::get(got.id, i) == (exists ? truth[i][j].id : gpom::kNoId) &&
                      (gpom::lane::get(got.slot, i) >= 0) == exists &&
                      (!exists || same_bits(gpom::lane::get(got.d2, i), truth[i][j].d2));
        }
    }
    return is_same;
}

/// Search for W queries at once and compare with their brute-force rankings: without a bound, with
/// that of the queries before, with the closest one, with one that is too close, and from search
/// starts.
template <int W, class Part>
void check_search(const Tree &tree, const Part &part, std::uint32_t k,
                  const std::vector<Xy> &queries, const std::vector<std::vector<Ranked>> &truth)
{
    using F = Lanes<W>;
    static gpom::Found<F> best[32];
    Subtree stack[gpom::kStartPartsMax + gpom::kDepthMax];
    Subtree parts[gpom::kStartPartsMax];
    gpom::SearchStart start = {parts, 0, 0.0f, gpom::empty_box()};
    gpom::NearestK<F> nearest = {best, k, 0};
    gpom::Offset<F> before = {};
    F worst = gpom::lane::splat<F>(gpom::kNoDistance2);
    for (std::size_t first = 0; first + W <= queries.size(); first += W) {
        gpom::Offset<F> at = {};
        for (int i = 0; i < W; ++i) {
            const Xy q = queries[first + static_cast<std::size_t>(i)];
            gpom::lane::set(at.x_m, i, static_cast<float>(q.x));
            gpom::lane::set(at.y_m, i, static_cast<float>(q.y));
        }
        const auto search = [&](F d2_max, const gpom::Walks &walks) {
            nearest.clear(d2_max);
            gpom::search_tree(nearest, at, part, tree.tree, walks);
            return nearest.has_all();
        };
        const auto search_within = [&](F d2_max) {
            return search(d2_max, gpom::from_root(tree.tree, stack));
        };
        const auto is_found_from_start = [&](F d2_max) {
            return search(d2_max, gpom::from_start(start, stack, UINT32_MAX)) &&
                   are_first<W>(nearest, &truth[first]);
        };
        const gpom::Offset<F> move = {at.x_m - before.x_m, at.y_m - before.y_m};
        const F reach2 = gpom::reach2_after(worst, move);
        const gpom::Vicinity<F> around = {at, gpom::lane::sqrt(reach2)};
        const bool is_enough = search_within(reach2);
        const bool is_reused = is_enough && start.n > 0 && gpom::suits(start, around);
        REQUIRE((!is_enough || are_first<W>(nearest, &truth[first])));
        REQUIRE((!is_reused || is_found_from_start(reach2)));
        if (is_enough) {
            gpom::find_start(start, tree.tree, part, around, stack);
            REQUIRE(start.n <= gpom::kStartPartsMax);
            REQUIRE(gpom::suits(start, around));
            REQUIRE(is_found_from_start(reach2));
        }
        REQUIRE(search_within(gpom::lane::splat<F>(gpom::kNoDistance2)));
        REQUIRE(are_first<W>(nearest, &truth[first]));
        worst = nearest.worst();
        before = at;
        REQUIRE(search_within(worst));
        REQUIRE(are_first<W>(nearest, &truth[first]));
        REQUIRE(search_within(0.999f * worst) != gpom::lane::any(worst > 0.0f));
    }
}

/// Sorted float32 distances are the sorted true ones, within rounding of the coordinates.
void check_distances(const std::vector<Ranked> &ranked, double tolerance_m)
{
    std::vector<double> truth;
    for (const Ranked &r : ranked) {
        truth.push_back(r.distance);
    }
    std::sort(truth.begin(), truth.end());
    double worst = 0.0;
    for (std::size_t j = 0; j < truth.size(); ++j) {
        worst = std::max(worst, std::abs(std::sqrt(static_cast<double>(ranked[j].d2)) - truth[j]));
    }
    CHECK(worst <= tolerance_m);
}

template <class Part> void check_world(const World &world, std::uint32_t n, const Part &part)
{
    Random random(11);
    const std::vector<gpom::Beam> beams = beams_of(world, n);
    const Tree tree = build(beams, members<Part>(beams), part);
    const double scale_m =
        std::abs(world.centre.x) + std::abs(world.centre.y) + world.reach_m + 8000.0;
    std::vector<Xy> queries;
    std::vector<std::vector<Ranked>> truth;
    for (int i = 0; i < 32; ++i) {
        const double reach_m = world.reach_m * (i % 2 == 0 ? 0.1 : 1.0); // packets near and wide
        Xy q = {world.centre.x + random.uniform(-reach_m, reach_m),
                world.centre.y + random.uniform(-reach_m, reach_m)};
        q = {static_cast<double>(static_cast<float>(q.x)),
             static_cast<double>(static_cast<float>(q.y))};
        if (i % 8 == 3 && n > 0) { // right on a sensor
            q = {static_cast<double>(beams[n / 2].x_m), static_cast<double>(beams[n / 2].y_m)};
        }
        queries.push_back(q);
        truth.push_back(brute_force(beams, q, part));
        check_distances(truth.back(), 1e-6 * scale_m);
    }
    for (const std::uint32_t k : {1u, 2u, 8u, 32u}) {
        check_search<1>(tree, part, k, queries, truth);
        check_search<4>(tree, part, k, queries, truth);
        check_search<8>(tree, part, k, queries, truth);
        check_search<16>(tree, part, k, queries, truth);
    }
}

template <class Part> void check_shape(const World &world, std::uint32_t n, const Part &part)
{
    const std::vector<gpom::Beam> beams = beams_of(world, n);
    const std::vector<std::uint32_t> all = members<Part>(beams);
    const Tree tree = build(beams, all, part);
    REQUIRE(tree.tree.n_items == all.size());
    const gpom::Subtree root = {0, 0, gpom::leaf_count(tree.tree.n_items)};
    CHECK(gpom::slots_of(tree.tree, root).n == all.size());
    std::vector<std::uint32_t> found(tree.tree.slots, tree.tree.slots + tree.tree.n_items);
    std::sort(found.begin(), found.end());
    CHECK(found == all);
}

bool contains(const gpom::Box &box, float x_m, float y_m)
{
    return x_m >= box.x_min_m && x_m <= box.x_max_m && y_m >= box.y_min_m && y_m <= box.y_max_m;
}

bool is_inside(const gpom::Box &box, const gpom::Segment &s)
{
    const double x = s.x_m + static_cast<double>(s.length_m) * static_cast<double>(s.dir_x);
    const double y = s.y_m + static_cast<double>(s.length_m) * static_cast<double>(s.dir_y);
    return contains(box, s.x_m, s.y_m) &&
           contains(box, static_cast<float>(x), static_cast<float>(y));
}

/// All items of the leaves below `t` lie in its box; then the same of its children.
template <class Part> void check_boxes(const Tree &tree, const Subtree &t, const Part &part)
{
    bool all_inside = true;
    const gpom::Stretch slots = gpom::slots_of(tree.tree, t);
    for (std::uint32_t i = slots.first; i < slots.first + slots.n; ++i) {
        const gpom::Segment segment = part(tree.beams[tree.tree.slots[i]]);
        all_inside = all_inside && is_inside(tree.boxes[t.node], segment);
    }
    REQUIRE(all_inside);
    if (t.n_leaves > 1) {
        REQUIRE(t.node + 2 * t.n_leaves - 1 <= gpom::node_count(tree.tree.n_items));
        check_boxes(tree, gpom::left_of(t), part);
        check_boxes(tree, gpom::right_of(t), part);
    }
}

template <class Part> void check_permuted(const World &world, std::uint32_t n, const Part &part)
{
    Random random(12);
    const std::vector<gpom::Beam> beams = beams_of(world, n);
    std::vector<std::uint32_t> slots = members<Part>(beams);
    const Tree tree = build(beams, slots, part);
    for (const std::uint32_t slice : std::initializer_list<std::uint32_t>{UINT32_MAX, 1, 7, 100}) {
        std::shuffle(slots.begin(), slots.end(), random.bits);
        const Tree again = build(beams, slots, part, slice);
        CHECK(std::memcmp(again.boxes.data(), tree.boxes.data(),
                          tree.boxes.size() * sizeof(gpom::Box)) == 0);
    }
}

/// f(world, n) for all worlds and sizes.
template <class Fn> void for_all_worlds(Fn f)
{
    GPOM_TELL_SEED();
    for (const World &world : kWorlds) {
        for (const std::uint32_t n : kSizes) {
            INFO("world ", std::string(world.name));
            CAPTURE(n);
            f(world, n);
        }
    }
}

} // namespace

// The k nearest hits are those of brute force, in the same order and with the same bits of
// distance, for any shape of the input, any k and any lane width.
TEST_CASE("the k nearest hits equal brute force")
{
    for_all_worlds([](const World &world, std::uint32_t n) { check_world(world, n, kHits); });
    for_all_worlds([](const World &world, std::uint32_t n) { check_world(world, n, kDeepHits); });
}

// The same of the nearest points on free segments (eq. 10).
TEST_CASE("the k nearest free segments equal brute force" *
          doctest::test_suite("sanitized campaign"))
{
    for_all_worlds([](const World &world, std::uint32_t n) { check_world(world, n, kFree); });
}

// No beam is lost or doubled, and the leaves cover all slots.
TEST_CASE("every beam stands in exactly one leaf")
{
    for_all_worlds([](const World &world, std::uint32_t n) {
        check_shape(world, n, kHits);
        check_shape(world, n, kFree);
    });
}

// A box that does not hold its items would make a search miss them.
TEST_CASE("each box contains the items below it")
{
    for_all_worlds([](const World &world, std::uint32_t n) {
        const std::vector<gpom::Beam> beams = beams_of(world, n);
        const Tree hits = build(beams, members<gpom::HitPart>(beams), kHits);
        const Tree free = build(beams, members<gpom::FreePart>(beams), kFree);
        if (hits.tree.n_items > 0) {
            check_boxes(hits, {0, 0, gpom::leaf_count(hits.tree.n_items)}, kHits);
        }
        if (free.tree.n_items > 0) {
            check_boxes(free, {0, 0, gpom::leaf_count(free.tree.n_items)}, kFree);
        }
    });
}

// The boxes depend on the set of beams alone, not on the order in which they are given nor on the
// slices in which the tree is built.
TEST_CASE("building from a permuted order or in slices gives the same boxes")
{
    for_all_worlds([](const World &world, std::uint32_t n) {
        check_permuted(world, n, kHits);
        check_permuted(world, n, kFree);
    });
}

// Offering in any order keeps the same k, ties in distance going to the smaller id, in some lanes
// or in all.
TEST_CASE_TEMPLATE("the k nearest do not depend on the order of offers", F, float, Lanes<4>,
                   Lanes<16>)
{
    GPOM_TELL_SEED();
    using Ints = gpom::lane::IntOf<F>;
    constexpr int kWidth = gpom::lane::width<F>;
    Random random(13);
    std::vector<std::int32_t> ids(40);
    std::iota(ids.begin(), ids.end(), 0);
    const auto distance2_in = [](int lane, std::int32_t id) { // lane + 1 ids at each distance
        const std::int32_t d2 = id / (lane + 1);
        return static_cast<float>(d2);
    };
    for (int round = 0; round < 50; ++round) {
        std::shuffle(ids.begin(), ids.end(), random.bits);
        static gpom::Found<F> best[8];
        gpom::NearestK<F> nearest = {best, 8, 0};
        nearest.clear();
        for (const std::int32_t id : ids) {
            gpom::Found<F> item = {{}, gpom::lane::splat_int<Ints>(id), {}};
            item.slot = item.id + 100;
            for (int i = 0; i < kWidth; ++i) {
                gpom::lane::set(item.d2, i, distance2_in(i, id));
            }
            nearest.offer(item);
        }
        bool is_in_order = true;
        for (std::int32_t j = 0; j < 8; ++j) {
            for (int i = 0; i < kWidth; ++i) {
                is_in_order = is_in_order && gpom::lane::get(best[j].id, i) == j &&
                              gpom::lane::get(best[j].slot, i) == 100 + j &&
                              gpom::lane::get(best[j].d2, i) == distance2_in(i, j);
            }
        }
        CHECK(is_in_order);
    }
}

// A rectangle and a box have a common point if and only if their extents overlap along both axes,
// whether the sides are compared one by one or in four lanes.
TEST_CASE("a rectangle touches a box where both extents overlap")
{
    GPOM_TELL_SEED();
    Random random(17);
    for (int i = 0; i < 20000; ++i) {
        // Whole numbers, so that sides often coincide. Some boxes are points, some are empty.
        const auto side = [&] { return static_cast<float>(random.below(9)) - 4.0f; };
        const float x0 = side(), y0 = side();
        const gpom::Box a = {x0, y0, x0 + std::abs(side()), y0 + std::abs(side())};
        const float x1 = side(), y1 = side();
        const gpom::Box b = random.below(10) == 0
                                ? gpom::empty_box()
                                : gpom::Box{x1, y1, x1 + std::abs(side()), y1 + std::abs(side())};
        const bool overlap_x = a.x_min_m <= b.x_max_m && b.x_min_m <= a.x_max_m;
        const bool overlap_y = a.y_min_m <= b.y_max_m && b.y_min_m <= a.y_max_m;
        REQUIRE(gpom::AreaOf<1>(a).touches(b) == (overlap_x && overlap_y));
        REQUIRE(gpom::AreaOf<4>(a).touches(b) == (overlap_x && overlap_y));
    }
}
