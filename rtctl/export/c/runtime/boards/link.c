/* The loop's side of the plain serial protocol, over the four functions of a board: rtctl_board.h. */
#include "link.h"

#include "rtctl_board.h"
#include "rtctl_serial.h"

enum { READING_BYTES = 20, HEAD_BYTES = 3 };

/* Send a request and wait for its answer; return the length of the answer's payload, 0 if there is none. */
static size_t ask(device_link *link, uint8_t type, const void *payload, size_t count, uint8_t *answer)
{
    static rs_reader reader;
    uint8_t frame[RS_MAX_FRAME];
    uint16_t tag = ++link->sequence;
    board_send(frame, rs_frame(frame, type, tag, payload, count));
    uint64_t end_us = board_time_us() + link->timeout_us;
    while (board_time_us() < end_us) {
        int byte = board_receive();
        if (byte < 0) {
            board_wait();
            continue;
        }
        size_t length = rs_receive(&reader, (uint8_t)byte, answer);
        uint16_t answered;
        if (length < HEAD_BYTES)
            continue;
        memcpy(&answered, answer + 1, 2);
        if (answered == tag) /* a late answer to an older request is thrown away */
            return answer[0] == (uint8_t)(type | RS_REPLY) ? length - HEAD_BYTES : 0;
    }
    return 0;
}

static bool read_answer(const uint8_t *answer, size_t length, device_reading *reading)
{
    rs_reading fixed;
    if (length != READING_BYTES)
        return false;
    memcpy(&fixed, answer + HEAD_BYTES, sizeof fixed);
    memcpy(&reading->sensed, answer + HEAD_BYTES + sizeof fixed, sizeof reading->sensed);
    reading->sequence = fixed.sequence;
    reading->status = fixed.status;
    reading->counter = fixed.counter;
    reading->time_us = fixed.time_us;
    reading->reference = fixed.reference;
    return true;
}

bool link_open(device_link *link, bool lockstep, uint16_t watchdog_ms, uint32_t period_us, device_reading *reading)
{
    uint8_t answer[RS_MAX_FRAME];
    for (uint8_t enable = 0; enable <= 1; enable++) {
        const rs_settings wanted = {enable, lockstep, watchdog_ms, period_us};
        rs_settings set;
        if (ask(link, RS_SETTINGS, &wanted, sizeof wanted, answer) != sizeof set)
            return false;
        memcpy(&set, answer + HEAD_BYTES, sizeof set);
        if (set.enable != enable || set.lockstep != wanted.lockstep || set.watchdog_ms != watchdog_ms)
            return false;
    }
    size_t length = ask(link, RS_READ, 0, 0, answer);
    if (!read_answer(answer, length, reading))
        return false;
    if (reading->sequence == (uint16_t)(link->sequence + 1))
        link->sequence++; /* the number in force would count for nothing */
    return true;
}

bool link_exchange(device_link *link, float level, device_reading *reading)
{
    uint8_t answer[RS_MAX_FRAME];
    size_t length = ask(link, RS_COMMAND, &level, sizeof level, answer);
    return read_answer(answer, length, reading) &&
           (reading->sequence == link->sequence || (reading->status & RS_REFUSED) != 0);
}

void link_close(device_link *link, float safe)
{
    uint8_t answer[RS_MAX_FRAME];
    const rs_settings off = {0, 0, 0, 0};
    (void)ask(link, RS_COMMAND, &safe, sizeof safe, answer);
    (void)ask(link, RS_SETTINGS, &off, sizeof off, answer);
}
