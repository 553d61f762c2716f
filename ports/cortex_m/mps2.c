#include "ports/cortex_m/mps2.h"

#include "ports/cortex_m/ring.h"

/* CMSDK peripherals: Arm Cortex-M System Design Kit TRM (DDI 0479), sections 4.3 to 4.5. Addresses
 * and interrupts: Arm AN500, section 4. */
typedef struct {
    volatile uint32_t data, state, control, interrupt, divider;
} uart_t;
typedef struct {
    volatile uint32_t control, value, reload, interrupt;
} timer_t;
typedef struct {
    volatile uint32_t load, value, control, clear;
} watchdog_t;

#define TIMER0 ((timer_t *)0x40000000u)
#define UART0 ((uart_t *)0x40004000u)
#define UART1 ((uart_t *)0x40005000u)
#define WATCHDOG ((watchdog_t *)0x40008000u)
#define WATCHDOG_LOCK (*(volatile uint32_t *)0x40008c00u)

#define SYSTICK_CONTROL (*(volatile uint32_t *)0xe000e010u)
#define SYSTICK_RELOAD (*(volatile uint32_t *)0xe000e014u)
#define NVIC_ENABLE (*(volatile uint32_t *)0xe000e100u)
#define NVIC_PEND (*(volatile uint32_t *)0xe000e200u)

enum {
    CLOCK_HZ = 25000000,
    TICKS_A_US = 25,
    TIMER_ON = 1,
    WATCHDOG_INTERRUPT = 1,
    WATCHDOG_RESET = 2,
    SYSTICK_ON = 7, /* count with the processor's clock, interrupt on */
};
enum { UART_STATE_OUT_FULL = 1, UART_STATE_IN_FULL = 2, UART_STATE_IN_OVERRUN = 8 };
enum { UART_ON = 3, UART_OUT_ON = 1, UART_OUT_INTERRUPT = 4, UART_IN_INTERRUPT = 8 };
enum { UART_CLEAR_OUT = 1, UART_CLEAR_IN = 2 };
enum { NVIC_UART_IN = 1, NVIC_UART_OUT = 2 };

#define WATCHDOG_KEY 0x1acce551u
#define KEPT_KEY 0x6b657074u

/* Bytes between the interrupts and the main loop. */
static ring_t incoming, outgoing;
static volatile uint32_t n_overruns;

/* Keeps its values over a reset. After power-on the values are random until `key` is KEPT_KEY. */
__attribute__((section(".kept"))) static struct {
    uint32_t key;
    uint32_t n_resets;
    uint32_t is_hanging; /* 1: the watchdog will reset the board */
} kept;

static uint32_t ticks_before; /* ticks of the timer when it was read last, modulo 2^32 */
static int64_t ticks;         /* ticks since mps2_init() */

void uart0_receive_entry(void);
void uart0_transmit_entry(void);
void systick_entry(void);
void nmi_entry(void);

/* If the ring is full, the receive interrupt is switched off. Bytes that come then overrun the
 * UART, which sets its overrun bit. (In QEMU the line waits instead.) */
void uart0_receive_entry(void)
{
    UART0->interrupt = UART_CLEAR_IN;
    while ((UART0->state & UART_STATE_IN_FULL) != 0) {
        if (ring_is_full(&incoming)) {
            UART0->control = UART_ON | UART_OUT_INTERRUPT;
            return;
        }
        ring_put(&incoming, (uint8_t)UART0->data);
    }
    if ((UART0->state & UART_STATE_IN_OVERRUN) != 0) {
        UART0->state = UART_STATE_IN_OVERRUN;
        n_overruns = n_overruns + 1;
    }
}

void uart0_transmit_entry(void)
{
    UART0->interrupt = UART_CLEAR_OUT;
    uint8_t byte;
    while ((UART0->state & UART_STATE_OUT_FULL) == 0 && ring_get(&outgoing, &byte)) {
        UART0->data = byte;
    }
}

/* The interrupt only ends mps2_sleep(). */
void systick_entry(void) {}

