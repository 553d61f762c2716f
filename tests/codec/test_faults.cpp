// The wire is hostile: every truncation, every wrong count, every damaged byte is refused by cause.
#include "tests/codec/samples.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>

namespace
{

/// Decoded from a heap block of exactly its size, so that a sanitizer sees any byte too many.
gpom_wire_fault_t fault_of(const Type &type, const Bytes &message)
{
    const std::vector<std::uint8_t> exact(message.begin(), message.end());
    const std::uint8_t nothing = 0;
    return type.reencode(exact.empty() ? &nothing : exact.data(), exact.size()).fault;
}

/// Message with the int32 at offset `at` replaced; a CRC-32 that fits, so that the count is seen.
Bytes with_int32(const Type &type, Bytes message, std::size_t at, std::uint32_t value)
{
    for (std::size_t i = 0; i < 4; ++i) {
        message[at + i] = static_cast<std::uint8_t>(value >> (8 * (3 - i)));
    }
    if (type.has_crc) {
        mend_crc(message);
    }
    return message;
}

/// Message with one byte replaced; likewise.
Bytes with_byte(const Type &type, Bytes message, std::size_t at, std::uint8_t value)
{
    message[at] = value;
    if (type.has_crc) {
        mend_crc(message);
    }
    return message;
}

/// Where each type's counts stand: offset of the int32 in an encoded message.
std::vector<std::size_t> count_offsets(std::size_t i_type, const Bytes &message)
{
    switch (i_type) {
    case 0:
        return {98}; // scan: before the ranges
    case 1:
        return {89}; // map: before the codes
    case 3:
        return {33}; // query
    case 4:
        return {41}; // answer
    case 5: {        // planar_lidar: nranges, then nintensities behind the ranges
        std::uint32_t n = 0;
        for (std::size_t i = 16; i < 20; ++i) {
            n = n << 8 | message[i];
        }
        return {16, 20 + 4 * static_cast<std::size_t>(n)};
    }
    case 7:
        return {16}; // lidar
    case 9:
        return {28, 32, 36}; // occupancy_grid: width, height, num_cells
    case 10:
        return {16, 20, 66}; // pixel_map: dimensions, datasize
    default:
        return {};
    }
}

} // namespace

// Cut anywhere, with the checksum made to fit where there is one: it ends before its fields do, or
// its counts contradict what is left.
TEST_CASE("no truncated message is taken")
{
    Random random = make_random();
    const std::vector<Bytes> messages = one_of_each(random);
    for (std::size_t i_type = 0; i_type < kTypes.size(); ++i_type) {
        const Type &type = kTypes[i_type];
        REQUIRE(fault_of(type, messages[i_type]) == GPOM_WIRE_OK);
        for (std::size_t n = 0; n < messages[i_type].size(); ++n) {
            CAPTURE(type.name);
            CAPTURE(n);
            Bytes cut(messages[i_type].begin(), messages[i_type].begin() + static_cast<long>(n));
            CHECK(fault_of(type, cut) ==
                  (type.has_crc && n >= 12 ? GPOM_WIRE_CRC : GPOM_WIRE_SHORT));
            if (type.has_crc && n >= 12) {
                mend_crc(cut);
                CHECK(fault_of(type, cut) == GPOM_WIRE_SHORT);
            }
        }
    }
}

// lcm-gen's decoders ignore what follows; here it is a fault, as it means another definition.
TEST_CASE("no message with bytes after its end is taken")
{
    Random random = make_random();
    const std::vector<Bytes> messages = one_of_each(random);
    for (std::size_t i_type = 0; i_type < kTypes.size(); ++i_type) {
        const Type &type = kTypes[i_type];
        CAPTURE(type.name);
        Bytes longer = messages[i_type];
        longer.push_back(0);
        CHECK(fault_of(type, longer) == (type.has_crc ? GPOM_WIRE_CRC : GPOM_WIRE_LONG));
        if (type.has_crc) {
            mend_crc(longer);
            CHECK(fault_of(type, longer) == GPOM_WIRE_LONG);
        }
    }
}

