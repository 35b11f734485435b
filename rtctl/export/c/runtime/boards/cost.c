/* What a sample costs on an emulated Cortex-M4F: instructions and stack, over the inputs of the file `in.bin`.
 *
 * QEMU's -icount shift=0 lets a nanosecond pass with each instruction; the board's timer of 25 MHz counts 40 of them.
 * Written to `cost.bin`: samples and most instructions of one (uint32), instructions of all (uint64), bytes
 * of stack and of the state (uint32).
 */
#include "rtctl.h"
#include "semihosting.h"

enum { ROWS = 256, PER_TICK = 40, PAINTED = 8192, PAINT = 0xA5 };

typedef struct { volatile uint32_t control, value, reload, interrupt; } timer_registers;
#define TIMER ((timer_registers *)0x40000000u)

static rtctl_state state;
static rtctl_in in[ROWS];
static rtctl_out out;
static struct { uint32_t samples, most; uint64_t all; uint32_t stack, state; } cost;

/* Where the stack ends: what lies below the caller's frame is free until it calls. */
static volatile uint8_t *stack_end(void)
{
    uint32_t end;
    __asm__ volatile("mov %0, sp" : "=r"(end));
    return (volatile uint8_t *)end;
}

static inline void paint(volatile uint8_t *end)
{
    for (int k = 1; k <= PAINTED; k++)
        end[-k] = PAINT;
}

static inline uint32_t painted_over(volatile const uint8_t *end)
{
    uint32_t k = PAINTED;
    while (k > 0 && end[-(int)k] == PAINT)
        k--;
    return k;
}

int main(void)
{
    uintptr_t from = file_open("in.bin", 6, SEMIHOSTING_READ_BINARY);
    uintptr_t to = file_open("cost.bin", 8, SEMIHOSTING_WRITE_BINARY);
    TIMER->reload = TIMER->value = UINT32_MAX;
    TIMER->control = 1;
    rtctl_init(&state);
    for (;;) {
        uintptr_t rows = (sizeof in - file_read(from, in, sizeof in)) / sizeof in[0];
        if (rows == 0)
            break;
        for (uintptr_t k = 0; k < rows; k++) {
            if (in[k].periods == 0) {
                rtctl_init(&state);
                state.settle_left = 1;
                in[k].periods = 1;
            }
            volatile uint8_t *end = stack_end();
            paint(end);
            uint32_t begin = TIMER->value;
            rtctl_step(&state, &in[k], &out);
            uint32_t ticks = begin - TIMER->value; /* it counts down */
            uint32_t stack = painted_over(end);
            cost.samples++;
            cost.all += (uint64_t)ticks * PER_TICK;
            if (ticks * PER_TICK > cost.most)
                cost.most = ticks * PER_TICK;
            if (stack > cost.stack)
                cost.stack = stack;
        }
    }
    cost.state = sizeof state;
    file_write(to, &cost, sizeof cost);
    leave();
    return 0;
}
