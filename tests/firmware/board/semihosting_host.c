/* What ports/cortex_m/startup.c offers, on a PC: the same board prints and ends there, too. */
#include "ports/cortex_m/semihosting.h"

#include <stdio.h>
#include <stdlib.h>

void semihosting_write(const char *text) { fputs(text, stdout); }

void semihosting_write_u32(uint32_t value) { printf("%lu", (unsigned long)value); }

void semihosting_exit(int code) { exit(code); }
