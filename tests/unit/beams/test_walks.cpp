// The bound on the walks down a search tree (config.walk_max): what a cut query says, and that it
// costs no more.
#include "src/map/map.hpp"
#include "tests/common/reference.hpp"

using namespace reference;

namespace
{

constexpr std::uint32_t kBeams = 4000;

/// A robot that stands and turns: every free segment begins at the same place, so that all boxes of
/// their tree are equally near there.
void stand_and_turn(gpom_map_t *map)
{
    Random random(190);
    for (std::uint32_t i = 0; i < kBeams / 50; ++i) {
        TestScan s = yard_scan(random, 0, {});
        s.pose = {0.0, 0.0, random.uniform(-3.0, 3.0), nullptr};
        s.stamp_us = 100000 * i;
        REQUIRE(s.insert_into(map) == GPOM_OK);
    }
    REQUIRE(gpom_map_build(map) == GPOM_OK);
}

gpom_config_t cut_config(std::uint32_t walk_max)
{
    gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12), kBeams);
    config.walk_max = walk_max;
    return config;
}

/// From where nearly all segments are equally near to where nearly none are.
std::vector<gpom_point_t> crowded_points()
{
    std::vector<gpom_point_t> points = {{0.0, 0.0}};
    for (int i = 0; i < 200; ++i) {
        const double r_m = 16.0 * i / 200.0;
        points.push_back({r_m * std::cos(2.4 * i), r_m * std::sin(2.4 * i)});
    }
    return points;
}

/// Free segments that tell how often they are looked at.
struct CountedPart {
    gpom::FreePart part;
    std::uint64_t *n_looks;

    static bool is_in(const gpom::Beam &beam) { return gpom::FreePart::is_in(beam); }
    static bool is_seen(const gpom::Beam &beam) { return gpom::FreePart::is_seen(beam); }
};

} // namespace

namespace gpom
{
inline const KdTree &tree_of(const Index &index, const CountedPart &) { return index.free_tree; }
inline const Box &box_of(const RecentBlock &block, const CountedPart &) { return block.free; }
inline float priority(const CountedPart &counted, const Box &box, const Point &at)
{
    return priority(counted.part, box, at);
}
inline float distance2(const Offset<float> &at, const CountedPart &counted, const Beam &beam)
{
    ++*counted.n_looks;
    return distance2(at, counted.part, beam);
}
} // namespace gpom

// With few walks some queries are cut and say so; those that are not have the bits of a search
// without bound. What is cut is still a number, from beams as many as asked for.
TEST_CASE("a cut query is flagged and all others are exact")
{
    GPOM_TELL_SEED();
    TestMap whole(cut_config(GPOM_WALK_MAX));
    stand_and_turn(whole.get());
    const std::vector<gpom_point_t> points = crowded_points();
    const Answers exact = query_points(whole.get(), points);
    CHECK(exact.status == GPOM_OK);
    std::size_t n_cut_before = points.size();
    for (const std::uint32_t walk_max : {8u, 64u, 256u}) {
        TestMap map(cut_config(walk_max));
        stand_and_turn(map.get());
        const Answers answers = query_points(map.get(), points);
        CHECK(answers.status == GPOM_ERR_CUT);
        std::size_t n_cut = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const gpom_answer_t &a = answers.all[i];
            if (a.flags == GPOM_ANSWER_CUT) {
                ++n_cut;
                CHECK((a.probability >= 0.0f && a.probability <= 1.0f && a.variance >= 0.0f));
                CHECK((a.n_hits == 8 && a.n_free == 8));
            } else {
                CHECK(same_bits(a, exact.all[i]));
            }
        }
        CHECK((n_cut > 0 && n_cut <= n_cut_before));
        n_cut_before = n_cut;
    }
    CHECK(n_cut_before < points.size() / 2);
}

