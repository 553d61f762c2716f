#include "src/snapshot/snapshot_format.hpp"

#include "gpom/crc32.h"
#include "src/base/assert.hpp"
#include "src/base/check.hpp"
#include "src/beams/index.hpp"

namespace gpom
{

namespace
{

constexpr uint32_t kMagic = 0x534d5047; // the bytes are "GPMS" in their order
constexpr auto kFormat = static_cast<uint16_t>(GPOM_MAP_FORMAT);
constexpr uint16_t kFormatBefore = kFormat - 1;

/// Size of the hyperparameters in a commit block, which may be of this or of the previous format.
uint32_t params_bytes(const uint8_t *block)
{
    Decoder from = {block + sizeof kMagic};
    return take<uint16_t>(from) == kFormat ? GPOM_PARAMS_RECORD_BYTES : kRecordBytesBefore;
}

/// The bit fields of a beam as one number. The first field is in the lowest bits.
uint16_t bits_of_beam(const Beam &beam)
{
    return static_cast<uint16_t>(beam.returned | beam.hit << 1 | beam.has_free << 3 |
                                 beam.agreed << 4 | beam.hit_against << 8 | beam.arrived << 10 |
                                 beam.hit_time << 11);
}

void set_bits(Beam &beam, uint32_t bits)
{
    beam.returned = bits & 1u;
    beam.hit = bits >> 1 & 3u;
    beam.has_free = bits >> 3 & 1u;
    beam.agreed = bits >> 4 & 15u;
    beam.hit_against = bits >> 8 & 3u;
    beam.arrived = bits >> 10 & 1u;
    beam.hit_time = bits >> 11 & kTimeMarkMask;
}

/// Transfer all fields of a beam. Writing and reading both use this list.
template <class Stream, class SomeBeam, class Bits>
void transfer(Stream &stream, SomeBeam &beam, Bits &bits)
{
    stream(beam.x_m);
    stream(beam.y_m);
    stream(beam.dir_x);
    stream(beam.dir_y);
    stream(beam.range_m);
    stream(beam.excess);
    stream(beam.id);
    stream(beam.stamp_ms);
    stream(beam.scan);
    stream(bits);
}

/// Transfer all fields of a commit. Writing and reading both use this list.
template <class Stream, class SomeCommit> void transfer(Stream &stream, SomeCommit &commit)
{
    stream(commit.n_beams);
    stream(commit.blocks_crc);
    stream(commit.next_id);
    stream(commit.time_number);
    stream(commit.hand);
    stream(commit.stamp_ms);
    stream(commit.frame_epoch);
    stream(commit.time_mark);
    stream(commit.n_counters);
    stream(commit.stamp0_us);
    stream(commit.stamp_us);
    stream(commit.origin_x_m);
    stream(commit.origin_y_m);
    stream(commit.robot_x_m);
    stream(commit.robot_y_m);
}

/// Greatest distances from the origin. A sensor is within GPOM_REACH_M of the origin. But
/// gpom_map_forget() may leave a beam that starts near its far end, and the robot may be away from
/// the sensor.
constexpr float kBeamPlaceMax_m = static_cast<float>(2.0 * GPOM_REACH_M);
constexpr float kRobotPlaceMax_m = static_cast<float>(4.0 * GPOM_REACH_M);

bool is_in_circle(float x_m, float y_m, float radius_m)
{
    return x_m * x_m + y_m * y_m <= radius_m * radius_m;
}

bool is_place(double x_m) { return is_within(x_m, GPOM_PLACE_MAX_M); }

bool is_beam(const Beam &beam)
{
    const float length2 = beam.dir_x * beam.dir_x + beam.dir_y * beam.dir_y;
    const bool is_ray = is_in_circle(beam.x_m, beam.y_m, kBeamPlaceMax_m) &&
                        length2 >= 1.0f - 1e-5f && length2 <= 1.0f + 1e-5f && beam.range_m > 0.0f &&
                        beam.range_m <= static_cast<float>(GPOM_REACH_M);
    const bool is_noise = beam.excess >= 0.0f && beam.excess <= kExcessMax;
    const bool has_part = has_hit(beam) || beam.has_free != 0;
    const bool hit_returned = !has_hit(beam) || beam.returned != 0;
    return is_ray && is_noise && has_part && hit_returned && beam.id < kIdEnd;
}

} // namespace

void seal_block(uint8_t *block, const BlockHead &head)
{
    Encoder to = {block};
    to(kMagic);
    to(kFormat);
    to(static_cast<uint8_t>(head.kind));
    to(head.n_beams);
    to(head.sequence);
    to(head.index);
    GPOM_ASSERT(to.at == block + kBodyAt);
    Encoder crc_to = {block + kCrcAt};
    crc_to(gpom_crc32(block, kCrcAt));
}

bool open_block(const uint8_t *block, BlockHead &head)
{
    Decoder crc_from = {block + kCrcAt};
    if (take<uint32_t>(crc_from) != gpom_crc32(block, kCrcAt)) {
        return false;
    }
    Decoder from = {block};
    const bool is_ours = take<uint32_t>(from) == kMagic;
    const auto format = take<uint16_t>(from);
    if (!is_ours || (format != kFormat && format != kFormatBefore)) {
        return false;
    }
    const auto kind = take<uint8_t>(from);
    from(head.n_beams);
    from(head.sequence);
    from(head.index);
    head.kind = static_cast<BlockKind>(kind);
    return (head.kind == BlockKind::kBeams && head.n_beams <= GPOM_SNAPSHOT_BLOCK_BEAMS) ||
           (head.kind == BlockKind::kCommit && head.n_beams == 0);
}

void put_beam(Encoder &to, const Beam &beam)
{
    GPOM_ASSERT(is_beam(beam));
    const uint16_t bits = bits_of_beam(beam);
    transfer(to, beam, bits);
}

bool take_beam(Decoder &from, Beam &beam)
{
    uint16_t bits = 0;
    transfer(from, beam, bits);
    set_bits(beam, bits);
    return is_beam(beam);
}

void put_commit(uint8_t *block, const Commit &commit, const gpom_stats_t &stats)
{
    Encoder to = {block + kBodyAt};
    transfer(to, commit);
    GPOM_ASSERT(to.at == block + kParamsAt);
    Encoder counters_to = {block + kCountersAt};
    const auto *const counters = reinterpret_cast<const unsigned char *>(&stats);
    for (uint32_t i = 0; i < kCounters; ++i) {
        uint64_t counter;
        memcpy(&counter, counters + 8 * i, sizeof counter);
        counters_to(counter);
    }
}

bool take_commit(const uint8_t *block, Commit &commit)
{
    Decoder from = {block + kBodyAt};
    transfer(from, commit);
    return commit.next_id <= kIdEnd && commit.time_mark <= kTimeMarkMask &&
           commit.n_counters >= 1 && commit.n_counters <= kCountersMax &&
           is_place(commit.origin_x_m) && is_place(commit.origin_y_m) &&
           is_in_circle(commit.robot_x_m, commit.robot_y_m, kRobotPlaceMax_m);
}

bool has_params(const uint8_t *block, const uint8_t *record)
{
    const uint32_t end = params_bytes(block) - kRecordCrcBytes;
    if (memcmp(block + kParamsAt + kRecordHeadBytes, record + kRecordHeadBytes,
               end - kRecordHeadBytes) != 0) {
        return false;
    }
    for (uint32_t i = end; i < GPOM_PARAMS_RECORD_BYTES - kRecordCrcBytes; ++i) {
        if (record[i] != 0) { // a field that the previous format lacks has an effect
            return false;
        }
    }
    return true;
}

void take_counters(const uint8_t *block, uint32_t n_counters, gpom_stats_t &stats)
{
    static_assert(sizeof stats == 8 * kCounters, "not only counters");
    stats = gpom_stats_t{};
    Decoder from = {block + kParamsAt + params_bytes(block)};
    auto *const counters = reinterpret_cast<unsigned char *>(&stats);
    for (uint32_t i = 0; i < kCounters && i < n_counters; ++i) {
        const auto counter = take<uint64_t>(from);
        memcpy(counters + 8 * i, &counter, sizeof counter);
    }
}

} // namespace gpom
