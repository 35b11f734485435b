/* The loop closed by the board: the device is at its serial line, this file owns the samples.
 *
 * A debugger's files (semihosting) hold the plan `plan.bin` and take what the board tells, `told.bin`; they take no part
 * in the loop. On a board of your own, replace them by where your setpoints come from.
 */
#include "link.h"
#include "mps2_an386.h"
#include "rtctl.h"
#include "rtctl_board.h"
#include "semihosting.h"

typedef struct { uint32_t period_us, lockstep, watchdog_ms, timeout_us, samples; } loop_plan;
typedef struct { float setpoint, upcoming; } loop_setpoint;
typedef struct {
    int32_t index; /* of the sample; one with the board's own fault: -1 */
    float reference, commanded;
    rtctl_in in;
    rtctl_out out;
} loop_row;
enum { NO_ANSWER = 100 }; /* a fault of the line, beside those of rtctl_out */

static rtctl_state state;
static device_link device;
static loop_row row;

static void take(const device_reading *reading, loop_setpoint aim, uint64_t begun_us, uint64_t answered_us)
{
    row.in = (rtctl_in){
        .sensed = reading->sensed, .setpoint = aim.setpoint, .upcoming = aim.upcoming, .periods = 1,
        .status = reading->status, .counter = reading->counter, .time_us = reading->time_us,
        .begun_ns = (int64_t)begun_us * 1000, .answered_ns = (int64_t)answered_us * 1000,
    };
    row.reference = reading->reference;
    row.commanded = (float)state.level;
    rtctl_step(&state, &row.in, &row.out);
}

/* Exchange and take a sample; return a fault. */
static int32_t sample(loop_setpoint aim)
{
    device_reading reading;
    uint64_t begun_us = board_time_us();
    if (!link_exchange(&device, (float)state.level, &reading))
        return NO_ANSWER;
    take(&reading, aim, begun_us, board_time_us());
    return row.out.fault;
}

int main(void)
{
    loop_plan plan;
    loop_setpoint aim;
    device_reading first;
    uintptr_t from = file_open("plan.bin", 8, SEMIHOSTING_READ_BINARY);
    uintptr_t to = file_open("told.bin", 8, SEMIHOSTING_WRITE_BINARY);
    mps2_start();
    (void)file_read(from, &plan, sizeof plan);
    (void)file_read(from, &aim, sizeof aim);
    device.timeout_us = plan.timeout_us;
    rtctl_init(&state);
    const real_t safe = state.level;
    int32_t fault = NO_ANSWER;
    if (link_open(&device, plan.lockstep != 0, (uint16_t)plan.watchdog_ms, plan.period_us, &first)) {
        take(&first, aim, board_time_us(), board_time_us());
        fault = row.out.fault;
    }
    while (fault == 0 && state.settle_left > 0) /* at the safe level */
        fault = sample(aim);
    for (uint32_t index = 0; fault == 0 && index < plan.samples; index++) {
        fault = sample(aim);
        row.index = (int32_t)index;
        if (fault == 0)
            (void)file_write(to, &row, sizeof row);
        (void)file_read(from, &aim, sizeof aim);
    }
    link_close(&device, (float)safe);
    row.index = -1;
    row.out.fault = fault;
    (void)file_write(to, &row, sizeof row);
    leave();
    return 0;
}