// Among them those that make 4 n overflow 32 bits, which crashes lcm-gen's C decoder.
TEST_CASE("no wrong count is believed")
{
    const std::uint32_t wrong[] = {0x80000000, 0xffffffff, 0x7fffffff, 0x40000000, 0x20000000,
                                   0x10000001, 0x00ffffff, 100000,     70001};
    Random random = make_random();
    const std::vector<Bytes> messages = one_of_each(random);
    for (std::size_t i_type = 0; i_type < kTypes.size(); ++i_type) {
        const Type &type = kTypes[i_type];
        for (const std::size_t at : count_offsets(i_type, messages[i_type])) {
            for (const std::uint32_t value : wrong) {
                CAPTURE(type.name);
                CAPTURE(at);
                CAPTURE(value);
                const Bytes bad = with_int32(type, messages[i_type], at, value);
                const gpom_wire_fault_t fault = fault_of(type, bad);
                if (value > INT32_MAX) {
                    CHECK(fault == GPOM_WIRE_COUNT);
                } else {
                    const bool is_pixel_dimension = i_type == 10 && at < 66;
                    CHECK((fault != GPOM_WIRE_OK || is_pixel_dimension)); // free if compressed
                }
            }
        }
    }
}

// Where no array is given the elements are skipped: 4 n must not wrap there either.
TEST_CASE("no wrong count is believed where elements are skipped")
{
    Random random = make_random();
    const std::vector<Bytes> messages = one_of_each(random);
    for (const std::uint32_t n : {0x40000000u, 0x20000000u, 0x7fffffffu, 70001u}) {
        gpom_wire_scan_t scan = {};
        Bytes bad = with_int32(kTypes[0], messages[0], 98, n);
        CHECK(gpom_wire_scan_decode(&scan, bad.data(), bad.size()) == GPOM_WIRE_SHORT);
        gpom_wire_planar_lidar_t planar = {};
        bad = with_int32(kTypes[5], messages[5], 16, n);
        CHECK(gpom_wire_planar_lidar_decode(&planar, bad.data(), bad.size()) == GPOM_WIRE_SHORT);
        gpom_wire_lidar_t lidar = {};
        bad = with_int32(kTypes[7], messages[7], 16, n);
        CHECK(gpom_wire_lidar_decode(&lidar, bad.data(), bad.size()) == GPOM_WIRE_SHORT);
    }
}

// All cells are there, but the sides say another number of them.
TEST_CASE("sides that contradict the number of cells are refused")
{
    Random random = make_random();
    Sample<peer_gpom_map_t> tile;
    Sample<peer_mbot_lcm_msgs_occupancy_grid_t> grid;
    Sample<peer_occ_map_pixel_map_t> pixels;
    do {
        make(tile, random);
    } while (tile.peer.n_cells == 0);
    make(grid, random);
    do {
        make(pixels, random);
    } while (pixels.peer.compressed == 1 || pixels.peer.datasize == 0);
    const Bytes bad_tile =
        with_byte(kTypes[1], tile.bytes, 86, static_cast<std::uint8_t>(tile.peer.nx - 1));
    CHECK(fault_of(kTypes[1], bad_tile) == GPOM_WIRE_COUNT);
    for (const int change : {-1, 1}) {
        const auto width = static_cast<std::uint32_t>(grid.peer.width + change);
        CHECK(fault_of(kTypes[9], with_int32(kTypes[9], grid.bytes, 28, width)) == GPOM_WIRE_COUNT);
        const auto nx = static_cast<std::uint32_t>(pixels.peer.dimensions[0] + change);
        CHECK(fault_of(kTypes[10], with_int32(kTypes[10], pixels.bytes, 16, nx)) ==
              GPOM_WIRE_COUNT);
    }
}

