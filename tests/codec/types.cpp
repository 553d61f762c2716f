#include "tests/codec/types.hpp"

#include <zlib.h>

namespace
{

constexpr std::uint32_t kArrayMax = 70000;

/// Arrays that decoders fill; made once, as a fuzzer calls often.
struct Arrays {
    std::array<std::vector<float>, 3> floats;
    std::vector<std::int64_t> times;
    std::vector<gpom_point_t> points;
    std::vector<gpom_answer_t> answers;

    Arrays() : times(kArrayMax), points(GPOM_WIRE_POINTS_MAX), answers(GPOM_WIRE_POINTS_MAX)
    {
        floats.fill(std::vector<float>(kArrayMax));
    }
    gpom_wire_floats_t lend(std::size_t i) { return {floats[i].data(), kArrayMax, 0}; }
};

template <class M> void lend(M &, Arrays &)
{ // no arrays
}
void lend(gpom_wire_scan_t &m, Arrays &arrays) { m.ranges_m = arrays.lend(0); }
void lend(gpom_wire_query_t &m, Arrays &arrays) { m.points = arrays.points.data(); }
void lend(gpom_wire_answer_t &m, Arrays &arrays) { m.points = arrays.answers.data(); }
void lend(gpom_wire_planar_lidar_t &m, Arrays &arrays)
{
    m.ranges_m = arrays.lend(0);
    m.intensities = arrays.lend(1);
}
void lend(gpom_wire_lidar_t &m, Arrays &arrays)
{
    m.ranges_m = arrays.lend(0);
    m.bearings_rad = arrays.lend(1);
    m.intensities = arrays.lend(2);
    m.stamps_us = {arrays.times.data(), kArrayMax, 0};
}

/// One for all types, because a microcontroller has no room for one of each.
Arrays &shared_arrays()
{
    static Arrays arrays;
    return arrays;
}

template <class M, auto decode, auto encode>
Reencoded reencode(const std::uint8_t *bytes, std::size_t n_bytes)
{
    Arrays &arrays = shared_arrays();
    M message = {};
    const gpom_wire_fault_t fault_of_skipping = decode(&message, bytes, n_bytes);
    lend(message, arrays);
    const gpom_wire_fault_t fault = decode(&message, bytes, n_bytes);
    if (fault_of_skipping == GPOM_WIRE_OK && fault != GPOM_WIRE_OK && fault != GPOM_WIRE_CAPACITY) {
        return {GPOM_WIRE_FAULTS, {}}; // taken without its arrays though not a message
    }
    if (fault != GPOM_WIRE_OK) {
        return {fault, {}};
    }
    Bytes again(n_bytes + 64);
    again.resize(encode(&message, again.data(), again.size()));
    return {GPOM_WIRE_OK, again};
}

} // namespace

#define TYPE(name, FINGERPRINT, has_crc)                                                           \
    {                                                                                              \
#name, FINGERPRINT, has_crc, &reencode < gpom_wire_##name##_t, gpom_wire_##name##_decode,  \
            gpom_wire_##name##_encode>                                                             \
    }

const std::array<Type, 12> kTypes = {{
    TYPE(scan, GPOM_WIRE_SCAN_FINGERPRINT, true),
    TYPE(map, GPOM_WIRE_MAP_FINGERPRINT, true),
    TYPE(status, GPOM_WIRE_STATUS_FINGERPRINT, true),
    TYPE(query, GPOM_WIRE_QUERY_FINGERPRINT, true),
    TYPE(answer, GPOM_WIRE_ANSWER_FINGERPRINT, true),
    TYPE(planar_lidar, GPOM_WIRE_PLANAR_LIDAR_FINGERPRINT, false),
    TYPE(bot_pose, GPOM_WIRE_BOT_POSE_FINGERPRINT, false),
    TYPE(lidar, GPOM_WIRE_LIDAR_FINGERPRINT, false),
    TYPE(pose2d, GPOM_WIRE_POSE2D_FINGERPRINT, false),
    TYPE(occupancy_grid, GPOM_WIRE_OCCUPANCY_GRID_FINGERPRINT, false),
    TYPE(pixel_map, GPOM_WIRE_PIXEL_MAP_FINGERPRINT, false),
    TYPE(distances, GPOM_WIRE_DISTANCES_FINGERPRINT, true),
}};

const Type *type_of(const Bytes &message)
{
    for (const Type &type : kTypes) {
        if (type.fingerprint == gpom_wire_fingerprint(message.data(), message.size())) {
            return &type;
        }
    }
    return nullptr;
}

void append(Bytes &bytes, std::uint64_t value, std::size_t n_bytes)
{
    for (std::size_t i = n_bytes; i-- > 0;) {
        bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    }
}

void mend_crc(Bytes &message)
{
    message.resize(message.size() - 4);
    append(message, crc32(0, message.data(), static_cast<uInt>(message.size())), 4);
}
