/* Start-up for a bare Cortex-M4F/M7: vector table, FPU, initialised data, and an exit code for
 * faults. It uses no start-up files of a C library. There are no static constructors, because the
 * linker script rejects them. */
#include "semihosting.h"

#include <stdint.h>

/* Semihosting operations: Arm IHI 0084, "Semihosting for AArch32 and AArch64", section 6. */
#define SYS_WRITE0 0x04
#define SYS_EXIT_EXTENDED 0x20
#define ADP_STOPPED_APPLICATION_EXIT 0x20026u

/* Coprocessor Access Control Register, Armv7-M ARM B3.2.20: CP10 and CP11 are the FPU. */
#define CPACR (*(volatile uint32_t *)0xE000ED88u)
#define CPACR_FPU_FULL_ACCESS (0xFu << 20)

#define VECTORS 18 /* 16 of the processor, and interrupts 0 and 1 */

extern uint32_t stack_top, data_load, data_begin, data_end, bss_begin, bss_end;

int main(void);
void reset_entry(void) __attribute__((noreturn));

static int32_t semihosting_call(int32_t operation, const void *argument)
{
    register int32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void semihosting_write(const char *text) { (void)semihosting_call(SYS_WRITE0, text); }

void semihosting_write_u32(uint32_t value)
{
    char text[11]; /* 4294967295 and NUL */
    char *digit = &text[10];
    *digit = '\0';
    do {
        *--digit = (char)('0' + value % 10u);
        value /= 10u;
    } while (value > 0);
    semihosting_write(digit);
}

void semihosting_exit(int code)
{
    const uint32_t block[2] = {ADP_STOPPED_APPLICATION_EXIT, (uint32_t)code};
    for (;;) {
        (void)semihosting_call(SYS_EXIT_EXTENDED, block);
    }
}

/* Never inlined or merged, because icount_plugin.c finds the markers by their addresses. */
__attribute__((noinline, noclone, used)) void gpom_count_begin(void)
{
    __asm__ volatile("" ::: "memory");
}

__attribute__((noinline, noclone, used)) void gpom_count_end(void)
{
    __asm__ volatile("nop" ::: "memory");
}

void fault_entry(void);
void fault_entry(void)
{
    semihosting_write("processor fault\n");
    semihosting_exit(SEMIHOSTING_EXIT_FAULT);
}

void reset_entry(void)
{
    CPACR |= CPACR_FPU_FULL_ACCESS;
    __asm__ volatile("dsb\n\tisb" ::: "memory");
    const uint32_t *from = &data_load;
    for (uint32_t *to = &data_begin; to < &data_end; ++to) {
        *to = *from++;
    }
    for (uint32_t *to = &bss_begin; to < &bss_end; ++to) {
        *to = 0;
    }
    semihosting_exit(main());
}

/* Entries of exceptions and interrupts that an image may define. An entry that it does not define
 * ends the run as a fault. */
#define MAY_BE_DEFINED __attribute__((weak, alias("fault_entry")))
void nmi_entry(void) MAY_BE_DEFINED;
void systick_entry(void) MAY_BE_DEFINED;
void uart0_receive_entry(void) MAY_BE_DEFINED;
void uart0_transmit_entry(void) MAY_BE_DEFINED;

typedef union {
    void (*entry)(void);
    uint32_t *stack;
} vector_t;

__attribute__((section(".vectors"), used)) static const vector_t vectors[VECTORS] = {
    {.stack = &stack_top},           {.entry = reset_entry}, {.entry = nmi_entry},
    {.entry = fault_entry}, /* hard fault; all other faults escalate to it */
    {.entry = fault_entry},          {.entry = fault_entry}, {.entry = fault_entry},
    {.entry = fault_entry},          {.entry = fault_entry}, {.entry = fault_entry},
    {.entry = fault_entry},          {.entry = fault_entry}, {.entry = fault_entry},
    {.entry = fault_entry},          {.entry = fault_entry}, {.entry = systick_entry},
    {.entry = uart0_receive_entry}, /* interrupt 0 of the mps2 */
    {.entry = uart0_transmit_entry},
};
