/* Start of a Cortex-M4F without an operating system: vector table, floating-point unit, variables, main. */
#include <stdint.h>
#include <string.h>

extern uint32_t ld_data_load[], ld_data_begin[], ld_data_end[], ld_bss_begin[], ld_bss_end[];
void ld_stack_top(void); /* no function: where the stack begins, in the form of the other vectors */
int main(void);
void reset(void);
void stop(void);

#define COPROCESSOR_ACCESS (*(volatile uint32_t *)0xE000ED88u) /* CPACR, ARMv7-M manual, B3.2.20 */

void reset(void)
{
    COPROCESSOR_ACCESS |= 0xFu << 20; /* full access to the floating-point unit */
    __asm__ volatile("dsb\n\tisb" ::: "memory");
    memcpy(ld_data_begin, ld_data_load, (size_t)((char *)ld_data_end - (char *)ld_data_begin));
    memset(ld_bss_begin, 0, (size_t)((char *)ld_bss_end - (char *)ld_bss_begin));
    main();
    stop();
}

/* Faults end here; a real board resets by its hardware watchdog, and its current source is off after a reset. */
void stop(void)
{
    for (;;)
        __asm__ volatile("wfi");
}

/* Exceptions 1 to 15. Interrupts stay masked: they only end the sleep of board_wait. */
__attribute__((section(".vectors"), used)) static void (*const vectors[16])(void) = {
    ld_stack_top, reset, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop,
};
