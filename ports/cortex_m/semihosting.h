/* Arm semihosting, with which an image prints and exits in QEMU or under a debugger. Also the two
 * markers between which icount_plugin.c counts instructions. */
#ifndef GPOM_PORTS_CORTEX_M_SEMIHOSTING_H
#define GPOM_PORTS_CORTEX_M_SEMIHOSTING_H

#include <stdint.h>

/** Exit code of the image after any processor fault. */
#define SEMIHOSTING_EXIT_FAULT 77

/** Print a NUL-terminated string. There is no formatting, so no libc is needed. */
void semihosting_write(const char *text);

/** Print an unsigned decimal number. */
void semihosting_write_u32(uint32_t value);

/** End the simulation. `code` becomes the exit code of QEMU (0 to 255). */
void semihosting_exit(int code) __attribute__((noreturn));

/** Begin and end an interval of the instruction counter. It counts the instructions between the
 *  return of gpom_count_begin() and the call of gpom_count_end(). After each interval, print one
 *  line "count NAME N". NAME is the measured call. N is the number of units of work, for example
 *  queries, by which the count is divided. */
void gpom_count_begin(void);
void gpom_count_end(void);

#endif
