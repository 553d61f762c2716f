/** \file signal.h
 *  Signals in CAN frames, as a DBC file describes them: bits to numbers and back.
 *
 *  All of ports/can is C99 without heap, operating system or state of its own, for microcontrollers
 *  as for hosts. Safe in an interrupt. */
#ifndef GPOM_CAN_SIGNAL_H
#define GPOM_CAN_SIGNAL_H

#include "gpom/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Payload of a CAN FD frame; a classic one has 8 bytes at most. */
#define GPOM_CAN_BYTES_MAX 64u

/** A signal. Value = factor * bits + offset. */
typedef struct {
    uint16_t start_bit; /**< As in a DBC: 8 * byte + bit of the least significant bit (Intel), of
                             the most significant one (Motorola). */
    uint8_t n_bits;     /**< 1 .. 64. */
    bool is_motorola;   /**< Most significant byte first: `@0` in a DBC. */
    bool is_signed;     /**< Two's complement: `-` in a DBC. */
    double factor;
    double offset;
} gpom_can_signal_t;

/** Payload bytes that a frame must have for the signal to be in it; 0 if the signal fits no
 *  frame. */
size_t gpom_can_signal_bytes(const gpom_can_signal_t *signal);

/** The signal's bits. False: `n_bytes` are too few, or a pointer is NULL.  O(n_bits). */
GPOM_NODISCARD bool gpom_can_signal_bits(const gpom_can_signal_t *signal, const uint8_t *bytes,
                                         size_t n_bytes, uint64_t *bits);

/** The signal's value. False as above.  O(n_bits). */
GPOM_NODISCARD bool gpom_can_signal_value(const gpom_can_signal_t *signal, const uint8_t *bytes,
                                          size_t n_bytes, double *value);

/** Put bits into a frame; all else stays. False as above.  O(n_bits). */
GPOM_NODISCARD bool gpom_can_signal_put(const gpom_can_signal_t *signal, uint64_t bits,
                                        uint8_t *bytes, size_t n_bytes);

#ifdef __cplusplus
}
#endif
#endif
