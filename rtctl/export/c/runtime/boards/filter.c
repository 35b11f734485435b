/* The exported loop as a filter on an emulated processor: from the file `in.bin` to `out.bin` of the computer beside it.
 *
 * An input with periods = 0 starts anew, without a hold at the safe level: the next reading closes the loop.
 */
#include "rtctl.h"
#include "semihosting.h"

enum { ROWS = 256 };

static rtctl_state state;
static rtctl_in in[ROWS];
static rtctl_out out[ROWS];

int main(void)
{
    uintptr_t from = file_open("in.bin", 6, SEMIHOSTING_READ_BINARY);
    uintptr_t to = file_open("out.bin", 7, SEMIHOSTING_WRITE_BINARY);
    rtctl_init(&state);
    for (;;) {
        uintptr_t rows = (sizeof in - file_read(from, in, sizeof in)) / sizeof in[0];
        if (rows == 0)
            leave();
        for (uintptr_t k = 0; k < rows; k++) {
            if (in[k].periods == 0) {
                rtctl_init(&state);
                state.settle_left = 1;
                in[k].periods = 1;
            }
            rtctl_step(&state, &in[k], &out[k]);
        }
        file_write(to, out, rows * sizeof out[0]);
    }
}
