/* Arm semihosting: how the image prints and exits when it runs in QEMU or under a debugger.
 * Also the two markers between which icount_plugin.c counts instructions. */
#ifndef GPOM_PORTS_CORTEX_M_SEMIHOSTING_H
#define GPOM_PORTS_CORTEX_M_SEMIHOSTING_H

#include <stdint.h>

/** Exit code of the image after any processor fault. */
#define SEMIHOSTING_EXIT_FAULT 77

/** Print a NUL-terminated string; no formatting, so no libc. */
void semihosting_write(const char *text);

/** Print an unsigned decimal number. */
void semihosting_write_u32(uint32_t value);

/** End the simulation; `code` becomes the exit code of QEMU (0 to 255). */
void semihosting_exit(int code) __attribute__((noreturn));

/** Instructions executed between the return of count_begin and the call of count_end are one
 *  interval of the instruction counter. After each interval print one line "count NAME N":
 *  what was counted, and by how many units of work (queries, say) to divide. */
void gpom_count_begin(void);
void gpom_count_end(void);

#endif
