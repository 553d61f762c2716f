#include "ports/linux/out/can_picture.hpp"

#include <doctest/doctest.h>

#include <memory>

namespace
{

constexpr std::int64_t kStart_us = 1000000000;

struct Cause {
    std::size_t place;
    unsigned bit;
};

/// What drops data, or shows that some was lost, and the fault that stands for it.
constexpr Cause kCauses[] = {
    {GPOM_WIRE_SCANS_NO_POSE, GPOM_CAN_FAULT_POSE},
    {GPOM_WIRE_SCANS_BAD_POSE, GPOM_CAN_FAULT_POSE},
    {GPOM_WIRE_POSES_REFUSED, GPOM_CAN_FAULT_POSE},
    {GPOM_WIRE_ODOMETRY_GAPS, GPOM_CAN_FAULT_POSE},
    {GPOM_WIRE_SCANS_LOST, GPOM_CAN_FAULT_LCM},
    {GPOM_WIRE_SCANS_CORRUPT, GPOM_CAN_FAULT_LCM},
    {GPOM_WIRE_SCANS_MALFORMED, GPOM_CAN_FAULT_LCM},
    {GPOM_WIRE_TIME_GAPS, GPOM_CAN_FAULT_LCM},
    {GPOM_WIRE_DATAGRAMS_LOST, GPOM_CAN_FAULT_LCM},
    {GPOM_WIRE_MESSAGES_TIMED_OUT, GPOM_CAN_FAULT_LCM},
    {GPOM_WIRE_CAN_BAD_LENGTH, GPOM_CAN_FAULT_CAN},
    {GPOM_WIRE_CAN_BAD_CRC, GPOM_CAN_FAULT_CAN},
    {GPOM_WIRE_CAN_BAD_COUNTER, GPOM_CAN_FAULT_CAN},
    {GPOM_WIRE_CAN_BAD_VALUE, GPOM_CAN_FAULT_CAN},
    {GPOM_WIRE_CAN_LOST, GPOM_CAN_FAULT_CAN},
    {GPOM_WIRE_CAN_REORDERED, GPOM_CAN_FAULT_CAN},
    {GPOM_WIRE_CAN_ERRORS, GPOM_CAN_FAULT_CAN},
    {GPOM_WIRE_CAN_OVERFLOWS, GPOM_CAN_FAULT_CAN},
    {GPOM_WIRE_CAN_NOT_SENT, GPOM_CAN_FAULT_CAN},
    {GPOM_WIRE_SCANS_OVERRUN, GPOM_CAN_FAULT_OVERRUN},
    {GPOM_WIRE_QUERIES_REFUSED, GPOM_CAN_FAULT_OVERRUN},
};

} // namespace

// A counter of a fault that rises shows its bit of GPOM_Status alone, for a second.
TEST_CASE("the faults of GPOM_Status follow their counters")
{
    const auto config = std::make_unique<gpomd::Config>();
    config->map.beam_max = 1000;
    gpomd::MapThread mapping;
    gpomd::Odometry odometry;
    gpomd::Memory memory;
    for (const Cause &cause : kCauses) {
        CAPTURE(cause.place);
        gpomd::Counts counts;
        gpomd::CanPicture picture;
        picture.init(*config, memory, {&mapping, &odometry, &counts});
        const auto faults_at = [&](std::int64_t now_us) {
            picture.look(now_us);
            picture.take({});
            return unsigned{picture.status().faults};
        };
        CHECK(faults_at(kStart_us) == 0);
        counts.add(cause.place);
        CHECK(faults_at(kStart_us + 1000) == cause.bit);
        CHECK(faults_at(kStart_us + 900000) == cause.bit);
        CHECK(faults_at(kStart_us + 1100000) == 0);
    }
}
