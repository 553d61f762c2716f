// The codec reads what lcm-gen writes and writes what lcm-gen reads: each field, each byte.
#include "gpom/distances.h"
#include "tests/codec/samples.hpp"

#include <doctest/doctest.h>

#include <cstring>

#include "peer/bot_core/planar_lidar_t.hpp"
#include "peer/bot_core/pose_t.hpp"
#include "peer/gpom/answer_t.hpp"
#include "peer/gpom/distances_t.hpp"
#include "peer/gpom/map_t.hpp"
#include "peer/gpom/query_t.hpp"
#include "peer/gpom/scan_t.hpp"
#include "peer/gpom/status_t.hpp"
#include "peer/mbot_lcm_msgs/lidar_t.hpp"
#include "peer/mbot_lcm_msgs/occupancy_grid_t.hpp"
#include "peer/mbot_lcm_msgs/pose2D_t.hpp"
#include "peer/occ_map/pixel_map_t.hpp"

namespace
{

constexpr int kRounds = 50;

/// Equal bits: NaN equals itself, -0 does not equal 0.
template <class T, class U> bool same(const T &ours, const U &theirs)
{
    static_assert(sizeof(T) == sizeof(U), "another width");
    return std::memcmp(&ours, &theirs, sizeof ours) == 0;
}
template <class T> bool same(const T *ours, const T *theirs, std::int32_t n)
{
    return n == 0 || std::memcmp(ours, theirs, sizeof(T) * static_cast<std::size_t>(n)) == 0;
}

/// Our decoding of lcm-gen's C bytes, given to `compare`; our encoding must give the same bytes,
/// and lcm-gen's C++ class must read and write the same too.
template <class Cpp, class Peer, class M, class Decode, class Encode, class Compare>
void check(M message, Decode decode, Encode encode, Compare compare)
{
    Random random = make_random();
    for (int round = 0; round < kRounds; ++round) {
        Sample<Peer> sample;
        make(sample, random);
        REQUIRE(decode(&message, sample.bytes.data(), sample.bytes.size()) == GPOM_WIRE_OK);
        compare(message, sample.peer);
        Bytes ours(sample.bytes.size());
        CHECK(encode(&message, ours.data(), ours.size()) == ours.size());
        CHECK(ours == sample.bytes);
        Cpp cpp = {};
        const int n_bytes = static_cast<int>(ours.size());
        CHECK(cpp.decode(ours.data(), 0, n_bytes) == n_bytes);
        Bytes theirs(ours.size());
        CHECK(cpp.encode(theirs.data(), 0, n_bytes) == n_bytes);
        CHECK(theirs == ours);
    }
}

} // namespace

// As lcm-gen computes them, and as listed for the foreign types from the code bases they come from.
TEST_CASE("fingerprints are those of lcm-gen's C and C++ code")
{
    const auto bits = [](std::int64_t hash) { return static_cast<std::uint64_t>(hash); };
    CHECK(bits(__peer_gpom_scan_t_get_hash()) == GPOM_WIRE_SCAN_FINGERPRINT);
    CHECK(bits(__peer_gpom_map_t_get_hash()) == GPOM_WIRE_MAP_FINGERPRINT);
    CHECK(bits(__peer_gpom_distances_t_get_hash()) == GPOM_WIRE_DISTANCES_FINGERPRINT);
    CHECK(bits(__peer_gpom_status_t_get_hash()) == GPOM_WIRE_STATUS_FINGERPRINT);
    CHECK(bits(__peer_gpom_query_t_get_hash()) == GPOM_WIRE_QUERY_FINGERPRINT);
    CHECK(bits(__peer_gpom_answer_t_get_hash()) == GPOM_WIRE_ANSWER_FINGERPRINT);
    CHECK(bits(__peer_bot_core_planar_lidar_t_get_hash()) == UINT64_C(0xe3d17423180b5e8d));
    CHECK(bits(__peer_bot_core_pose_t_get_hash()) == UINT64_C(0x2e16efb052b0105e));
    CHECK(bits(__peer_mbot_lcm_msgs_lidar_t_get_hash()) == UINT64_C(0x89dc5b879a5056cf));
    CHECK(bits(__peer_mbot_lcm_msgs_pose2D_t_get_hash()) == UINT64_C(0x1f317af1246276ac));
    CHECK(bits(__peer_mbot_lcm_msgs_occupancy_grid_t_get_hash()) == UINT64_C(0xd5447e494a66cc92));
    CHECK(bits(__peer_occ_map_pixel_map_t_get_hash()) == UINT64_C(0xe4b099a4cce13107));
    CHECK(bits(peer::gpom::query_t::getHash()) == GPOM_WIRE_QUERY_FINGERPRINT);
    CHECK(bits(peer::gpom::answer_t::getHash()) == GPOM_WIRE_ANSWER_FINGERPRINT);
    CHECK(bits(peer::occ_map::pixel_map_t::getHash()) == GPOM_WIRE_PIXEL_MAP_FINGERPRINT);
}

