/* The board as Arm's MPS2 with image AN386, a Cortex-M4F at 25 MHz, which QEMU emulates: UART 0, timer 0, SysTick.
 *
 * Registers: Arm Cortex-M System Design Kit manual (DDI 0479), chapters "APB UART" and "APB timer"; ARMv7-M manual.
 */
#include "mps2_an386.h"
#include "rtctl_board.h"

enum { CLOCK_HZ = 25000000, CYCLES_US = CLOCK_HZ / 1000000, BAUD = 115200 };
enum { LONGEST_SEND_US = 10000 }; /* of one byte, which takes 87 us: then nobody reads at the other end */

typedef struct { volatile uint32_t data, state, control, interrupt, divider; } uart_registers;
typedef struct { volatile uint32_t control, value, reload, interrupt; } timer_registers;
typedef struct { volatile uint32_t control, reload, value; } systick_registers;

#define UART ((uart_registers *)0x40004000u)
#define TIMER ((timer_registers *)0x40000000u)
#define SYSTICK ((systick_registers *)0xE000E010u)
#define INTERRUPT_ENABLE (*(volatile uint32_t *)0xE000E100u)   /* NVIC_ISER0 */
#define INTERRUPT_FORGET (*(volatile uint32_t *)0xE000E280u)   /* NVIC_ICPR0 */
#define SYSTEM_STATE (*(volatile uint32_t *)0xE000ED04u)       /* ICSR */

enum { UART_SEND = 1, UART_RECEIVE = 2, UART_RECEIVE_INTERRUPT = 8 };   /* control */
enum { UART_SEND_FULL = 1, UART_HAS_BYTE = 2 };                         /* state */
enum { UART_RECEIVED = 2 };                                             /* interrupt: written to forget it */
enum { UART_INTERRUPT = 1 << 0, FORGET_TICK = 1 << 25 };

void mps2_start(void)
{
    __asm__ volatile("cpsid i"); /* interrupts wake the processor and are not served: there is nothing to race with */
    TIMER->reload = TIMER->value = UINT32_MAX;
    TIMER->control = 1;
    SYSTICK->reload = CLOCK_HZ / 1000 - 1;
    SYSTICK->value = 0;
    SYSTICK->control = 7; /* on, interrupt, processor clock */
    UART->divider = CLOCK_HZ / BAUD;
    UART->control = UART_SEND | UART_RECEIVE | UART_RECEIVE_INTERRUPT;
    INTERRUPT_ENABLE = UART_INTERRUPT;
}

uint64_t board_time_us(void)
{
    static uint64_t time_us;
    static uint32_t last, cycles; /* cycles: those that are no whole microsecond yet */
    uint32_t now = UINT32_MAX - TIMER->value; /* it counts down, and round in 172 s: device_turn asks every millisecond */
    cycles += now - last;
    last = now;
    time_us += cycles / CYCLES_US;
    cycles %= CYCLES_US;
    return time_us;
}

int board_receive(void)
{
    return UART->state & UART_HAS_BYTE ? (int)(UART->data & 0xFF) : -1;
}

void board_send(const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        uint64_t end_us = board_time_us() + LONGEST_SEND_US;
        while (UART->state & UART_SEND_FULL)
            if (board_time_us() > end_us)
                return;
        UART->data = bytes[i];
    }
}

void board_wait(void)
{
    __asm__ volatile("wfi"); /* until a byte has arrived or SysTick's millisecond is over */
    UART->interrupt = UART_RECEIVED;
    INTERRUPT_FORGET = UART_INTERRUPT;
    SYSTEM_STATE = FORGET_TICK;
}
