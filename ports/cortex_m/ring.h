/* A ring buffer of bytes between one interrupt and the main loop. One side puts bytes, the other
 * side gets them. Each index has only one writer, so no lock is needed. */
#ifndef GPOM_PORTS_CORTEX_M_RING_H
#define GPOM_PORTS_CORTEX_M_RING_H

#include <stdbool.h>
#include <stdint.h>

enum { RING_BYTES = 1024 }; /* a power of two */

typedef struct {
    volatile uint32_t n_put; /* bytes put so far, modulo 2^32 */
    volatile uint32_t n_got;
    volatile uint8_t bytes[RING_BYTES];
} ring_t;

static inline bool ring_is_full(const ring_t *ring)
{
    return ring->n_put - ring->n_got == RING_BYTES;
}

/* Put a byte. The ring must not be full. */
static inline void ring_put(ring_t *ring, uint8_t byte)
{
    ring->bytes[ring->n_put % RING_BYTES] = byte;
    ring->n_put = ring->n_put + 1;
}

/* Get a byte. False if the ring is empty. */
static inline bool ring_get(ring_t *ring, uint8_t *byte)
{
    if (ring->n_got == ring->n_put) {
        return false;
    }
    *byte = ring->bytes[ring->n_got % RING_BYTES];
    ring->n_got = ring->n_got + 1;
    return true;
}

#endif