// One more or one less than the truth, which is the hardest to notice.
TEST_CASE("no count that is off by one is believed")
{
    Random random = make_random();
    for (int round = 0; round < 20; ++round) {
        const std::vector<Bytes> messages = one_of_each(random);
        for (std::size_t i_type = 0; i_type < kTypes.size(); ++i_type) {
            const Type &type = kTypes[i_type];
            const std::vector<std::size_t> offsets = count_offsets(i_type, messages[i_type]);
            if (offsets.empty()) {
                continue;
            }
            const std::size_t at = offsets.back(); // the count that stands before elements
            std::uint32_t n = 0;
            for (std::size_t i = at; i < at + 4; ++i) {
                n = n << 8 | messages[i_type][i];
            }
            CAPTURE(type.name);
            CHECK(fault_of(type, with_int32(type, messages[i_type], at, n + 1)) != GPOM_WIRE_OK);
            CHECK(fault_of(type, with_int32(type, messages[i_type], at, n - 1)) != GPOM_WIRE_OK);
        }
    }
}

// CRC-32 finds every error of up to 32 bits in a row.
TEST_CASE("gpom's own messages are refused with any one bit or byte changed")
{
    Random random = make_random();
    const std::vector<Bytes> messages = one_of_each(random);
    for (std::size_t i_type = 0; i_type < kTypes.size(); ++i_type) {
        const Type &type = kTypes[i_type];
        for (std::size_t at = 0; type.has_crc && at < messages[i_type].size(); ++at) {
            CAPTURE(type.name);
            CAPTURE(at);
            const gpom_wire_fault_t expected = at < 8 ? GPOM_WIRE_TYPE : GPOM_WIRE_CRC;
            Bytes bad = messages[i_type];
            bad[at] = static_cast<std::uint8_t>(bad[at] ^ (1u << random() % 8));
            CHECK(fault_of(type, bad) == expected);
            bad[at] = static_cast<std::uint8_t>(messages[i_type][at] + 1 + random() % 255);
            CHECK(fault_of(type, bad) == expected);
        }
    }
}

TEST_CASE("a message of another type is told by its fingerprint")
{
    Random random = make_random();
    const std::vector<Bytes> messages = one_of_each(random);
    for (std::size_t i_type = 0; i_type < kTypes.size(); ++i_type) {
        for (std::size_t i_other = 0; i_other < kTypes.size(); ++i_other) {
            CHECK((fault_of(kTypes[i_type], messages[i_other]) == GPOM_WIRE_TYPE) ==
                  (i_type != i_other));
        }
        CHECK(type_of(messages[i_type]) == &kTypes[i_type]);
    }
    CHECK(gpom_wire_fingerprint(messages[0].data(), 7) == 0);
    CHECK(gpom_wire_fingerprint(nullptr, 8) == 0);
}

// An enumerator of a later version is a fault, not a number to guess about.
TEST_CASE("values that a definition does not know are refused")
{
    Random random = make_random();
    const std::vector<Bytes> messages = one_of_each(random);
    const auto check = [&](std::size_t i_type, std::size_t at, std::uint8_t value) {
        CAPTURE(kTypes[i_type].name);
        CAPTURE(at);
        CHECK(fault_of(kTypes[i_type], with_byte(kTypes[i_type], messages[i_type], at, value)) ==
              GPOM_WIRE_VALUE);
    };
    check(1, 20, 0x7f); // map: tile number beyond their count
    check(1, 24, 2);    // map: keyframe neither 0 nor 1
    check(1, 77, 0x80); // map: negative width of the whole map
    check(1, 81, 0x7f); // map: tile outside the whole map
    check(2, 20, 4);    // status: state
    check(3, 28, 2);    // query: kind
    check(4, 40, 5);    // answer: status
    check(10, 64, 2);   // pixel_map: compressed
    check(10, 65, 0);   // pixel_map: data type
    check(10, 65, 9);
}