// The headers' sizes are what is sent.
TEST_CASE("the size macros say how long a message is")
{
    Random random = make_random();
    Sample<peer_gpom_scan_t> scan;
    make(scan, random);
    CHECK(scan.bytes.size() == GPOM_WIRE_SCAN_BYTES(scan.peer.n_ranges));
    Sample<peer_gpom_map_t> map;
    make(map, random);
    CHECK(map.bytes.size() == GPOM_WIRE_MAP_BYTES(map.peer.n_cells));
    Sample<peer_gpom_distances_t> distances;
    make(distances, random);
    CHECK(distances.bytes.size() == GPOM_WIRE_DISTANCES_BYTES(distances.peer.n_cells));
    Sample<peer_gpom_status_t> status;
    make(status, random);
    CHECK(status.bytes.size() == GPOM_WIRE_STATUS_BYTES);
    Sample<peer_gpom_query_t> query;
    make(query, random);
    CHECK(query.bytes.size() == GPOM_WIRE_QUERY_BYTES(query.peer.n_points));
    Sample<peer_gpom_answer_t> answer;
    make(answer, random);
    CHECK(answer.bytes.size() == GPOM_WIRE_ANSWER_BYTES(answer.peer.n_points));
}

// The largest of gpom's bounded messages, with the longest channel name, needs no IP fragments.
TEST_CASE("tile, status, query and answer fit one datagram")
{
    const std::size_t around = GPOM_WIRE_SHORT_HEADER_BYTES + GPOM_WIRE_CHANNEL_MAX + 1;
    CHECK(GPOM_WIRE_MAP_CELLS_MAX == 651);
    CHECK(around + GPOM_WIRE_MAP_BYTES(GPOM_WIRE_MAP_CELLS_MAX) <= GPOM_WIRE_DATAGRAM_BYTES);
    CHECK(GPOM_WIRE_DISTANCES_CELLS_MAX == 166);
    CHECK(around + GPOM_WIRE_DISTANCES_BYTES(GPOM_WIRE_DISTANCES_CELLS_MAX) <=
          GPOM_WIRE_DATAGRAM_BYTES);
    CHECK(around + GPOM_WIRE_STATUS_BYTES <= GPOM_WIRE_DATAGRAM_BYTES);
    CHECK(around + GPOM_WIRE_QUERY_BYTES(GPOM_WIRE_POINTS_MAX) <= GPOM_WIRE_DATAGRAM_BYTES);
    CHECK(around + GPOM_WIRE_ANSWER_BYTES(GPOM_WIRE_POINTS_MAX) <= GPOM_WIRE_DATAGRAM_BYTES);
}

