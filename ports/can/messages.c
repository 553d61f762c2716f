#include "ports/can/messages.h"

static const gpom_can_crc8_t J1850 = {0xFF, 0xFF};

enum { FD_SECTORS_AT = 8, TILE_DEVIATION_AT = 40, TILE_STAMP_AT = 56 };

static unsigned low(unsigned value, unsigned n_bits) { return value & ((1u << n_bits) - 1u); }

static unsigned part_of(uint8_t byte, unsigned shift, unsigned n_bits)
{
    return low((unsigned)byte >> shift, n_bits);
}

static void put_u16(uint8_t *bytes, uint16_t value)
{
    bytes[0] = (uint8_t)(value & 0xFFu);
    bytes[1] = (uint8_t)(value >> 8);
}

static uint16_t get_u16(const uint8_t *bytes)
{
    return (uint16_t)(bytes[0] | ((unsigned)bytes[1] << 8));
}

static void put_u32(uint8_t *bytes, uint32_t value)
{
    put_u16(bytes, (uint16_t)(value & 0xFFFFu));
    put_u16(bytes + 2, (uint16_t)(value >> 16));
}

static uint32_t get_u32(const uint8_t *bytes)
{
    return get_u16(bytes) | ((uint32_t)get_u16(bytes + 2) << 16);
}

/* The signed number of a two's complement. A cast is not used, because its result depends on the
 * compiler. */
static int signed_of(unsigned bits, unsigned n_bits)
{
    return bits >> (n_bits - 1u) != 0 ? (int)bits - (1 << n_bits) : (int)bits;
}

static void seal_classic(uint8_t *bytes, uint16_t data_id)
{
    bytes[0] = gpom_can_crc8(J1850, data_id, bytes, GPOM_CAN_CLASSIC_BYTES, 0);
}

static gpom_can_fault_t open_classic(const uint8_t *bytes, size_t n_bytes, uint16_t data_id)
{
    if (bytes == NULL || n_bytes != GPOM_CAN_CLASSIC_BYTES) {
        return GPOM_CAN_LENGTH;
    }
    const bool is_whole = gpom_can_crc8(J1850, data_id, bytes, n_bytes, 0) == bytes[0];
    return !is_whole                                      ? GPOM_CAN_CRC
           : part_of(bytes[1], 0, 4) > GPOM_CAN_ALIVE_MAX ? GPOM_CAN_VALUE
                                                          : GPOM_CAN_OK;
}

static void seal_fd(uint8_t *bytes, uint16_t data_id)
{
    put_u16(bytes, gpom_can_crc16(data_id, bytes + 2, GPOM_CAN_FD_BYTES - 2u));
}

static gpom_can_fault_t open_fd(const uint8_t *bytes, size_t n_bytes, uint16_t data_id)
{
    if (bytes == NULL || n_bytes != GPOM_CAN_FD_BYTES) {
        return GPOM_CAN_LENGTH;
    }
    const bool is_whole = gpom_can_crc16(data_id, bytes + 2, n_bytes - 2u) == get_u16(bytes);
    return !is_whole                                      ? GPOM_CAN_CRC
           : part_of(bytes[2], 0, 4) > GPOM_CAN_ALIVE_MAX ? GPOM_CAN_VALUE
                                                          : GPOM_CAN_OK;
}

uint8_t gpom_can_distance_code(float distance_m)
{
    const double tenths = 10.0 * (double)distance_m; /* exact in double, so never rounded up */
    if (!(tenths >= 0.0)) {
        return distance_m < 0.0f ? 0 : (uint8_t)GPOM_CAN_DISTANCE_UNKNOWN;
    }
    return tenths >= GPOM_CAN_DISTANCE_MAX ? (uint8_t)GPOM_CAN_DISTANCE_MAX : (uint8_t)tenths;
}

float gpom_can_distance_m(uint8_t code, float range_m)
{
    return code == GPOM_CAN_DISTANCE_UNKNOWN ? 0.0f
           : code == GPOM_CAN_DISTANCE_CLEAR ? range_m
                                             : (float)code / 10.0f;
}

uint8_t gpom_can_age_code(float age_s)
{
    const double ticks = 100.0 * (double)age_s;
    if (!(ticks >= 0.0)) {
        return age_s < 0.0f ? 0 : (uint8_t)GPOM_CAN_AGE_UNKNOWN;
    }
    if (ticks >= GPOM_CAN_AGE_MAX) {
        return (uint8_t)GPOM_CAN_AGE_MAX;
    }
    const unsigned whole = (unsigned)ticks;
    return (uint8_t)(whole + ((double)whole < ticks ? 1u : 0u));
}

