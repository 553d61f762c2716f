#include "ports/can/protect.h"

enum { POLYNOMIAL_8 = 0x1D, POLYNOMIAL_16 = 0x1021 };

static uint8_t crc8_byte(uint8_t crc, uint8_t byte)
{
    unsigned rest = (unsigned)crc ^ byte;
    for (int i = 0; i < 8; ++i) {
        rest = (rest & 0x80u) != 0 ? (rest << 1) ^ POLYNOMIAL_8 : rest << 1;
    }
    return (uint8_t)(rest & 0xFFu);
}

static uint16_t crc16_byte(uint16_t crc, uint8_t byte)
{
    unsigned rest = (unsigned)crc ^ ((unsigned)byte << 8);
    for (int i = 0; i < 8; ++i) {
        rest = (rest & 0x8000u) != 0 ? (rest << 1) ^ POLYNOMIAL_16 : rest << 1;
    }
    return (uint16_t)(rest & 0xFFFFu);
}

uint8_t gpom_can_crc8(gpom_can_crc8_t crc, uint16_t data_id, const uint8_t *bytes, size_t n_bytes,
                      size_t i_skipped)
{
    uint8_t rest = crc8_byte(crc.start, (uint8_t)(data_id & 0xFFu));
    rest = crc8_byte(rest, (uint8_t)(data_id >> 8));
    for (size_t i = 0; i < n_bytes; ++i) {
        rest = i == i_skipped ? rest : crc8_byte(rest, bytes[i]);
    }
    return (uint8_t)(rest ^ crc.final_xor);
}

uint16_t gpom_can_crc16(uint16_t data_id, const uint8_t *bytes, size_t n_bytes)
{
    uint16_t rest = 0xFFFF;
    for (size_t i = 0; i < n_bytes; ++i) {
        rest = crc16_byte(rest, bytes[i]);
    }
    rest = crc16_byte(rest, (uint8_t)(data_id & 0xFFu));
    return crc16_byte(rest, (uint8_t)(data_id >> 8));
}

static gpom_can_fault_t check_counter(const gpom_can_protection_t *protection,
                                      gpom_can_stream_t *stream, const uint8_t *bytes,
                                      size_t n_bytes)
{
    uint64_t bits = 0;
    if (!gpom_can_signal_bits(&protection->counter, bytes, n_bytes, &bits)) {
        return GPOM_CAN_LENGTH;
    }
    if (bits > protection->counter_max) {
        return GPOM_CAN_COUNTER;
    }
    const uint64_t n_values = (uint64_t)protection->counter_max + 1u;
    const uint64_t ahead = (bits + n_values - stream->counter) % n_values;
    if (stream->has_counter && ahead == 0) {
        return GPOM_CAN_COUNTER;
    }
    stream->n_lost = stream->has_counter ? (uint32_t)(ahead - 1u) : 0;
    stream->has_counter = true;
    stream->counter = (uint32_t)bits;
    return GPOM_CAN_OK;
}

gpom_can_fault_t gpom_can_check(const gpom_can_protection_t *protection, gpom_can_stream_t *stream,
                                const uint8_t *bytes, size_t n_bytes)
{
    stream->n_lost = 0;
    if (protection->has_crc) {
        const size_t i_crc = protection->i_crc_byte;
        if (n_bytes <= i_crc) {
            return GPOM_CAN_LENGTH;
        }
        if (gpom_can_crc8(protection->crc, protection->data_id, bytes, n_bytes, i_crc) !=
            bytes[i_crc]) {
            return GPOM_CAN_CRC;
        }
    }
    return protection->has_counter ? check_counter(protection, stream, bytes, n_bytes)
                                   : GPOM_CAN_OK;
}

const char *gpom_can_fault_str(gpom_can_fault_t fault)
{
    switch (fault) {
    case GPOM_CAN_OK:
        return "a message";
    case GPOM_CAN_LENGTH:
        return "wrong length";
    case GPOM_CAN_CRC:
        return "damaged: the CRC does not fit";
    case GPOM_CAN_COUNTER:
        return "the counter stands still or is none";
    case GPOM_CAN_VALUE:
        return "a field has a value that its definition does not know";
    case GPOM_CAN_FAULTS:
        break;
    }
    return "not a fault";
}
