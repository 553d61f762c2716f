// The map's memory, configuration and bookkeeping.
#include "tests/common/reference.hpp"

#include <functional>
#include <string>
#include <utility>

using namespace reference;

namespace
{

gpom_config_t small_config() { return config_of(params_of(GPOM_KERNEL_MATERN12), 40); }

gpom_status_t init_in(const gpom_config_t &config, void *mem, std::size_t bytes, gpom_map_t **map)
{
    *map = reinterpret_cast<gpom_map_t *>(map); // anything but NULL
    return gpom_map_init(map, &config, mem, bytes);
}

void check_refused(const gpom_config_t &config, gpom_status_t expected)
{
    GuardedMemory memory(GPOM_MAP_BYTES(2000, 0));
    gpom_map_t *map;
    CHECK(init_in(config, memory.mem(), memory.bytes(), &map) == expected);
    CHECK(map == nullptr);
}

} // namespace

// Each size below the need is refused, the need itself is enough, and nothing outside is touched.
TEST_CASE("every mem_bytes below the need is refused")
{
    const gpom_config_t config = small_config();
    const std::size_t need = gpom_map_bytes(&config);
    for (std::size_t bytes = 0; bytes < need; ++bytes) {
        GuardedMemory memory(bytes);
        gpom_map_t *map;
        REQUIRE(init_in(config, memory.mem(), bytes, &map) == GPOM_ERR_MEM);
        REQUIRE(map == nullptr);
        REQUIRE(memory.is_intact());
    }
    GuardedMemory memory(need);
    gpom_map_t *map;
    CHECK(init_in(config, memory.mem(), need, &map) == GPOM_OK);
    CHECK(map != nullptr);
    CHECK(memory.is_intact());
}

// Memory that is not 8-byte aligned is refused at each offset, and so is none.
TEST_CASE("misaligned or missing memory is refused")
{
    const gpom_config_t config = small_config();
    gpom_map_t *map;
    for (std::size_t offset = 1; offset < 8; ++offset) {
        GuardedMemory memory(gpom_map_bytes(&config) + 64, offset);
        CHECK(init_in(config, memory.mem(), memory.bytes(), &map) == GPOM_ERR_MEM);
        CHECK(map == nullptr);
    }
    GuardedMemory memory(gpom_map_bytes(&config), 8);
    CHECK(init_in(config, memory.mem(), memory.bytes(), &map) == GPOM_OK);
    CHECK(init_in(config, nullptr, memory.bytes(), &map) == GPOM_ERR_MEM);
    CHECK(gpom_map_init(nullptr, &config, memory.mem(), memory.bytes()) == GPOM_ERR_ARG);
}

// The macro for static arrays never gives less than the map needs, nor much more.
TEST_CASE("GPOM_MAP_BYTES is at least gpom_map_bytes")
{
    gpom_config_t config = small_config();
    const auto check = [&config](std::uint32_t beam_max) {
        config.beam_max = beam_max;
        const std::size_t exact = gpom_map_bytes(&config);
        return exact > 0 && exact <= GPOM_MAP_BYTES(beam_max, 0) &&
               exact + 2048 >= GPOM_MAP_BYTES(beam_max, 0);
    };
    for (std::uint32_t beam_max = 1; beam_max <= 5000; ++beam_max) {
        REQUIRE(check(beam_max));
    }
    for (const std::uint32_t beam_max :
         {65535u, 65536u, 500000u, 9999999u, GPOM_BEAM_MAX - 1, GPOM_BEAM_MAX}) {
        CAPTURE(beam_max);
        CHECK(check(beam_max));
    }
}

// A capacity out of range needs no bytes, because it cannot be had.
TEST_CASE("gpom_map_bytes is 0 for what cannot be made")
{
    gpom_config_t config = small_config();
    CHECK(gpom_map_bytes(nullptr) == 0);
    for (const std::uint32_t beam_max : {0u, GPOM_BEAM_MAX + 1, 0xffffffffu}) {
        config.beam_max = beam_max;
        CHECK(gpom_map_bytes(&config) == 0);
        check_refused(config, GPOM_ERR_ARG);
    }
}