// One number, one name: subscribers take the .lcm's, the firmware the header's.
TEST_CASE("constants of the definitions are those of the headers")
{
    CHECK(PEER_GPOM_MAP_T_CLASS_FREE == GPOM_WIRE_FREE);
    CHECK(PEER_GPOM_MAP_T_CLASS_UNSURE == GPOM_WIRE_UNSURE);
    CHECK(PEER_GPOM_MAP_T_CLASS_OCCUPIED == GPOM_WIRE_OCCUPIED);
    CHECK(PEER_GPOM_MAP_T_CLASS_UNKNOWN == GPOM_WIRE_UNKNOWN);
    CHECK(PEER_GPOM_MAP_T_PROBABILITY_UNKNOWN == GPOM_WIRE_PROBABILITY_UNKNOWN);
    CHECK(PEER_GPOM_DISTANCES_T_OFFSET_NONE == GPOM_WIRE_OFFSET_NONE);
    CHECK(GPOM_OFFSET_NONE == GPOM_WIRE_OFFSET_NONE);
    CHECK(GPOM_FREE == static_cast<int>(GPOM_WIRE_FREE));
    CHECK(GPOM_UNSURE == static_cast<int>(GPOM_WIRE_UNSURE));
    CHECK(GPOM_OCCUPIED == static_cast<int>(GPOM_WIRE_OCCUPIED));
    CHECK(PEER_GPOM_QUERY_T_POINTS == GPOM_WIRE_QUERY_POINTS);
    CHECK(PEER_GPOM_QUERY_T_PATH == GPOM_WIRE_QUERY_PATH);
    CHECK(PEER_GPOM_QUERY_T_POINTS_MAX == GPOM_WIRE_POINTS_MAX);
    CHECK(PEER_GPOM_ANSWER_T_OK == GPOM_WIRE_ANSWER_OK);
    CHECK(PEER_GPOM_ANSWER_T_TOO_MANY == GPOM_WIRE_ANSWER_TOO_MANY);
    CHECK(PEER_GPOM_ANSWER_T_BAD_STEP == GPOM_WIRE_ANSWER_BAD_STEP);
    CHECK(PEER_GPOM_ANSWER_T_OUT_OF_REACH == GPOM_WIRE_ANSWER_OUT_OF_REACH);
    CHECK(PEER_GPOM_ANSWER_T_NO_CRC == GPOM_WIRE_ANSWER_NO_CRC);
    CHECK(PEER_GPOM_STATUS_T_STARTING == GPOM_WIRE_STATE_STARTING);
    CHECK(PEER_GPOM_STATUS_T_MAPPING == GPOM_WIRE_STATE_MAPPING);
    CHECK(PEER_GPOM_STATUS_T_STALE == GPOM_WIRE_STATE_STALE);
    CHECK(PEER_GPOM_STATUS_T_STOPPING == GPOM_WIRE_STATE_STOPPING);
    CHECK(PEER_OCC_MAP_PIXEL_MAP_T_TYPE_FLOAT == GPOM_WIRE_PIXEL_FLOAT);
    CHECK(PEER_OCC_MAP_PIXEL_MAP_T_TYPE_DOUBLE == GPOM_WIRE_PIXEL_DOUBLE);
    CHECK(PEER_OCC_MAP_PIXEL_MAP_T_TYPE_INT32 == GPOM_WIRE_PIXEL_INT32);
    CHECK(PEER_OCC_MAP_PIXEL_MAP_T_TYPE_UINT32 == GPOM_WIRE_PIXEL_UINT32);
    CHECK(PEER_OCC_MAP_PIXEL_MAP_T_TYPE_INT16 == GPOM_WIRE_PIXEL_INT16);
    CHECK(PEER_OCC_MAP_PIXEL_MAP_T_TYPE_UINT16 == GPOM_WIRE_PIXEL_UINT16);
    CHECK(PEER_OCC_MAP_PIXEL_MAP_T_TYPE_INT8 == GPOM_WIRE_PIXEL_INT8);
    CHECK(PEER_OCC_MAP_PIXEL_MAP_T_TYPE_UINT8 == GPOM_WIRE_PIXEL_UINT8);
}

#define CHECK_COUNT(name) CHECK(PEER_GPOM_STATUS_T_##name == static_cast<int>(GPOM_WIRE_##name))

