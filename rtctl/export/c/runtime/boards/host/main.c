/* The exported loop as a filter of this computer: rtctl_in records from standard input, rtctl_out to standard output.
 *
 * An input with periods = 0 starts anew, without a hold at the safe level: the next reading closes the loop.
 */
#include <stdio.h>

#include "rtctl.h"

int main(void)
{
    static rtctl_state state;
    static rtctl_in in;
    static rtctl_out out;
    rtctl_init(&state);
    while (fread(&in, sizeof in, 1, stdin) == 1) {
        if (in.periods == 0) {
            rtctl_init(&state);
            state.settle_left = 1;
            in.periods = 1;
        }
        rtctl_step(&state, &in, &out);
        if (fwrite(&out, sizeof out, 1, stdout) != 1)
            return 1;
    }
    return fflush(stdout) == 0 ? 0 : 1;
}
