#include "ports/can/signal.h"

/* The place of one bit in a frame. */
typedef struct {
    size_t i_byte;
    unsigned i_bit;
} place_t;

/* The place of the next more significant bit. After bit 7 of a byte, Intel goes on in the next byte
 * and Motorola in the byte before. */
static place_t next_place(const gpom_can_signal_t *signal, place_t place)
{
    if (place.i_bit < 7u) {
        ++place.i_bit;
    } else {
        place.i_bit = 0;
        place.i_byte = signal->is_motorola ? place.i_byte - 1u : place.i_byte + 1u;
    }
    return place;
}

/* The last byte of a signal. In a Motorola signal, start_bit is the most significant bit. So the
 * first byte holds at most start_bit % 8 + 1 bits of the signal, and each later byte at most 8. */
static size_t last_byte(const gpom_can_signal_t *signal)
{
    const size_t first = signal->start_bit / 8u;
    const size_t in_first = signal->start_bit % 8u + 1u;
    if (!signal->is_motorola) {
        return (signal->start_bit + (size_t)signal->n_bits - 1u) / 8u;
    }
    return signal->n_bits <= in_first ? first : first + (signal->n_bits - in_first + 7u) / 8u;
}

static place_t first_place(const gpom_can_signal_t *signal)
{
    place_t place = {signal->start_bit / 8u, signal->start_bit % 8u};
    if (signal->is_motorola) {
        const unsigned in_first = signal->start_bit % 8u + 1u;
        place.i_byte = last_byte(signal);
        place.i_bit = signal->n_bits <= in_first ? in_first - signal->n_bits
                                                 : (8u - (signal->n_bits - in_first) % 8u) % 8u;
    }
    return place;
}

static bool fits_frame(const gpom_can_signal_t *signal, const uint8_t *bytes, size_t n_bytes)
{
    const size_t n_needed = gpom_can_signal_bytes(signal);
    return bytes != NULL && n_needed != 0 && n_bytes >= n_needed;
}

size_t gpom_can_signal_bytes(const gpom_can_signal_t *signal)
{
    if (signal == NULL || signal->n_bits == 0 || signal->n_bits > 64) {
        return 0;
    }
    const size_t n_bytes = last_byte(signal) + 1u;
    return n_bytes <= GPOM_CAN_BYTES_MAX ? n_bytes : 0;
}

bool gpom_can_signal_bits(const gpom_can_signal_t *signal, const uint8_t *bytes, size_t n_bytes,
                          uint64_t *bits)
{
    if (bits == NULL || !fits_frame(signal, bytes, n_bytes)) {
        return false;
    }
    *bits = 0;
    place_t place = first_place(signal);
    for (unsigned i = 0; i < signal->n_bits; ++i) {
        *bits |= (uint64_t)((bytes[place.i_byte] >> place.i_bit) & 1u) << i;
        place = next_place(signal, place);
    }
    return true;
}

bool gpom_can_signal_value(const gpom_can_signal_t *signal, const uint8_t *bytes, size_t n_bytes,
                           double *value)
{
    uint64_t bits = 0;
    if (value == NULL || !gpom_can_signal_bits(signal, bytes, n_bytes, &bits)) {
        return false;
    }
    double number = (double)bits;
    if (signal->is_signed && (bits >> (signal->n_bits - 1u)) != 0) {
        const uint64_t ones = signal->n_bits < 64 ? ~UINT64_C(0) << signal->n_bits : 0;
        number = -(double)(~(bits | ones) + 1u); /* minus the magnitude */
    }
    *value = signal->factor * number + signal->offset;
    return true;
}

bool gpom_can_signal_put(const gpom_can_signal_t *signal, uint64_t bits, uint8_t *bytes,
                         size_t n_bytes)
{
    if (!fits_frame(signal, bytes, n_bytes)) {
        return false;
    }
    place_t place = first_place(signal);
    for (unsigned i = 0; i < signal->n_bits; ++i) {
        const unsigned bit = (unsigned)(bits >> i) & 1u;
        const unsigned rest = bytes[place.i_byte] & ~(1u << place.i_bit);
        bytes[place.i_byte] = (uint8_t)(rest | (bit << place.i_bit));
        place = next_place(signal, place);
    }
    return true;
}