// Unknown has a code of its own in both bytes; a cell that claims it in one only is a sender's bug.
TEST_CASE("a cell unknown in one of its codes only is refused")
{
    const Type &type = kTypes[1];
    Random random = make_random();
    Sample<peer_gpom_map_t> sample;
    do {
        make(sample, random);
    } while (sample.peer.n_cells == 0);
    const auto n_cells = static_cast<std::size_t>(sample.peer.n_cells);
    const std::size_t probability = 93;
    for (std::size_t i = 0; i < n_cells; ++i) {
        Bytes bad = sample.bytes;
        const bool is_unknown = bad[probability + i] == GPOM_WIRE_PROBABILITY_UNKNOWN;
        bad[probability + i] = is_unknown ? 254 : GPOM_WIRE_PROBABILITY_UNKNOWN;
        mend_crc(bad);
        CHECK(fault_of(type, bad) == GPOM_WIRE_VALUE);
    }
}

// The array's capacity is the caller's word; one element too many is refused, one fewer is not.
TEST_CASE("arrays are never filled beyond their capacity, and skipped where there is none")
{
    Random random = make_random();
    Sample<peer_mbot_lcm_msgs_lidar_t> sample;
    do {
        make(sample, random);
    } while (sample.peer.num_ranges < 2);
    const auto n = static_cast<std::uint32_t>(sample.peer.num_ranges);
    std::vector<float> ranges(n);
    std::vector<std::int64_t> times(n);
    gpom_wire_lidar_t m = {};
    m.ranges_m = {ranges.data(), n, 0};
    CHECK(gpom_wire_lidar_decode(&m, sample.bytes.data(), sample.bytes.size()) == GPOM_WIRE_OK);
    CHECK(m.stamps_us.n == n);
    CHECK(std::memcmp(ranges.data(), sample.peer.ranges, n * sizeof(float)) == 0);
    m.stamps_us = {times.data(), n, 0};
    CHECK(gpom_wire_lidar_decode(&m, sample.bytes.data(), sample.bytes.size()) == GPOM_WIRE_OK);
    CHECK(times == sample.times);
    std::vector<float> fewer(n - 1);
    m.ranges_m = {fewer.data(), n - 1, 0};
    CHECK(gpom_wire_lidar_decode(&m, sample.bytes.data(), sample.bytes.size()) ==
          GPOM_WIRE_CAPACITY);
    std::vector<std::int64_t> fewer_times(n - 1);
    m.ranges_m = {ranges.data(), n, 0};
    m.stamps_us = {fewer_times.data(), n - 1, 0};
    CHECK(gpom_wire_lidar_decode(&m, sample.bytes.data(), sample.bytes.size()) ==
          GPOM_WIRE_CAPACITY);
}

// One query must not cost more than the cap, whoever sends it.
TEST_CASE("more points than the cap are refused in query and answer")
{
    const std::uint32_t n = GPOM_WIRE_POINTS_MAX + 1;
    std::vector<gpom_point_t> points(n);
    std::vector<gpom_answer_t> answers(n);
    Bytes bytes(4096);
    gpom_wire_query_t query = {};
    query.points = points.data();
    query.n_points = n;
    CHECK(gpom_wire_query_encode(&query, bytes.data(), bytes.size()) == 0);
    gpom_wire_answer_t answer = {};
    answer.points = answers.data();
    answer.n_points = n;
    CHECK(gpom_wire_answer_encode(&answer, bytes.data(), bytes.size()) == 0);

    std::vector<peer_gpom_point_t> peer_points(n);
    peer_gpom_query_t peer = {};
    peer.n_points = static_cast<std::int32_t>(n);
    peer.points = peer_points.data();
    const int n_bytes = peer_gpom_query_t_encoded_size(&peer);
    bytes.resize(static_cast<std::size_t>(n_bytes));
    REQUIRE(peer_gpom_query_t_encode(bytes.data(), 0, n_bytes, &peer) == n_bytes);
    mend_crc(bytes);
    CHECK(gpom_wire_query_decode(&query, bytes.data(), bytes.size()) == GPOM_WIRE_CAPACITY);
}

