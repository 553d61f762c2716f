#include "ports/template/port.h"

/* Put the registers of your clock, line and watchdog here, and rings for their interrupts. */
typedef struct {
    int64_t now_us;
    uint32_t n_overruns;
    uint32_t n_resets;
} board_t;

static board_t board;

static int64_t now_us(void *ctx)
{
    const board_t *const here = ctx;
    return here->now_us; /* replace: read a timer that is extended to 64 bits */
}

static size_t bytes_read(void *ctx, uint8_t *bytes, size_t n_max)
{
    (void)ctx;
    (void)bytes;
    (void)n_max;
    return 0; /* replace: get bytes from the ring that the receive interrupt fills */
}

static size_t bytes_write(void *ctx, const uint8_t *bytes, size_t n_bytes)
{
    (void)ctx;
    (void)bytes;
    return n_bytes; /* replace: put bytes into the ring that the transmit interrupt empties */
}

static void watchdog_feed(void *ctx) { (void)ctx; /* replace: write its register */ }

static uint32_t line_overruns(void *ctx)
{
    const board_t *const here = ctx;
    return here->n_overruns;
}

static uint32_t watchdog_resets(void *ctx)
{
    const board_t *const here = ctx;
    return here->n_resets;
}

gpom_port_t template_port(void)
{
    const gpom_port_t port = {&board,        now_us,        bytes_read,     bytes_write,
                              watchdog_feed, line_overruns, watchdog_resets};
    return port;
}
