/** \file signal.h
 *  Signals in CAN frames, as a DBC file describes them. Converts bits to numbers and back.
 *
 *  All of ports/can is C99 for microcontrollers and hosts. It uses no heap and no operating system
 *  and has no state of its own. Safe in an interrupt. */
#ifndef GPOM_CAN_SIGNAL_H
#define GPOM_CAN_SIGNAL_H

#include "gpom/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** Most payload of a CAN FD frame. A classic frame has at most 8 bytes. */
#define GPOM_CAN_BYTES_MAX 64u

/** A signal. Value = factor * bits + offset. */
typedef struct {
    uint16_t start_bit; /**< As in a DBC: 8 * byte + bit. Place of the least significant bit (Intel)
                             or of the most significant bit (Motorola). */
    uint8_t n_bits;     /**< 1 .. 64. */
    bool is_motorola;   /**< Most significant byte first: `@0` in a DBC. */
    bool is_signed;     /**< Two's complement: `-` in a DBC. */
    double factor;
    double offset;
} gpom_can_signal_t;

/** Payload bytes that a frame needs to hold the signal. 0 if the signal fits no frame. */
size_t gpom_can_signal_bytes(const gpom_can_signal_t *signal);

/** Get the signal's bits. False if `n_bytes` is too small or a pointer is NULL.
 *  Cost: O(n_bits). */
GPOM_NODISCARD bool gpom_can_signal_bits(const gpom_can_signal_t *signal, const uint8_t *bytes,
                                         size_t n_bytes, uint64_t *bits);

/** Get the signal's value. False if `n_bytes` is too small or a pointer is NULL.
 *  Cost: O(n_bits). */
GPOM_NODISCARD bool gpom_can_signal_value(const gpom_can_signal_t *signal, const uint8_t *bytes,
                                          size_t n_bytes, double *value);

/** Put the signal's bits into a frame. All other bits stay. False if `n_bytes` is too small or a
 *  pointer is NULL.
 *  Cost: O(n_bits). */
GPOM_NODISCARD bool gpom_can_signal_put(const gpom_can_signal_t *signal, uint64_t bits,
                                        uint8_t *bytes, size_t n_bytes);

#ifdef __cplusplus
}
#endif
#endif