// A writer stops at the end of its memory, at any size below the need.
TEST_CASE("encoding into too little memory writes nothing beyond it and says 0")
{
    Random random = make_random();
    Sample<peer_gpom_map_t> sample;
    make(sample, random);
    gpom_wire_map_t m;
    REQUIRE(gpom_wire_map_decode(&m, sample.bytes.data(), sample.bytes.size()) == GPOM_WIRE_OK);
    for (std::size_t n = 0; n < sample.bytes.size(); ++n) {
        const std::unique_ptr<std::uint8_t[]> exact(new std::uint8_t[n == 0 ? 1 : n]);
        CHECK(gpom_wire_map_encode(&m, exact.get(), n) == 0);
    }
}

TEST_CASE("what cannot be decoded is not encoded either")
{
    Bytes bytes(8192);
    std::uint8_t cell = 0;
    gpom_wire_map_t map = {};
    CHECK(gpom_wire_map_encode(&map, bytes.data(), bytes.size()) == 0); // no tile of no tiles
    map.n_tiles = map.nx = map.ny = map.map_nx = map.map_ny = 1;
    CHECK(gpom_wire_map_encode(&map, bytes.data(), bytes.size()) == 0); // no codes
    map.probability = map.variance_class = &cell;
    CHECK(gpom_wire_map_encode(&map, bytes.data(), bytes.size()) == GPOM_WIRE_MAP_BYTES(1));
    map.nx = map.map_nx = GPOM_WIRE_MAP_CELLS_MAX + 1;
    CHECK(gpom_wire_map_encode(&map, bytes.data(), bytes.size()) == 0); // more than a datagram
    gpom_wire_status_t status = {};
    status.state = 4;
    CHECK(gpom_wire_status_encode(&status, bytes.data(), bytes.size()) == 0);
    gpom_wire_scan_t scan = {};
    scan.ranges_m.n = 1;
    CHECK(gpom_wire_scan_encode(&scan, bytes.data(), bytes.size()) == 0); // no ranges
    gpom_wire_lidar_t lidar = {};
    lidar.stamps_us.n = 1;
    CHECK(gpom_wire_lidar_encode(&lidar, bytes.data(), bytes.size()) == 0); // counts disagree
    gpom_wire_occupancy_grid_t grid = {};
    grid.cells = &cell;
    grid.nx = grid.ny = 0x10000; // their product is 0 in 32 bits
    CHECK(gpom_wire_occupancy_grid_encode(&grid, bytes.data(), bytes.size()) == 0);
    gpom_wire_pixel_map_t pixels = {};
    pixels.pixel = GPOM_WIRE_PIXEL_UINT8;
    pixels.nx = 2;
    CHECK(gpom_wire_pixel_map_encode(&pixels, bytes.data(), bytes.size()) != 0);
    pixels.ny = 1;
    CHECK(gpom_wire_pixel_map_encode(&pixels, bytes.data(), bytes.size()) == 0); // 2 pixels missing
}

TEST_CASE("null pointers are refused")
{
    std::uint8_t byte = 0;
    gpom_wire_pose2d_t pose = {};
    CHECK(gpom_wire_pose2d_decode(nullptr, &byte, 1) == GPOM_WIRE_ARG);
    CHECK(gpom_wire_pose2d_decode(&pose, nullptr, 1) == GPOM_WIRE_ARG);
    CHECK(gpom_wire_pose2d_encode(nullptr, &byte, 1) == 0);
    CHECK(gpom_wire_pose2d_encode(&pose, nullptr, 1) == 0);
}

TEST_CASE("every fault has its own line of text")
{
    std::vector<std::string> texts;
    for (int fault = GPOM_WIRE_OK; fault <= GPOM_WIRE_FAULTS; ++fault) {
        const std::string text = gpom_wire_fault_str(static_cast<gpom_wire_fault_t>(fault));
        CHECK(!text.empty());
        CHECK(std::find(texts.begin(), texts.end(), text) == texts.end());
        texts.push_back(text);
    }
}
