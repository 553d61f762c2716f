// The stop example: every state that it can reach, every fault in each.
#include "ports/can/examples/stop.h"

#include <doctest/doctest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <set>
#include <vector>

namespace
{

constexpr std::uint32_t kTick_ms = 50; ///< Time goes in these; two are within the time-out.
constexpr gpom_stop_config_t kConfig = {2 * kTick_ms, 0x4001, 30, 2, 1}; // sectors 0 and 14
constexpr unsigned kWatchedParts = 0x5;

enum class Content { free, unwatched_near, near, unknown, clear, stale, starting, stopping };
constexpr Content kContents[] = {Content::free,     Content::unwatched_near, Content::near,
                                 Content::unknown,  Content::clear,          Content::stale,
                                 Content::starting, Content::stopping};

bool says_free(Content content)
{
    return content == Content::free || content == Content::unwatched_near ||
           content == Content::clear;
}

using Frame = std::array<std::uint8_t, GPOM_CAN_CLASSIC_BYTES>;

Frame frame_of(unsigned i_part, Content content, unsigned alive)
{
    gpom_can_clearance_t message = {};
    message.alive = static_cast<std::uint8_t>(alive);
    message.i_part = static_cast<std::uint8_t>(i_part);
    message.state = static_cast<std::uint8_t>(content == Content::stale      ? GPOM_CAN_STALE
                                              : content == Content::starting ? GPOM_CAN_STARTING
                                              : content == Content::stopping ? GPOM_CAN_STOPPING
                                                                             : GPOM_CAN_MAPPING);
    for (unsigned i = 0; i < GPOM_CAN_SECTORS_IN_FRAME; ++i) {
        const bool is_watched = ((kConfig.sectors >> (5 * i_part + i)) & 1u) != 0;
        unsigned distance = kConfig.distance_min;
        if (is_watched && content == Content::near) {
            distance = kConfig.distance_min - 1u;
        } else if (is_watched && content == Content::unknown) {
            distance = GPOM_CAN_DISTANCE_UNKNOWN;
        } else if (content == Content::clear) {
            distance = GPOM_CAN_DISTANCE_CLEAR;
        } else if (!is_watched && content == Content::unwatched_near) {
            distance = i % 2 == 0 ? 0 : GPOM_CAN_DISTANCE_UNKNOWN;
        }
        message.distance[i] = static_cast<std::uint8_t>(distance);
    }
    Frame frame;
    gpom_can_clearance_pack(&message, frame.data());
    return frame;
}

/// What was said, by the rules in words, not by the example's fields: the last two frames' merits
/// and the last right frame of each part.
struct Truth {
    bool has_alive = false;
    unsigned alive = 0;
    unsigned n_right = 0; ///< In a row, at most 2.
    struct {
        bool says_free = false;
        unsigned age_ticks = 99; ///< At most 3, or never.
    } parts[GPOM_CAN_CLEARANCE_FRAMES];

    void fault()
    {
        n_right = 0;
        for (auto &part : parts) {
            part = {};
        }
    }
    void frame(unsigned i_part, Content content, unsigned alive_now)
    {
        const bool is_next = !has_alive || alive_now == (alive + 1) % 15 ||
                             alive_now == (alive + 2) % 15; // one may be missing
        has_alive = true;
        alive = alive_now;
        if (!is_next) {
            fault();
            return;
        }
        n_right = n_right < 2 ? n_right + 1 : 2;
        parts[i_part].says_free = says_free(content);
        parts[i_part].age_ticks = 0;
    }
    void tick()
    {
        for (auto &part : parts) {
            part.age_ticks = part.age_ticks < 3 ? part.age_ticks + 1 : part.age_ticks;
        }
    }
    bool may_go() const
    {
        bool may = n_right == 2;
        for (unsigned i = 0; i < GPOM_CAN_CLEARANCE_FRAMES; ++i) {
            if (((kWatchedParts >> i) & 1u) != 0) {
                may = may && parts[i].says_free && parts[i].age_ticks <= 2;
            }
        }
        return may;
    }
};

/// The example and the truth side by side; times are from now back, so that states recur.
struct Pair {
    gpom_stop_t stop;
    Truth truth;
};

constexpr std::uint32_t kNow_ms = 40; ///< The clock has just wrapped: older times are near 2^32.

std::vector<std::uint32_t> key_of(const Pair &pair)
{
    std::vector<std::uint32_t> key = {pair.stop.has_alive,  pair.stop.alive,  pair.stop.n_good,
                                      pair.truth.has_alive, pair.truth.alive, pair.truth.n_right};
    for (unsigned i = 0; i < GPOM_CAN_CLEARANCE_FRAMES; ++i) {
        key.push_back(pair.stop.parts[i].is_free);
        key.push_back(kNow_ms - pair.stop.parts[i].came_ms);
        key.push_back(pair.truth.parts[i].says_free);
        key.push_back(pair.truth.parts[i].age_ticks);
    }
    return key;
}

/// Time passes: all that is remembered is so much longer ago. Past the time-out all is one.
void tick(Pair &pair)
{
    for (auto &part : pair.stop.parts) {
        const std::uint32_t age_ms = kNow_ms - part.came_ms;
        part.came_ms = age_ms > 2 * kTick_ms ? part.came_ms : part.came_ms - kTick_ms;
    }
    pair.truth.tick();
}

/// Every frame that can come next: each part and content with each counter; each fault.
std::vector<Pair> successors(const Pair &from)
{
    std::vector<Pair> all;
    for (unsigned i_part = 0; i_part < GPOM_CAN_CLEARANCE_FRAMES; ++i_part) {
        for (const Content content : kContents) {
            for (unsigned ahead = 0; ahead < 5; ++ahead) {
                const unsigned alive = (from.stop.alive + ahead) % 15;
                all.push_back(from);
                const Frame frame = frame_of(i_part, content, alive);
                gpom_stop_on_frame(&all.back().stop, frame.data(), frame.size(), kNow_ms);
                all.back().truth.frame(i_part, content, alive);
            }
        }
    }
    Frame damaged = frame_of(0, Content::free, (from.stop.alive + 1) % 15);
    damaged[4] = static_cast<std::uint8_t>(damaged[4] ^ 0x40);
    const Frame short_frame = frame_of(0, Content::free, (from.stop.alive + 1) % 15);
    const Frame other_part = frame_of(3, Content::free, (from.stop.alive + 1) % 15);
    const Frame no_counter = frame_of(0, Content::free, 15);
    const struct {
        const std::uint8_t *bytes;
        std::size_t n_bytes;
    } faults[] = {{damaged.data(), 8},    {short_frame.data(), 7}, {short_frame.data(), 0},
                  {other_part.data(), 8}, {no_counter.data(), 8},  {nullptr, 8}};
    for (const auto &fault : faults) {
        all.push_back(from);
        gpom_stop_on_frame(&all.back().stop, fault.bytes, fault.n_bytes, kNow_ms);
        all.back().truth.fault();
    }
    all.push_back(from);
    tick(all.back());
    return all;
}

Pair beginning()
{
    Pair pair = {};
    std::memset(static_cast<void *>(&pair.stop), 0xFF, sizeof pair.stop); // memory of any content
    gpom_stop_init(&pair.stop, &kConfig);
    return pair;
}

} // namespace

