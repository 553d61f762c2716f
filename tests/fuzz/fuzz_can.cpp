// Any bytes as CAN frames: read or refused; what is read is written and read again as the same.
// The stop example: "go" only after frames that are right.
#include "ports/can/examples/stop.h"

#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace
{

void require(bool holds)
{
    if (!holds) {
        std::abort();
    }
}

/// Give a frame the CRC that it must have, or leave its own.
void seal(std::uint8_t *bytes, std::size_t n_bytes, std::uint16_t data_id)
{
    if (n_bytes == GPOM_CAN_CLASSIC_BYTES) {
        bytes[0] = gpom_can_crc8({0xFF, 0xFF}, data_id, bytes, n_bytes, 0);
    } else if (n_bytes == GPOM_CAN_FD_BYTES) {
        const unsigned crc = gpom_can_crc16(data_id, bytes + 2, n_bytes - 2);
        bytes[0] = static_cast<std::uint8_t>(crc & 0xFF);
        bytes[1] = static_cast<std::uint8_t>(crc >> 8);
    }
}

template <class Message, class Unpack, class Pack>
void read_and_write(const std::uint8_t *bytes, std::size_t n_bytes, Unpack unpack, Pack pack)
{
    Message message = {}, again = {};
    if (unpack(&message, bytes, n_bytes) != GPOM_CAN_OK) {
        return;
    }
    std::uint8_t written[GPOM_CAN_FD_BYTES];
    pack(&message, written);
    require(unpack(&again, written, n_bytes) == GPOM_CAN_OK);
    require(std::memcmp(&message, &again, sizeof message) == 0);
}

void read_all(const std::uint8_t *bytes, std::size_t n_bytes)
{
    read_and_write<gpom_can_status_t>(bytes, n_bytes, gpom_can_status_unpack, gpom_can_status_pack);
    read_and_write<gpom_can_clearance_t>(bytes, n_bytes, gpom_can_clearance_unpack,
                                         gpom_can_clearance_pack);
    read_and_write<gpom_can_clearance_fd_t>(bytes, n_bytes, gpom_can_clearance_fd_unpack,
                                            gpom_can_clearance_fd_pack);
    read_and_write<gpom_can_tile_t>(bytes, n_bytes, gpom_can_tile_unpack, gpom_can_tile_pack);
}

/// Frames of 8 bytes, each at a time of its own.
void drive_stop(const std::uint8_t *data, std::size_t n)
{
    const gpom_stop_config_t config = {100, 0x7FFF, 20, 2, 1};
    gpom_stop_t stop;
    gpom_stop_init(&stop, &config);
    std::uint32_t now_ms = 0;
    std::size_t n_right = 0;
    for (; n > GPOM_CAN_CLASSIC_BYTES; n -= GPOM_CAN_CLASSIC_BYTES + 1) {
        std::uint8_t frame[GPOM_CAN_CLASSIC_BYTES];
        std::memcpy(frame, data + 1, sizeof frame);
        if (data[0] % 8 != 0) {
            seal(frame, sizeof frame, GPOM_CAN_CLEARANCE_DATA_ID);
        }
        now_ms += data[0] / 8;
        gpom_can_clearance_t message = {};
        const bool is_right =
            gpom_can_clearance_unpack(&message, frame, sizeof frame) == GPOM_CAN_OK;
        n_right = is_right ? n_right + 1 : 0;
        gpom_stop_on_frame(&stop, frame, sizeof frame, now_ms);
        const bool goes = gpom_stop_may_go(&stop, now_ms);
        require(!goes || (n_right >= 3 && message.state == GPOM_CAN_MAPPING));
        data += GPOM_CAN_CLASSIC_BYTES + 1;
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t n)
{
    constexpr std::uint16_t kDataIds[] = {GPOM_CAN_STATUS_DATA_ID, GPOM_CAN_CLEARANCE_DATA_ID,
                                          GPOM_CAN_CLEARANCE_FD_DATA_ID, GPOM_CAN_TILE_DATA_ID};
    read_all(data, n);
    for (const std::uint16_t data_id : kDataIds) {
        std::uint8_t frame[GPOM_CAN_FD_BYTES] = {};
        const std::size_t n_bytes = n < sizeof frame ? n : sizeof frame;
        std::memcpy(frame, data, n_bytes);
        seal(frame, n_bytes, data_id);
        read_all(frame, n_bytes);
    }
    drive_stop(data, n);
    return 0;
}