int8_t gpom_can_bearing_code(float bearing_rad)
{
    const double turns = (double)bearing_rad * 0.15915494309189535;
    if (!(turns >= -1e6 && turns <= 1e6)) {
        return GPOM_CAN_BEARING_UNKNOWN;
    }
    const double wrapped = turns - (double)(int32_t)turns; /* -1 .. 1 */
    const double steps = 180.0 * (wrapped > 0.5    ? wrapped - 1.0
                                  : wrapped < -0.5 ? wrapped + 1.0
                                                   : wrapped);
    return (int8_t)(steps < 0.0 ? steps - 0.5 : steps + 0.5);
}

uint8_t gpom_can_probability_code(uint16_t probability_65535ths)
{
    return (uint8_t)((probability_65535ths * GPOM_CAN_LEVEL_MAX + 65534u) / 65535u);
}

uint8_t gpom_can_deviation_code(uint8_t variance_255ths, uint8_t n_max)
{
    unsigned n = 0;
    while (n < n_max && n * n * 255u < (unsigned)variance_255ths * n_max * n_max) {
        ++n;
    }
    return (uint8_t)n;
}

void gpom_can_status_pack(const gpom_can_status_t *message, uint8_t *bytes)
{
    bytes[1] = (uint8_t)(low(message->alive, 4) | (low(message->state, 4) << 4));
    bytes[2] = message->age;
    bytes[3] = message->sequence;
    bytes[4] = message->clearance;
    bytes[5] = (uint8_t)message->bearing;
    bytes[6] = message->fill;
    bytes[7] = message->faults;
    seal_classic(bytes, GPOM_CAN_STATUS_DATA_ID);
}

gpom_can_fault_t gpom_can_status_unpack(gpom_can_status_t *message, const uint8_t *bytes,
                                        size_t n_bytes)
{
    const gpom_can_fault_t fault = open_classic(bytes, n_bytes, GPOM_CAN_STATUS_DATA_ID);
    if (fault != GPOM_CAN_OK) {
        return fault;
    }
    message->alive = (uint8_t)part_of(bytes[1], 0, 4);
    message->state = (uint8_t)part_of(bytes[1], 4, 4);
    message->age = bytes[2];
    message->sequence = bytes[3];
    message->clearance = bytes[4];
    message->bearing = (int8_t)signed_of(bytes[5], 8);
    message->fill = bytes[6];
    message->faults = bytes[7];
    const bool is_bearing = message->bearing == GPOM_CAN_BEARING_UNKNOWN ||
                            (message->bearing >= -90 && message->bearing <= 90);
    const bool is_known =
        message->state <= GPOM_CAN_STOPPING && is_bearing && message->fill <= GPOM_CAN_FILL_MAX;
    return is_known ? GPOM_CAN_OK : GPOM_CAN_VALUE;
}

void gpom_can_clearance_pack(const gpom_can_clearance_t *message, uint8_t *bytes)
{
    bytes[1] = (uint8_t)(low(message->alive, 4) | (low(message->i_part, 2) << 4) |
                         (low(message->state, 2) << 6));
    bytes[2] = message->sequence;
    for (size_t i = 0; i < GPOM_CAN_SECTORS_IN_FRAME; ++i) {
        bytes[3u + i] = message->distance[i];
    }
    seal_classic(bytes, GPOM_CAN_CLEARANCE_DATA_ID);
}

gpom_can_fault_t gpom_can_clearance_unpack(gpom_can_clearance_t *message, const uint8_t *bytes,
                                           size_t n_bytes)
{
    const gpom_can_fault_t fault = open_classic(bytes, n_bytes, GPOM_CAN_CLEARANCE_DATA_ID);
    if (fault != GPOM_CAN_OK) {
        return fault;
    }
    message->alive = (uint8_t)part_of(bytes[1], 0, 4);
    message->i_part = (uint8_t)part_of(bytes[1], 4, 2);
    message->state = (uint8_t)part_of(bytes[1], 6, 2);
    message->sequence = bytes[2];
    for (size_t i = 0; i < GPOM_CAN_SECTORS_IN_FRAME; ++i) {
        message->distance[i] = bytes[3u + i];
    }
    return message->i_part < GPOM_CAN_CLEARANCE_FRAMES ? GPOM_CAN_OK : GPOM_CAN_VALUE;
}

void gpom_can_clearance_fd_pack(const gpom_can_clearance_fd_t *message, uint8_t *bytes)
{
    bytes[2] = (uint8_t)(low(message->alive, 4) | (low(message->state, 2) << 4));
    bytes[3] = message->sequence;
    put_u32(bytes + 4, message->stamp_ms);
    for (size_t i = 0; i < GPOM_CAN_FD_SECTORS; ++i) {
        bytes[FD_SECTORS_AT + 2u * i] = message->distance[i];
        bytes[FD_SECTORS_AT + 2u * i + 1u] =
            (uint8_t)(low(message->probability[i], 4) | (low(message->deviation[i], 4) << 4));
    }
    seal_fd(bytes, GPOM_CAN_CLEARANCE_FD_DATA_ID);
}