/* Never inlined: a test sends the processor here to check the watchdog. */
__attribute__((noinline)) static void wait_for_ever(void)
{
    for (;;) {
        __asm__ volatile("");
    }
}

/* The watchdog ran out once, so the main loop hangs. Note this, and wait until the watchdog runs
 * out again and resets the board. */
void nmi_entry(void)
{
    kept.is_hanging = 1;
    wait_for_ever();
}

void mps2_init(void)
{
    if (kept.key != KEPT_KEY) {
        kept.key = KEPT_KEY;
        kept.n_resets = 0;
    } else if (kept.is_hanging != 0) {
        ++kept.n_resets;
    }
    kept.is_hanging = 0;

    TIMER0->reload = UINT32_MAX;
    TIMER0->value = UINT32_MAX;
    TIMER0->control = TIMER_ON;
    SYSTICK_RELOAD = CLOCK_HZ / 1000 - 1;
    SYSTICK_CONTROL = SYSTICK_ON;

    UART0->divider = CLOCK_HZ / MPS2_BAUD;
    UART0->control = UART_ON | UART_IN_INTERRUPT | UART_OUT_INTERRUPT;
    NVIC_ENABLE = NVIC_UART_IN | NVIC_UART_OUT;

    WATCHDOG_LOCK = WATCHDOG_KEY;
    WATCHDOG->load = CLOCK_HZ / 1000 * MPS2_WATCHDOG_MS;
    WATCHDOG->control = WATCHDOG_INTERRUPT | WATCHDOG_RESET;
    WATCHDOG_LOCK = 0;
}

/* The timer counts down from 2^32 - 1 and wraps every 171 s. It must be read more often than this.
 */
static int64_t now_us(void *ctx)
{
    (void)ctx;
    const uint32_t ticks_now = UINT32_MAX - TIMER0->value;
    ticks += (uint32_t)(ticks_now - ticks_before);
    ticks_before = ticks_now;
    return ticks / TICKS_A_US;
}

static size_t bytes_read(void *ctx, uint8_t *bytes, size_t n_max)
{
    (void)ctx;
    size_t n = 0;
    while (n < n_max && ring_get(&incoming, &bytes[n])) {
        ++n;
    }
    if ((UART0->control & UART_IN_INTERRUPT) == 0 && !ring_is_full(&incoming)) {
        UART0->control = UART_ON | UART_IN_INTERRUPT | UART_OUT_INTERRUPT;
        NVIC_PEND = NVIC_UART_IN; /* a byte may have waited since the ring was full */
    }
    return n;
}

static size_t bytes_write(void *ctx, const uint8_t *bytes, size_t n_bytes)
{
    (void)ctx;
    size_t n = 0;
    while (n < n_bytes && !ring_is_full(&outgoing)) {
        ring_put(&outgoing, bytes[n++]);
    }
    NVIC_PEND = NVIC_UART_OUT; /* starts sending if the line was idle */
    return n;
}

static void watchdog_feed(void *ctx)
{
    (void)ctx;
    WATCHDOG_LOCK = WATCHDOG_KEY;
    WATCHDOG->clear = 1;
    WATCHDOG_LOCK = 0;
}

static uint32_t line_overruns(void *ctx)
{
    (void)ctx;
    return n_overruns;
}

static uint32_t watchdog_resets(void *ctx)
{
    (void)ctx;
    return kept.n_resets;
}

gpom_port_t mps2_port(void)
{
    const gpom_port_t port = {NULL,          now_us,        bytes_read,     bytes_write,
                              watchdog_feed, line_overruns, watchdog_resets};
    return port;
}

void mps2_init_uart1(void)
{
    UART1->divider = CLOCK_HZ / MPS2_UART1_BAUD;
    UART1->control = UART_OUT_ON;
}

size_t mps2_write_uart1(void *ctx, const uint8_t *bytes, size_t n_bytes)
{
    (void)ctx;
    size_t n = 0;
    while (n < n_bytes && (UART1->state & UART_STATE_OUT_FULL) == 0) {
        UART1->data = bytes[n++];
    }
    return n;
}

void mps2_sleep(void) { __asm__ volatile("wfi" ::: "memory"); }