TEST_CASE("the status counters stand in the same places in definition and header")
{
    CHECK_COUNT(SCANS_RECEIVED);
    CHECK_COUNT(SCANS_INSERTED);
    CHECK_COUNT(SCANS_BAD_POSE);
    CHECK_COUNT(SCANS_OUT_OF_REACH);
    CHECK_COUNT(SCANS_OTHER_TYPE);
    CHECK_COUNT(SCANS_CORRUPT);
    CHECK_COUNT(SCANS_MALFORMED);
    CHECK_COUNT(SCANS_LOST);
    CHECK_COUNT(SCANS_REPEATED);
    CHECK_COUNT(SCANS_REORDERED);
    CHECK_COUNT(SCANS_TOO_OLD);
    CHECK_COUNT(SCANS_TOO_NEW);
    CHECK_COUNT(SCANS_JUMPED_BACK);
    CHECK_COUNT(SCANS_NO_POSE);
    CHECK_COUNT(SCANS_OVERRUN);
    CHECK_COUNT(TIME_GAPS);
    CHECK_COUNT(POSES_RECEIVED);
    CHECK_COUNT(POSES_REFUSED);
    CHECK_COUNT(BEAMS_HIT);
    CHECK_COUNT(BEAMS_NO_RETURN);
    CHECK_COUNT(BEAMS_NAN);
    CHECK_COUNT(BEAMS_NOT_POSITIVE);
    CHECK_COUNT(BEAMS_TOO_NEAR);
    CHECK_COUNT(BEAMS_MASKED);
    CHECK_COUNT(BEAMS_FULL);
    CHECK_COUNT(BEAMS_KNOWN);
    CHECK_COUNT(BEAMS_CONTRADICTING);
    CHECK_COUNT(BEAMS_IDS_SPENT);
    CHECK_COUNT(KEPT_EVICTED);
    CHECK_COUNT(MAPS_PUBLISHED);
    CHECK_COUNT(TILES_PUBLISHED);
    CHECK_COUNT(QUERIES_ANSWERED);
    CHECK_COUNT(QUERIES_REFUSED);
    CHECK_COUNT(SNAPSHOTS_WRITTEN);
    CHECK_COUNT(SNAPSHOTS_FAILED);
    CHECK_COUNT(GRIDS_NOT_SENT);
    CHECK_COUNT(CAN_RECEIVED);
    CHECK_COUNT(CAN_BAD_LENGTH);
    CHECK_COUNT(CAN_BAD_CRC);
    CHECK_COUNT(CAN_BAD_COUNTER);
    CHECK_COUNT(CAN_BAD_VALUE);
    CHECK_COUNT(CAN_LOST);
    CHECK_COUNT(CAN_REORDERED);
    CHECK_COUNT(CAN_ERRORS);
    CHECK_COUNT(CAN_BUS_OFFS);
    CHECK_COUNT(CAN_OVERFLOWS);
    CHECK_COUNT(CAN_DOWNS);
    CHECK_COUNT(CAN_SENT);
    CHECK_COUNT(CAN_NOT_SENT);
    CHECK_COUNT(ODOMETRY_GAPS);
    CHECK_COUNT(DATAGRAMS_LOST);
    CHECK_COUNT(DATAGRAMS_OTHER);
    CHECK_COUNT(DATAGRAMS_MALFORMED);
    CHECK_COUNT(FRAGMENTS_OVERLONG);
    CHECK_COUNT(FRAGMENTS_INCONSISTENT);
    CHECK_COUNT(FRAGMENTS_REPEATED);
    CHECK_COUNT(FRAGMENTS_LATE);
    CHECK_COUNT(MESSAGES_TIMED_OUT);
    CHECK_COUNT(MESSAGES_EVICTED);
    CHECK_COUNT(MESSAGES_NOT_SENT);
}

TEST_CASE("gpom.scan_t is read and written as lcm-gen does")
{
    std::vector<float> ranges(400);
    gpom_wire_scan_t message = {};
    message.ranges_m = {ranges.data(), 400, 0};
    check<peer::gpom::scan_t, peer_gpom_scan_t>(
        message, gpom_wire_scan_decode, gpom_wire_scan_encode, [](const auto &m, const auto &p) {
            CHECK(m.stamp_us == p.utime);
            CHECK(same(m.sequence, p.sequence));
            CHECK(same(m.sensor_id, p.sensor_id));
            CHECK(same(m.pose, p.pose));
            CHECK(same(m.pose_cov, p.pose_cov));
            CHECK(same(m.angle_min_rad, p.angle_min));
            CHECK(same(m.angle_step_rad, p.angle_step));
            CHECK(same(m.ranges_m.n, p.n_ranges));
            CHECK(same(m.ranges_m.values, p.ranges, p.n_ranges));
        });
}

