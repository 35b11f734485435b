/* A device at the other end of a serial line, seen from the loop: docs/serial-protocol.md. */
#ifndef LINK_H
#define LINK_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint16_t sequence; /* of the last request; never used twice */
    uint32_t timeout_us; /* for one answer */
} device_link;

typedef struct {
    uint16_t sequence, status; /* the command in force; docs/registers.md, register 104 */
    uint32_t counter, time_us;
    float reference, sensed; /* of an external instrument, NaN where there is none; the reading */
} device_reading;

/* Disarm, set clock and watchdog, arm, read. False: the device does not answer, or refuses. */
bool link_open(device_link *link, bool lockstep, uint16_t watchdog_ms, uint32_t period_us, device_reading *reading);

/* Command a level and read. False: no answer in time, or another command is in force. */
bool link_exchange(device_link *link, float level, device_reading *reading);

/* Command the safe level and disarm, as far as the line carries it. */
void link_close(device_link *link, float safe);

#endif