// Each way a configuration can be wrong is refused with its status, and *map is NULL.
TEST_CASE("bad configurations are refused")
{
    GuardedMemory memory(GPOM_MAP_BYTES(2000, 0));
    gpom_map_t *map;
    map = reinterpret_cast<gpom_map_t *>(&map);
    CHECK(gpom_map_init(&map, nullptr, memory.mem(), memory.bytes()) == GPOM_ERR_ARG);
    CHECK(map == nullptr);
    gpom_config_t config = {};
    check_refused(config, GPOM_ERR_ARG); // not from gpom_config_init()
    config = small_config();
    config.struct_bytes += 8;
    check_refused(config, GPOM_ERR_ARG);
    for (const double bad :
         {static_cast<double>(kNan), static_cast<double>(kInf), -static_cast<double>(kInf)}) {
        config = small_config();
        config.origin_x_m = bad;
        check_refused(config, GPOM_ERR_ARG);
        config = small_config();
        config.origin_y_m = bad;
        check_refused(config, GPOM_ERR_ARG);
    }
    for (float gpom_config_t::*length :
         {&gpom_config_t::keep_m, &gpom_config_t::far_m, &gpom_config_t::old_s}) {
        for (const float bad : {kNan, kInf, -0.1f}) {
            config = small_config();
            config.*length = bad;
            check_refused(config, GPOM_ERR_ARG);
        }
    }
    config = small_config();
    config.keep_m = 9e-4f; // too small to be told from rounding
    check_refused(config, GPOM_ERR_ARG);
    for (const std::uint32_t bad : {1u, 5u, 0xffffffffu}) {
        config = small_config();
        config.keep_m = 0.5f;
        config.clear_scans = bad;
        check_refused(config, GPOM_ERR_ARG);
    }
    config = small_config();
    config.clear_scans = 2; // but keep_m = 0
    check_refused(config, GPOM_ERR_ARG);
    config = small_config();
    config.params.struct_bytes = 0;
    check_refused(config, GPOM_ERR_ARG);
    config = small_config();
    config.params.sn2 = -1.0f;
    check_refused(config, GPOM_ERR_PARAMS);
}

// What is wrong is named by its field, before any memory is asked for.
TEST_CASE("a bad configuration is refused by the name of its field")
{
    using Change = std::function<void(gpom_config_t &)>;
    const std::pair<const char *, Change> cases[] = {
        {"struct_bytes", [](gpom_config_t &c) { c.struct_bytes = 0; }},
        {"beam_max", [](gpom_config_t &c) { c.beam_max = 0; }},
        {"beam_max", [](gpom_config_t &c) { c.beam_max = GPOM_BEAM_MAX + 1; }},
        {"focus_cell_max", [](gpom_config_t &c) { c.focus_cell_max = GPOM_CELL_MAX; }},
        {"walk_max", [](gpom_config_t &c) { c.walk_max = 0; }},
        {"keep_m", [](gpom_config_t &c) { c.keep_m = 1e-4f; }},
        {"keep_m", [](gpom_config_t &c) { c.keep_m = kNan; }},
        {"far_m", [](gpom_config_t &c) { c.far_m = -1.0f; }},
        {"old_s", [](gpom_config_t &c) { c.old_s = kInf; }},
        {"rebase_m", [](gpom_config_t &c) { c.rebase_m = 4001.0f; }},
        {"rebase_m", [](gpom_config_t &c) { c.rebase_m = 20.0f; c.params.frame = GPOM_FRAME_MAP; }},
        {"clear_scans", [](gpom_config_t &c) { c.clear_scans = 1; }},
        {"clear_scans", [](gpom_config_t &c) { c.clear_scans = 2; }},
        {"origin_x_m", [](gpom_config_t &c) { c.origin_x_m = static_cast<double>(kNan); }},
        {"origin_y_m", [](gpom_config_t &c) { c.origin_y_m = static_cast<double>(kInf); }},
        {"origin_y_m", [](gpom_config_t &c) { c.origin_y_m = -1.0001e8; }},
        {"lowres_reach_m", [](gpom_config_t &c) { c.lowres_reach_m = 8001.0f; }},
        {"lowres_unknown", [](gpom_config_t &c) { c.lowres_unknown = 1.1f; }},
        {"focus_cell_max", [](gpom_config_t &c) { c.lowres_nx = c.lowres_ny = 0; }},
        {"focus_cell_max", [](gpom_config_t &c) { c.focus_cell_max = 3; }},
        {"lowres_nx", [](gpom_config_t &c) { c.lowres_nx = 0; }},
        {"lowres_ny", [](gpom_config_t &c) { c.lowres_ny = 0; }},
        {"lowres_cell_m", [](gpom_config_t &c) { c.lowres_cell_m = 0.0; }},
        {"lowres_rolling",
         [](gpom_config_t &c) {
             c.lowres_rolling = 1;
             c.lowres_cell_m = 0.01;
             c.origin_x_m = 5e7;
         }},
        {"lowres_x0_m", [](gpom_config_t &c) { c.lowres_x0_m = 1e13; }},
        {"lowres_y0_m", [](gpom_config_t &c) { c.lowres_y0_m = static_cast<double>(kNan); }},
        {"sn2", [](gpom_config_t &c) { c.params.sn2 = 0.0f; }}};
    for (const auto &[field, change] : cases) {
        CAPTURE(field);
        gpom_config_t config = small_config();
        config.lowres_nx = config.lowres_ny = 4;
        config.lowres_cell_m = 0.5;
        config.focus_cell_max = 4;
        const char *problem = field;
        REQUIRE(gpom_config_check(&config, &problem) == GPOM_OK);
        REQUIRE(problem == nullptr);
        change(config);
        const gpom_status_t status = gpom_config_check(&config, &problem);
        CHECK(status == (std::string(field) == "sn2" ? GPOM_ERR_PARAMS : GPOM_ERR_ARG));
        REQUIRE(problem != nullptr);
        const std::string text = problem;
        CHECK(text.find(": ") != std::string::npos);
        CHECK(text.substr(0, text.find(':')).find(field) != std::string::npos);
        CHECK(gpom_config_check(&config, nullptr) == status);
        check_refused(config, status);
    }
    const char *problem = "untouched";
    CHECK(gpom_config_check(nullptr, &problem) == GPOM_ERR_ARG);
    CHECK(problem == nullptr);
}