/// True if the codec's offsets are those of lcm-gen's array, each read and written back.
bool same_offsets(const std::uint8_t *ours, const std::int16_t *theirs, std::int32_t n)
{
    std::vector<std::uint8_t> again(static_cast<std::size_t>(2 * n) + 1);
    for (std::int32_t i = 0; i < n; ++i) {
        const auto place = static_cast<std::uint32_t>(i);
        if (gpom_wire_offset(ours, place) != theirs[i]) {
            return false;
        }
        gpom_wire_offset_put(again.data(), place, theirs[i]);
    }
    return n == 0 || std::memcmp(ours, again.data(), static_cast<std::size_t>(2 * n)) == 0;
}

TEST_CASE("gpom.distances_t is read and written as lcm-gen does")
{
    check<peer::gpom::distances_t, peer_gpom_distances_t>(
        gpom_wire_distances_t{}, gpom_wire_distances_decode, gpom_wire_distances_encode,
        [](const auto &m, const auto &p) {
            CHECK(m.stamp_us == p.utime);
            CHECK(same(m.sequence, p.sequence));
            CHECK(same(m.i_tile, p.i_tile));
            CHECK(same(m.n_tiles, p.n_tiles));
            CHECK(same(m.keyframe, p.keyframe));
            CHECK(m.frame_epoch == p.frame_epoch);
            CHECK(same(m.corner_m, p.corner));
            CHECK(same(m.cell_m, p.cell_m));
            CHECK(same(m.map_nx, p.map_nx));
            CHECK(same(m.map_ny, p.map_ny));
            CHECK(same(m.ix0, p.ix0));
            CHECK(same(m.iy0, p.iy0));
            CHECK(same(m.nx, p.nx));
            CHECK(same(m.ny, p.ny));
            CHECK(same_offsets(m.occupied_dx, p.occupied_dx, p.n_cells));
            CHECK(same_offsets(m.occupied_dy, p.occupied_dy, p.n_cells));
            CHECK(same_offsets(m.not_free_dx, p.not_free_dx, p.n_cells));
            CHECK(same_offsets(m.not_free_dy, p.not_free_dy, p.n_cells));
        });
}

// A subscriber may follow an offset without a check of its own.
TEST_CASE("an offset that leaves the map, or is none in one direction alone, is refused")
{
    std::uint8_t bytes[GPOM_WIRE_DISTANCES_BYTES(1)];
    std::uint8_t offsets[4][2];
    gpom_wire_distances_t m = {};
    m.n_tiles = m.nx = m.ny = 1;
    m.map_nx = m.map_ny = 10;
    m.ix0 = 4;
    m.iy0 = 7;
    m.occupied_dx = offsets[0], m.occupied_dy = offsets[1];
    m.not_free_dx = offsets[2], m.not_free_dy = offsets[3];
    const auto is_taken = [&](std::size_t kind, std::int16_t dx, std::int16_t dy) {
        for (std::size_t i = 0; i < 4; ++i) {
            gpom_wire_offset_put(offsets[i], 0, 0);
        }
        gpom_wire_offset_put(offsets[2 * kind], 0, dx);
        gpom_wire_offset_put(offsets[2 * kind + 1], 0, dy);
        return gpom_wire_distances_encode(&m, bytes, sizeof bytes) == sizeof bytes;
    };
    for (const std::size_t kind : {0u, 1u}) {
        CHECK(is_taken(kind, -4, -7));
        CHECK(is_taken(kind, 5, 2));
        CHECK(is_taken(kind, GPOM_WIRE_OFFSET_NONE, GPOM_WIRE_OFFSET_NONE));
        CHECK_FALSE(is_taken(kind, -5, 0));
        CHECK_FALSE(is_taken(kind, 6, 0));
        CHECK_FALSE(is_taken(kind, 0, -8));
        CHECK_FALSE(is_taken(kind, 0, 3));
        CHECK_FALSE(is_taken(kind, GPOM_WIRE_OFFSET_NONE, 0));
        CHECK_FALSE(is_taken(kind, 0, GPOM_WIRE_OFFSET_NONE));
    }
}

