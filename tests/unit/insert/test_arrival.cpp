// What arrives where the map was free, and what becomes of the free segments there.
#include "src/map/map.hpp"
#include "tests/common/keeping.hpp"

using namespace reference;

namespace
{

/// Free segments of beams 0 to 63.
std::size_t n_first_free(const Keeping &k)
{
    const std::vector<gpom_beam_t> all = k.map.beams();
    return static_cast<std::size_t>(std::count_if(
        all.begin(), all.end(), [](const auto &b) { return b.id < 64 && b.is_free == 1; }));
}

/// 64 free beams all around, then at time 1 a surface between them, 6 m away: its hits are 0.59 m
/// apart and 0.29 m beside the beams, so that none waits.
TestScan surface_between(int i_time)
{
    TestScan s = look_around({0, 0}, 64, 6.0f, i_time);
    s.pose.yaw_rad += kPi / 64;
    return s;
}

} // namespace

// A surface that arrives where free segments run, and is seen at three more times, takes the place
// from all of them, also from those that pass between its hits.
TEST_CASE("a surface that arrived takes the place from free segments")
{
    Keeping k(keep_config(2, 4096));
    k.see(look_around({0, 0}, 64, kInf, 0));
    CHECK(k.see(surface_between(1)).beams_hit == 64);
    CHECK(k.n_provisional() == 0);
    for (int i = 2; i < 4; ++i) {
        CHECK(k.see(surface_between(i)).beams_known == 64);
        CHECK(n_first_free(k) == 64);
    }
    k.see(surface_between(4));
    CHECK(n_first_free(k) == 0);
}

// Nothing gives way to a surface that beams passed since it was first seen.
TEST_CASE("a surface that beams go through takes nothing away")
{
    Keeping k(keep_config(3, 4096));
    k.see(look_around({0, 0}, 64, kInf, 0));
    k.see(surface_between(1));
    k.see(surface_between(2));
    TestScan through = surface_between(3);
    through.ranges_m.assign(64, kInf);
    k.see(through);
    for (int i = 4; i < 12; ++i) {
        k.see(surface_between(i));
    }
    CHECK(n_first_free(k) == 64);
}

// A hit that lost its free segment to something that came between is seen anew when that has gone:
// one beam stands there again, with hit and free segment.
TEST_CASE("a beam renews the hit whose free segment gave way")
{
    Keeping k(keep_config(2));
    k.see(look({0, 0}, 0.0, 20.0, 0));
    k.see(look({4.0, 2.0}, -kPi / 2, 2.0, 1));
    k.see(look({4.0, 2.0}, -kPi / 2, 2.0, 2));
    REQUIRE(k.beam(0).is_free == 0);
    for (int i = 3; i < 8; ++i) {
        k.see(look({0, 0}, 0.0, 20.0, i));
    }
    std::size_t n_there = 0;
    for (const gpom_beam_t &b : k.map.beams()) {
        const bool is_there = b.is_hit == 1 && std::fabs(b.range_m - 20.0f) < 1e-3f;
        n_there += is_there ? 1 : 0;
        CHECK((!is_there || b.is_free == 1));
    }
    CHECK(n_there == 1);
    CHECK(k.ask({10, 0}).mean < 0.0f);
}

// Without an id for the new beam the old one, and what it tells, stays.
TEST_CASE("no hit is lost to a renewal for which there is no id left")
{
    Keeping k(keep_config(2));
    k.see(look({0, 0}, 0.0, 20.0, 0));
    k.see(look({4.0, 2.0}, -kPi / 2, 2.0, 1));
    k.see(look({4.0, 2.0}, -kPi / 2, 2.0, 2));
    REQUIRE(k.beam(0).is_free == 0);
    k.map.get()->index.next_id = gpom::kIdEnd;
    for (int i = 3; i < 8; ++i) {
        k.see(look({0, 0}, 0.0, 20.0, i));
    }
    CHECK(k.map.stats().hits_cleared == 1); // what came between
    CHECK(k.stands(0));
}