// The defaults are those of the header and make a map.
TEST_CASE("the default configuration makes a map")
{
    gpom_config_t config;
    gpom_config_init(&config);
    gpom_config_init(nullptr);
    CHECK(config.struct_bytes == sizeof config);
    CHECK(config.beam_max == 1024);
    CHECK(config.origin_x_m == 0.0);
    CHECK(config.origin_y_m == 0.0);
    TestMap map(config);
    CHECK(gpom_map_beam_count(map.get()) == 0);
}

// Calls on what is no map are refused.
TEST_CASE("what is no map is refused")
{
    std::uint64_t zeros[64] = {};
    gpom_map_t *const not_made = reinterpret_cast<gpom_map_t *>(zeros);
    gpom_stats_t stats;
    gpom_beam_t beam;
    for (gpom_map_t *const map : {static_cast<gpom_map_t *>(nullptr), not_made}) {
        CHECK(gpom_map_clear(map) == GPOM_ERR_ARG);
        CHECK(gpom_map_build(map) == GPOM_ERR_ARG);
        CHECK(gpom_map_stats(map, &stats) == GPOM_ERR_ARG);
        CHECK(gpom_map_beam(map, 0, &beam) == GPOM_ERR_ARG);
        CHECK(gpom_map_beam_count(map) == 0);
        CHECK(gpom_map_slot_count(map) == 0);
        CHECK(gpom_scratch_bytes(map) == 0);
    }
    TestMap map(small_config());
    CHECK(gpom_map_stats(map.get(), nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_map_beam(map.get(), 0, &beam) == GPOM_ERR_ARG); // it is empty
}

// Two maps with different parameters, used in turn, answer as each does alone.
TEST_CASE("maps do not influence each other")
{
    GPOM_TELL_SEED();
    const std::vector<gpom_point_t> points = random_points(80, 40, 15.0);
    const gpom_config_t first = config_of(params_of(GPOM_KERNEL_NN));
    gpom_config_t second = config_of(params_of(GPOM_KERNEL_ASKEY, GPOM_FRAME_MAP));
    second.params.n_hits = 3;
    second.params.gap_m = 1.0f;
    std::vector<std::vector<gpom_answer_t>> alone;
    for (const gpom_config_t *config : {&first, static_cast<const gpom_config_t *>(&second)}) {
        TestMap map(*config);
        drive(map.get(), 81, 4);
        alone.push_back(query_points(map.get(), points).all);
    }
    TestMap a(first);
    TestMap b(second);
    Random random_a(81), random_b(81);
    for (int i = 0; i < 4; ++i) {
        REQUIRE(yard_scan(random_a, i, {0, 0}).insert_into(a.get()) == GPOM_OK);
        REQUIRE(yard_scan(random_b, i, {0, 0}).insert_into(b.get()) == GPOM_OK);
        REQUIRE(gpom_map_build(i % 2 == 0 ? a.get() : b.get()) == GPOM_OK);
    }
    CHECK(same_bits(query_points(a.get(), points).all, alone[0]));
    CHECK(same_bits(query_points(b.get(), points).all, alone[1]));
    CHECK_FALSE(same_bits(alone[0], alone[1]));
}

// Clearing forgets the beams and starts their ids again, so that they never run out; counters stay.
TEST_CASE("clear keeps counters and ids start again")
{
    GPOM_TELL_SEED();
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12)));
    drive(map.get(), 82, 2);
    REQUIRE(gpom_map_build(map.get()) == GPOM_OK);
    const gpom_stats_t before = map.stats();
    REQUIRE(gpom_map_clear(map.get()) == GPOM_OK);
    CHECK(gpom_map_beam_count(map.get()) == 0);
    const gpom_stats_t after = map.stats();
    CHECK(std::memcmp(&before, &after, sizeof before) == 0);
    const Answers empty = query_points(map.get(), {{0, 0}});
    CHECK(empty.all[0].n_hits == 0);
    CHECK(empty.all[0].n_free == 0);
    drive(map.get(), 82, 1);
    CHECK(map.beams().front().id == 0);
    CHECK(map.beams().back().id == map.beams().size() - 1);
    CHECK(map.stats().scans_inserted == before.scans_inserted + 1);
}