TEST_CASE("gpom.map_t is read and written as lcm-gen does")
{
    check<peer::gpom::map_t, peer_gpom_map_t>(
        gpom_wire_map_t{}, gpom_wire_map_decode, gpom_wire_map_encode,
        [](const auto &m, const auto &p) {
            CHECK(m.stamp_us == p.utime);
            CHECK(same(m.map_sequence, p.map_sequence));
            CHECK(same(m.i_tile, p.i_tile));
            CHECK(same(m.n_tiles, p.n_tiles));
            CHECK(same(m.keyframe, p.keyframe));
            CHECK(m.frame_epoch == p.frame_epoch);
            CHECK(same(m.pose, p.pose));
            CHECK(same(m.corner_m, p.corner));
            CHECK(same(m.cell_m, p.cell_m));
            CHECK(same(m.prior_variance, p.prior_variance));
            CHECK(same(m.map_nx, p.map_nx));
            CHECK(same(m.map_ny, p.map_ny));
            CHECK(same(m.ix0, p.ix0));
            CHECK(same(m.iy0, p.iy0));
            CHECK(same(m.nx, p.nx));
            CHECK(same(m.ny, p.ny));
            CHECK(same<std::uint8_t>(m.probability, p.probability, p.n_cells));
            CHECK(same<std::uint8_t>(m.variance_class, p.variance_class, p.n_cells));
        });
}

TEST_CASE("gpom.status_t is read and written as lcm-gen does")
{
    check<peer::gpom::status_t, peer_gpom_status_t>(
        gpom_wire_status_t{}, gpom_wire_status_decode, gpom_wire_status_encode,
        [](const auto &m, const auto &p) {
            CHECK(m.stamp_us == p.utime);
            CHECK(same(m.sequence, p.sequence));
            CHECK(same(m.state, p.state));
            CHECK(m.version == p.version);
            CHECK(m.map_format == p.map_format);
            CHECK(m.frame_epoch == p.frame_epoch);
            CHECK(m.uptime_us == p.uptime_us);
            CHECK(m.scan_stamp_us == p.scan_utime);
            CHECK(m.scan_lag_us == p.scan_lag_us);
            CHECK(m.scan_lag_us_max == p.scan_lag_us_max);
            CHECK(same(m.scan_rate_hz, p.scan_rate_hz));
            CHECK(same(m.pose_rate_hz, p.pose_rate_hz));
            CHECK(same(m.map_rate_hz, p.map_rate_hz));
            CHECK(same(m.query_rate_hz, p.query_rate_hz));
            CHECK(m.n_beams == p.n_beams);
            CHECK(m.beam_max == p.beam_max);
            CHECK(m.n_cells_dirty == p.n_cells_dirty);
            CHECK(m.map_bytes == p.map_bytes);
            CHECK(m.process_bytes == p.process_bytes);
            CHECK(same(m.counts, p.counts));
        });
}

// As lcm-gen's publish sends it; whatever else was there instead of 0 is a fault, and so is each
// end too early or too late.
TEST_CASE("gpom.query_t is read without CRC-32 if that is 0")
{
    gpom_point_t points[GPOM_WIRE_POINTS_MAX] = {{1.0, 2.0}, {3.0, 4.0}};
    const gpom_wire_query_t query = {5, 6, 7, GPOM_WIRE_QUERY_PATH, 0.5f, points, 2};
    std::vector<std::uint8_t> bytes(GPOM_WIRE_QUERY_BYTES(2));
    REQUIRE(gpom_wire_query_encode(&query, bytes.data(), bytes.size()) == bytes.size());
    gpom_point_t read_points[GPOM_WIRE_POINTS_MAX] = {};
    gpom_wire_query_t read = {};
    read.points = read_points;
    const auto fault = [&](std::size_t n_bytes) {
        return gpom_wire_query_decode_without_crc(&read, bytes.data(), n_bytes);
    };
    CHECK(fault(bytes.size()) == GPOM_WIRE_CRC);
    std::fill(bytes.end() - 4, bytes.end(), std::uint8_t{0});
    REQUIRE(fault(bytes.size()) == GPOM_WIRE_OK);
    CHECK(read.client == 6);
    CHECK(read.sequence == 7);
    CHECK(read.n_points == 2);
    CHECK(read_points[1].y_m == 4.0);
    CHECK(gpom_wire_query_decode(&read, bytes.data(), bytes.size()) == GPOM_WIRE_CRC);
    for (std::size_t n_bytes = 0; n_bytes < bytes.size(); ++n_bytes) {
        CHECK(fault(n_bytes) != GPOM_WIRE_OK);
    }
    bytes.push_back(0);
    CHECK(fault(bytes.size()) == GPOM_WIRE_LONG);
}