// Whether and how a query is cut is its own affair: the same bits alone, in a list and in a raster.
TEST_CASE("a query is cut alike in any packet")
{
    GPOM_TELL_SEED();
    TestMap map(cut_config(12));
    stand_and_turn(map.get());
    const gpom_raster_t raster = {-6.0, -6.0, 0.75, 16, 16};
    const Answers answers = query_raster(map.get(), raster);
    CHECK(answers.status == GPOM_ERR_CUT);
    std::vector<gpom_point_t> centres;
    for (std::uint32_t i = 0; i < 256; ++i) {
        centres.push_back(
            {raster.x0_m + (i % 16 + 0.5) * 0.75, raster.y0_m + (i / 16 + 0.5) * 0.75});
        CHECK(same_bits(query_points(map.get(), {centres.back()}).all[0], answers.all[i]));
    }
    CHECK(same_bits(query_points(map.get(), centres).all, answers.all));
}

// A search looks at the beams of at most one leaf a walk, whatever the place; on a map of fewer
// leaves than the default allows, no place is cut.
TEST_CASE("the work of a search is bounded")
{
    GPOM_TELL_SEED();
    TestMap map(cut_config(GPOM_WALK_MAX));
    stand_and_turn(map.get());
    std::vector<gpom::Subtree> stack(gpom::kDepthMax);
    std::uint64_t most_looks = 0;
    for (const std::uint32_t walk_max : {1u, 5u, 50u, GPOM_WALK_MAX}) {
        for (const gpom_point_t &point : crowded_points()) {
            std::uint64_t n_looks = 0;
            gpom::Found<float> best[8];
            gpom::NearestK<float> nearest = {best, 8, 0};
            nearest.clear();
            const gpom::Offset<float> at = {static_cast<float>(point.x_m),
                                            static_cast<float>(point.y_m)};
            const gpom::Index &index = map.get()->index;
            const bool is_whole =
                gpom::search(nearest, at, index, CountedPart{index.free_part, &n_looks},
                             gpom::from_root(index.free_tree, stack.data(), walk_max));
            CHECK(n_looks <= std::uint64_t{walk_max} * gpom::kLeafSize);
            CHECK((is_whole || walk_max < GPOM_WALK_MAX));
            most_looks = std::max(most_looks, n_looks);
        }
    }
    CHECK(most_looks * 2 > kBeams); // the crowd is one: without bound nearly all are looked at
}

// The bound reaches paths and cells of the low-resolution map, which has a counter for it.
TEST_CASE("cut searches are told by paths and counted for cells")
{
    GPOM_TELL_SEED();
    gpom_config_t config = cut_config(4);
    config.lowres_cell_m = 1.0;
    config.lowres_nx = config.lowres_ny = 8;
    config.lowres_x0_m = config.lowres_y0_m = -4.0;
    TestMap map(config);
    stand_and_turn(map.get());
    std::vector<unsigned char> memory(gpom_scratch_bytes(map.get()));
    const gpom_scratch_t scratch = {memory.data(), memory.size()};
    const gpom_point_t corners[] = {{-3.0, 0.0}, {3.0, 0.1}};
    const gpom_path_t path = {corners, 2, 0.5, 0.25, 2.0f};
    gpom_path_result_t result;
    CHECK(gpom_path_query(map.get(), &path, &result, &scratch) == GPOM_ERR_CUT);
    CHECK(result.flags == GPOM_PATH_CUT);
    CHECK(map.stats().cells_cut == 0);
    REQUIRE(gpom_map_step(map.get(), UINT64_MAX / 2, &scratch, nullptr) == GPOM_OK);
    CHECK(map.stats().cells_cut > 0);
}

// A bound of no walk at all is refused.
TEST_CASE("walk_max is checked")
{
    const gpom_config_t config = cut_config(0);
    std::vector<std::uint64_t> memory(gpom_map_bytes(&config) / 8 + 1);
    gpom_map_t *map = nullptr;
    CHECK(gpom_map_init(&map, &config, memory.data(), 8 * memory.size()) == GPOM_ERR_ARG);
}
