/* Start of the unit tests on the target: they are hosted programs, with newlib's semihosting
 * library (rdimon) as their operating system. Only tests: the device's images have none of it. */
#include <stdint.h>

/* Coprocessor Access Control Register, Armv7-M ARM B3.2.20: CP10 and CP11 are the FPU. */
#define CPACR (*(volatile uint32_t *)0xE000ED88u)

/* Semihosting (Arm IHI 0084) SYS_EXIT_EXTENDED with an application's exit code. */
#define SYS_EXIT_EXTENDED 0x20
#define EXIT_FAULT 77

extern uint32_t stack_top;
void _start(void);
void reset_entry(void);

void reset_entry(void)
{
    CPACR |= 0xFu << 20;
    __asm__ volatile("dsb\n\tisb" ::: "memory");
    _start();
}

static void fault_entry(void)
{
    static const uint32_t block[2] = {0x20026u, EXIT_FAULT};
    register int r0 __asm__("r0") = SYS_EXIT_EXTENDED;
    register const void *r1 __asm__("r1") = block;
    __asm__ volatile("bkpt 0xab" ::"r"(r0), "r"(r1) : "memory");
}

typedef union {
    void (*entry)(void);
    uint32_t *stack;
} vector_t;

__attribute__((section(".vectors"), used)) static const vector_t vectors[] = {
    {.stack = &stack_top},  {.entry = reset_entry}, {.entry = fault_entry}, {.entry = fault_entry},
    {.entry = fault_entry}, {.entry = fault_entry}, {.entry = fault_entry}, {.entry = fault_entry},
};
