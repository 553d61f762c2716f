/* The parts of an mps2 board that the device uses: CMSDK UARTs 0 and 1, CMSDK timer 0, CMSDK
 * watchdog, SysTick. QEMU models all of them (mps2-an500: Cortex-M7; mps2-an386: Cortex-M4F). */
#ifndef GPOM_PORTS_CORTEX_M_MPS2_H
#define GPOM_PORTS_CORTEX_M_MPS2_H

#include "ports/uart/device.h"

/** Bits per second of UART 0. */
#define MPS2_BAUD 1000000u

/** The watchdog restarts the board if it was not fed for twice this time. */
#define MPS2_WATCHDOG_MS 2000u

/** Start clock, UART and watchdog. */
void mps2_init(void);

/** The hooks of ports/uart/device.h. */
gpom_port_t mps2_port(void);

/** Bits per second of UART 1. */
#define MPS2_UART1_BAUD 921600u

/** Start UART 1, for sending alone and without an interrupt. */
void mps2_init_uart1(void);

/** Send bytes over UART 1, as many as it takes at once. */
size_t mps2_write_uart1(void *ctx, const uint8_t *bytes, size_t n_bytes);

/** Sleep until bytes come, bytes can be sent, or a millisecond has passed. */
void mps2_sleep(void);

#endif