// Beams that wait for confirmation are forgotten with the others: those that wait later are no
// longer driven out of slots that are not in use.
TEST_CASE("clear forgets who waits for confirmation")
{
    gpom_config_t config = config_of(params_of(GPOM_KERNEL_MATERN12), 400);
    config.keep_m = 0.1f;
    config.clear_scans = 2;
    TestMap map(config);
    std::int64_t n_scans = 0;
    const auto insert = [&](std::size_t n_beams, float range_m) {
        TestScan scan;
        scan.angle_step_rad = 0.05;
        scan.stamp_us = 100000 * ++n_scans;
        scan.ranges_m.assign(n_beams, range_m);
        REQUIRE(scan.insert_into(map.get()) == GPOM_OK);
    };
    insert(50, 20.0f);
    insert(50, 10.0f); // on free segments: these wait
    REQUIRE(gpom_map_beam_count(map.get()) > 60);
    REQUIRE(gpom_map_clear(map.get()) == GPOM_OK);
    insert(5, 20.0f);
    insert(5, 10.0f);
    CHECK(gpom_map_beam_count(map.get()) == 10);
    CHECK(gpom_map_slot_count(map.get()) == 10);
}

// A cleared and refilled map answers as a new one does.
TEST_CASE("a cleared map answers like a new one")
{
    GPOM_TELL_SEED();
    const std::vector<gpom_point_t> points = random_points(83, 50, 15.0);
    TestMap used(config_of(params_of(GPOM_KERNEL_SE)));
    drive(used.get(), 84, 6);
    REQUIRE(gpom_map_build(used.get()) == GPOM_OK);
    REQUIRE(gpom_map_clear(used.get()) == GPOM_OK);
    TestMap fresh(config_of(params_of(GPOM_KERNEL_SE)));
    for (gpom_map_t *map : {used.get(), fresh.get()}) {
        drive(map, 85, 3);
    }
    CHECK(same_bits(query_points(used.get(), points).all, query_points(fresh.get(), points).all));
}

// A map filled to its capacity, built and queried stays inside its exact memory (TestMap's
// canaries), for capacities about the size of a leaf and beyond.
TEST_CASE("a full map stays inside its memory")
{
    GPOM_TELL_SEED();
    for (const std::uint32_t beam_max : {1u, 7u, 8u, 9u, 16u, 17u, 63u, 64u, 65u, 257u}) {
        CAPTURE(beam_max);
        TestMap map(config_of(params_of(GPOM_KERNEL_MATERN32), beam_max));
        Random random(86);
        for (int i = 0; gpom_map_beam_count(map.get()) < beam_max; ++i) {
            CHECK(yard_scan(random, i, {0, 0}).insert_into(map.get()) == GPOM_OK);
        }
        const std::vector<gpom_point_t> points = random_points(87, 20, 20.0);
        const Answers before = query_points(map.get(), points);
        REQUIRE(gpom_map_build(map.get()) == GPOM_OK);
        CHECK(same_bits(query_points(map.get(), points).all, before.all));
    }
}

// Building twice, and building nothing, are harmless.
TEST_CASE("building again or building nothing changes no answer")
{
    GPOM_TELL_SEED();
    const std::vector<gpom_point_t> points = random_points(88, 20, 20.0);
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12)));
    CHECK(gpom_map_build(map.get()) == GPOM_OK);
    CHECK(query_points(map.get(), points).status == GPOM_OK);
    drive(map.get(), 89, 3);
    const Answers recent = query_points(map.get(), points);
    CHECK(gpom_map_build(map.get()) == GPOM_OK);
    CHECK(gpom_map_build(map.get()) == GPOM_OK);
    CHECK(same_bits(query_points(map.get(), points).all, recent.all));
}

// The linked library is the header's, and each status has its own line.
TEST_CASE("version and status texts")
{
    CHECK(gpom_version() == GPOM_VERSION);
    std::vector<std::string> texts;
    for (const gpom_status_t status :
         {GPOM_OK, GPOM_ERR_ARG, GPOM_ERR_MEM, GPOM_ERR_PARAMS, GPOM_ERR_REACH, GPOM_ERR_PIVOT,
          GPOM_ERR_FORMAT, GPOM_ERR_BUSY, GPOM_ERR_IO, GPOM_ERR_CUT,
          static_cast<gpom_status_t>(1)}) {
        texts.emplace_back(gpom_status_str(status));
        CHECK_FALSE(texts.back().empty());
    }
    std::sort(texts.begin(), texts.end());
    CHECK(std::unique(texts.begin(), texts.end()) == texts.end());
}