gpom_can_fault_t gpom_can_clearance_fd_unpack(gpom_can_clearance_fd_t *message,
                                              const uint8_t *bytes, size_t n_bytes)
{
    const gpom_can_fault_t fault = open_fd(bytes, n_bytes, GPOM_CAN_CLEARANCE_FD_DATA_ID);
    if (fault != GPOM_CAN_OK) {
        return fault;
    }
    message->alive = (uint8_t)part_of(bytes[2], 0, 4);
    message->state = (uint8_t)part_of(bytes[2], 4, 2);
    message->sequence = bytes[3];
    message->stamp_ms = get_u32(bytes + 4);
    for (size_t i = 0; i < GPOM_CAN_FD_SECTORS; ++i) {
        message->distance[i] = bytes[FD_SECTORS_AT + 2u * i];
        message->probability[i] = (uint8_t)part_of(bytes[FD_SECTORS_AT + 2u * i + 1u], 0, 4);
        message->deviation[i] = (uint8_t)part_of(bytes[FD_SECTORS_AT + 2u * i + 1u], 4, 4);
    }
    return GPOM_CAN_OK;
}

void gpom_can_tile_pack(const gpom_can_tile_t *message, uint8_t *bytes)
{
    bytes[2] = (uint8_t)(low(message->alive, 4) | (low(message->state, 2) << 4));
    bytes[3] = message->sequence;
    bytes[4] = (uint8_t)message->tile_x;
    bytes[5] = (uint8_t)message->tile_y;
    bytes[6] = message->cell_cm;
    bytes[7] = message->n_tiles;
    for (size_t i = 0; i < GPOM_CAN_TILE_CELLS / 2u; ++i) {
        const uint8_t *const two = message->probability + 2u * i;
        bytes[8u + i] = (uint8_t)(low(two[0], 4) | (low(two[1], 4) << 4));
    }
    for (size_t i = 0; i < GPOM_CAN_TILE_CELLS / 4u; ++i) {
        const uint8_t *const four = message->deviation + 4u * i;
        bytes[TILE_DEVIATION_AT + i] = (uint8_t)(low(four[0], 2) | (low(four[1], 2) << 2) |
                                                 (low(four[2], 2) << 4) | (low(four[3], 2) << 6));
    }
    put_u32(bytes + TILE_STAMP_AT, message->stamp_ms);
    put_u16(bytes + TILE_STAMP_AT + 4, (uint16_t)message->reference_x);
    put_u16(bytes + TILE_STAMP_AT + 6, (uint16_t)message->reference_y);
    seal_fd(bytes, GPOM_CAN_TILE_DATA_ID);
}

gpom_can_fault_t gpom_can_tile_unpack(gpom_can_tile_t *message, const uint8_t *bytes,
                                      size_t n_bytes)
{
    const gpom_can_fault_t fault = open_fd(bytes, n_bytes, GPOM_CAN_TILE_DATA_ID);
    if (fault != GPOM_CAN_OK) {
        return fault;
    }
    message->alive = (uint8_t)part_of(bytes[2], 0, 4);
    message->state = (uint8_t)part_of(bytes[2], 4, 2);
    message->sequence = bytes[3];
    message->tile_x = (int8_t)signed_of(bytes[4], 8);
    message->tile_y = (int8_t)signed_of(bytes[5], 8);
    message->cell_cm = bytes[6];
    message->n_tiles = bytes[7];
    for (size_t i = 0; i < GPOM_CAN_TILE_CELLS; ++i) {
        const unsigned nibble = (unsigned)(i % 2u) * 4u, pair = (unsigned)(i % 4u) * 2u;
        message->probability[i] = (uint8_t)part_of(bytes[8u + i / 2u], nibble, 4);
        message->deviation[i] = (uint8_t)part_of(bytes[TILE_DEVIATION_AT + i / 4u], pair, 2);
    }
    message->stamp_ms = get_u32(bytes + TILE_STAMP_AT);
    message->reference_x = (int16_t)signed_of(get_u16(bytes + TILE_STAMP_AT + 4), 16);
    message->reference_y = (int16_t)signed_of(get_u16(bytes + TILE_STAMP_AT + 6), 16);
    return message->cell_cm > 0 ? GPOM_CAN_OK : GPOM_CAN_VALUE;
}

uint8_t gpom_can_alive_next(uint8_t alive)
{
    return alive >= GPOM_CAN_ALIVE_MAX ? 0 : (uint8_t)(alive + 1u);
}

uint8_t gpom_can_alive_step(uint8_t before, uint8_t now)
{
    const unsigned n_values = GPOM_CAN_ALIVE_MAX + 1u;
    return (uint8_t)((now + n_values - before) % n_values);
}