TEST_CASE("gpom.query_t is read and written as lcm-gen does")
{
    std::vector<gpom_point_t> points(GPOM_WIRE_POINTS_MAX);
    gpom_wire_query_t message = {};
    message.points = points.data();
    check<peer::gpom::query_t, peer_gpom_query_t>(
        message, gpom_wire_query_decode, gpom_wire_query_encode, [](const auto &m, const auto &p) {
            CHECK(m.stamp_us == p.utime);
            CHECK(m.client == p.client);
            CHECK(same(m.sequence, p.sequence));
            CHECK(same(m.kind, p.kind));
            CHECK(same(m.step_m, p.step_m));
            REQUIRE(same(m.n_points, p.n_points));
            for (std::int32_t i = 0; i < p.n_points; ++i) {
                CHECK(same(m.points[i].x_m, p.points[i].x));
                CHECK(same(m.points[i].y_m, p.points[i].y));
            }
        });
}

TEST_CASE("gpom.answer_t is read and written as lcm-gen does")
{
    std::vector<gpom_answer_t> answers(GPOM_WIRE_POINTS_MAX);
    gpom_wire_answer_t message = {};
    message.points = answers.data();
    check<peer::gpom::answer_t, peer_gpom_answer_t>(
        message, gpom_wire_answer_decode, gpom_wire_answer_encode,
        [](const auto &m, const auto &p) {
            CHECK(m.stamp_us == p.utime);
            CHECK(m.map_stamp_us == p.map_utime);
            CHECK(m.client == p.client);
            CHECK(same(m.sequence, p.sequence));
            CHECK(m.frame_epoch == p.frame_epoch);
            CHECK(same(m.status, p.status));
            REQUIRE(same(m.n_points, p.n_points));
            for (std::int32_t i = 0; i < p.n_points; ++i) {
                CHECK(same(m.points[i].mean, p.points[i].mean));
                CHECK(same(m.points[i].variance, p.points[i].variance));
                CHECK(same(m.points[i].probability, p.points[i].probability));
                CHECK(same(m.points[i].cls, p.points[i].cls));
            }
        });
}

TEST_CASE("bot_core.planar_lidar_t is read and written as lcm-gen does")
{
    std::vector<float> ranges(1100);
    std::vector<float> intensities(1100);
    gpom_wire_planar_lidar_t message = {};
    message.ranges_m = {ranges.data(), 1100, 0};
    message.intensities = {intensities.data(), 1100, 0};
    check<peer::bot_core::planar_lidar_t, peer_bot_core_planar_lidar_t>(
        message, gpom_wire_planar_lidar_decode, gpom_wire_planar_lidar_encode,
        [](const auto &m, const auto &p) {
            CHECK(m.stamp_us == p.utime);
            CHECK(same(m.ranges_m.n, p.nranges));
            CHECK(same(m.ranges_m.values, p.ranges, p.nranges));
            CHECK(same(m.intensities.n, p.nintensities));
            CHECK(same(m.intensities.values, p.intensities, p.nintensities));
            CHECK(same(m.angle_min_rad, p.rad0));
            CHECK(same(m.angle_step_rad, p.radstep));
        });
}

TEST_CASE("bot_core.pose_t is read and written as lcm-gen does")
{
    check<peer::bot_core::pose_t, peer_bot_core_pose_t>(
        gpom_wire_bot_pose_t{}, gpom_wire_bot_pose_decode, gpom_wire_bot_pose_encode,
        [](const auto &m, const auto &p) {
            CHECK(m.stamp_us == p.utime);
            CHECK(same(m.position_m, p.pos));
            CHECK(same(m.velocity_mps, p.vel));
            CHECK(same(m.orientation, p.orientation));
            CHECK(same(m.rotation_rate_rps, p.rotation_rate));
            CHECK(same(m.acceleration_mps2, p.accel));
        });
}

