/* Start of a RISC-V processor without an operating system: stack, floating-point unit, variables, main. */
#include <stdint.h>
#include <string.h>

extern uint32_t ld_bss_begin[], ld_bss_end[];
int main(void);
void start(void);
void reset(void);

void start(void)
{
    memset(ld_bss_begin, 0, (size_t)((char *)ld_bss_end - (char *)ld_bss_begin));
    main();
    for (;;) { }
}

__attribute__((section(".reset"), naked, used)) void reset(void)
{
    __asm__ volatile("la sp, ld_stack_top\n\tli t0, 0x6000\n\tcsrs mstatus, t0\n\tcall start"); /* FS: on */
}