// Closure over all reachable states: from each, every frame, every fault and the passing of time.
TEST_CASE("in every state that can be reached the example goes only if all rules hold")
{
    std::set<std::vector<std::uint32_t>> seen;
    std::deque<Pair> open = {beginning()};
    seen.insert(key_of(open.front()));
    std::size_t n_wrong = 0, n_timid = 0, n_go = 0;
    while (!open.empty()) {
        Pair pair = open.front();
        open.pop_front();
        for (Pair &next : successors(pair)) {
            const bool goes = gpom_stop_may_go(&next.stop, kNow_ms);
            n_wrong += goes && !next.truth.may_go() ? 1 : 0;
            n_timid += !goes && next.truth.may_go() ? 1 : 0;
            n_go += goes ? 1 : 0;
            if (seen.insert(key_of(next)).second) {
                open.push_back(next);
            }
        }
    }
    CHECK(n_wrong == 0);
    CHECK(n_timid == 0);
    CHECK(n_go > 1000); // and it does go
    CHECK(seen.size() > 10000);
    MESSAGE(seen.size(), " states, ", n_go, " steps to go");
}

TEST_CASE("a good picture goes, and every damage of one or two bits stops at once")
{
    Pair pair = beginning();
    const auto show = [&](unsigned i_part, unsigned alive) {
        const Frame frame = frame_of(i_part, Content::free, alive);
        gpom_stop_on_frame(&pair.stop, frame.data(), frame.size(), kNow_ms);
        return gpom_stop_may_go(&pair.stop, kNow_ms);
    };
    CHECK_FALSE(gpom_stop_may_go(&pair.stop, kNow_ms));
    CHECK_FALSE(show(0, 3));
    CHECK_FALSE(show(1, 4));
    CHECK(show(2, 5));
    CHECK(show(0, 6));
    CHECK(gpom_stop_may_go(&pair.stop, kNow_ms + kConfig.timeout_ms));
    for (unsigned a = 0; a < 64; ++a) {
        for (unsigned b = a; b < 64; ++b) {
            gpom_stop_t stop = pair.stop;
            Frame bad = frame_of(1, Content::free, 7);
            bad[a / 8] = static_cast<std::uint8_t>(bad[a / 8] ^ (1u << a % 8));
            if (b != a) {
                bad[b / 8] = static_cast<std::uint8_t>(bad[b / 8] ^ (1u << b % 8));
            }
            gpom_stop_on_frame(&stop, bad.data(), bad.size(), kNow_ms);
            CHECK_FALSE(gpom_stop_may_go(&stop, kNow_ms));
        }
    }
    CHECK_FALSE(gpom_stop_may_go(&pair.stop, kNow_ms + kConfig.timeout_ms + 1));
    CHECK_FALSE(gpom_stop_may_go(&pair.stop, kNow_ms)); // what was too old once stays so
}

TEST_CASE("a stop that watches nothing or asks for no good frame never goes")
{
    for (const gpom_stop_config_t &config :
         {gpom_stop_config_t{1000, 0, 30, 2, 1}, gpom_stop_config_t{1000, 1, 30, 0, 1}}) {
        gpom_stop_t stop;
        gpom_stop_init(&stop, &config);
        for (unsigned i = 0; i < 12; ++i) {
            const Frame frame = frame_of(i % 3, Content::clear, i);
            gpom_stop_on_frame(&stop, frame.data(), frame.size(), i);
            CHECK_FALSE(gpom_stop_may_go(&stop, i));
        }
    }
}