TEST_CASE("mbot_lcm_msgs.lidar_t is read and written as lcm-gen does")
{
    std::vector<float> values(900);
    std::vector<std::int64_t> times(300);
    gpom_wire_lidar_t message = {};
    message.ranges_m = {values.data(), 300, 0};
    message.bearings_rad = {values.data() + 300, 300, 0};
    message.intensities = {values.data() + 600, 300, 0};
    message.stamps_us = {times.data(), 300, 0};
    check<peer::mbot_lcm_msgs::lidar_t, peer_mbot_lcm_msgs_lidar_t>(
        message, gpom_wire_lidar_decode, gpom_wire_lidar_encode, [](const auto &m, const auto &p) {
            CHECK(m.stamp_us == p.utime);
            CHECK(same(m.ranges_m.n, p.num_ranges));
            CHECK(same(m.bearings_rad.n, p.num_ranges));
            CHECK(same(m.stamps_us.n, p.num_ranges));
            CHECK(same(m.intensities.n, p.num_ranges));
            CHECK(same(m.ranges_m.values, p.ranges, p.num_ranges));
            CHECK(same(m.bearings_rad.values, p.thetas, p.num_ranges));
            CHECK(same(m.stamps_us.values, p.times, p.num_ranges));
            CHECK(same(m.intensities.values, p.intensities, p.num_ranges));
        });
}

TEST_CASE("mbot_lcm_msgs.pose2D_t is read and written as lcm-gen does")
{
    check<peer::mbot_lcm_msgs::pose2D_t, peer_mbot_lcm_msgs_pose2D_t>(
        gpom_wire_pose2d_t{}, gpom_wire_pose2d_decode, gpom_wire_pose2d_encode,
        [](const auto &m, const auto &p) {
            CHECK(m.stamp_us == p.utime);
            CHECK(same(m.x_m, p.x));
            CHECK(same(m.y_m, p.y));
            CHECK(same(m.yaw_rad, p.theta));
        });
}

TEST_CASE("mbot_lcm_msgs.occupancy_grid_t is read and written as lcm-gen does")
{
    check<peer::mbot_lcm_msgs::occupancy_grid_t, peer_mbot_lcm_msgs_occupancy_grid_t>(
        gpom_wire_occupancy_grid_t{}, gpom_wire_occupancy_grid_decode,
        gpom_wire_occupancy_grid_encode, [](const auto &m, const auto &p) {
            CHECK(m.stamp_us == p.utime);
            CHECK(same(m.corner_x_m, p.origin_x));
            CHECK(same(m.corner_y_m, p.origin_y));
            CHECK(same(m.cell_m, p.meters_per_cell));
            CHECK(same(m.nx, p.width));
            CHECK(same(m.ny, p.height));
            CHECK(same(reinterpret_cast<const std::int8_t *>(m.cells),
                       static_cast<const std::int8_t *>(p.cells), p.num_cells));
        });
}

TEST_CASE("occ_map.pixel_map_t is read and written as lcm-gen does")
{
    check<peer::occ_map::pixel_map_t, peer_occ_map_pixel_map_t>(
        gpom_wire_pixel_map_t{}, gpom_wire_pixel_map_decode, gpom_wire_pixel_map_encode,
        [](const auto &m, const auto &p) {
            CHECK(m.stamp_us == p.utime);
            CHECK(same(m.nx, p.dimensions[0]));
            CHECK(same(m.ny, p.dimensions[1]));
            CHECK(same(m.centre0_m, p.xy0));
            CHECK(same(m.end_m, p.xy1));
            CHECK(same(m.cell_m, p.mpp));
            CHECK(m.is_compressed == p.compressed);
            CHECK(same(m.pixel, p.data_type));
            CHECK(same(m.n_bytes, p.datasize));
            CHECK(same<std::uint8_t>(m.pixels, p.mapData, p.datasize));
        });
}
