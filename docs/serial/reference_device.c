/* Reference device of the plain serial protocol: a heater with one command [mA] and one reading [ohm].
 *
 *   gcc -O2 -Wall -Wextra -o reference_device reference_device.c -lm
 *   ./reference_device LINK        makes a pty, links LINK to it and answers there until it is ended
 *   ./reference_device -           answers on standard input and output (a test, or a real port: </dev/ttyX >/dev/ttyX)
 *
 * What is below "device" is what a microcontroller needs; what is below "port" is this computer's.
 */
#define _GNU_SOURCE
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>
#include <fcntl.h>
#include <termios.h>
#include "rtctl_serial.h"

/* ---- device: time constant 1.8 ms, 9 mA limit, 3.68 mA safe current, watchdog in its own clock ---- */
static const float LIMIT_MA = 9.0f, SAFE_MA = 3.68f;
static struct { uint8_t enable, lockstep; uint16_t watchdog_ms; uint32_t period_us; } settings;
static struct __attribute__((packed)) {
    uint16_t sequence, status; uint32_t counter, time_us; float reference_um, resistance_ohm;
} reading;
static float level_mA, heat; /* heat: the current's square through the time constant [mA^2] */
static int has_sequence;
static uint64_t time_us, fed_us, epoch_us; /* fed_us 0: the watchdog sleeps */
uint64_t clock_us(void);

static void live_until(uint64_t until_us)
{
    uint64_t due_us = fed_us + 1000u * settings.watchdog_ms;
    if (fed_us && settings.watchdog_ms && until_us > due_us) { /* the lease has ended on the way */
        fed_us = 0;
        live_until(due_us);
        level_mA = SAFE_MA;
        reading.status |= RS_TRIPPED;
    }
    if (until_us > time_us)
        heat += (level_mA * level_mA - heat) * -expm1f(-1e-6f * (float)(until_us - time_us) / 1.8e-3f);
    time_us = until_us > time_us ? until_us : time_us;
}

static void measure(void)
{
    reading.counter++;
    reading.time_us = (uint32_t)time_us;
    reading.resistance_ohm = 200e3f * expf(-heat / 20.0f) + 500.0f;
    reading.reference_um = heat;
}

static void command(uint16_t sequence, float asked_mA)
{
    if (has_sequence && sequence == reading.sequence)
        return; /* a frame that arrives twice counts once */
    if ((reading.status & (RS_ENABLED | RS_TRIPPED)) != RS_ENABLED) {
        reading.status |= RS_REFUSED;
        return;
    }
    level_mA = fminf(fmaxf(asked_mA, 0.0f), LIMIT_MA);
    reading.status = RS_ENABLED | (level_mA != asked_mA ? RS_CLAMPED : 0);
    reading.sequence = sequence;
    has_sequence = 1;
    fed_us = time_us ? time_us : 1;
    if (settings.lockstep) {
        live_until(time_us + settings.period_us);
        measure();
    }
}

static void set(const uint8_t *payload)
{
    memcpy(&settings, payload, sizeof settings);
    if (settings.lockstep && !has_sequence)
        time_us = reading.counter = 0; /* a lockstep run does not depend on how long it has been waited for */
    epoch_us = clock_us() - time_us; /* free-running, time goes on from where it is */
    if (!settings.enable) {
        reading.status &= (uint16_t)~(RS_ENABLED | RS_CLAMPED);
        level_mA = 0.0f;
        fed_us = 0;
    } else if (!(reading.status & RS_ENABLED))
        reading.status = RS_ENABLED;
}

/* The answer to one sound message of count bytes into out; its length. */
static size_t answer(const uint8_t *body, size_t count, uint8_t *out)
{
    uint8_t type = body[0], error = 0, identity[19] = { RS_VERSION, 1, 1, 'R', 'E', 'F', 'E', 'R', 'E', 'N', 'C', 'E' };
    uint16_t tag;
    float asked_mA;
    memcpy(&tag, body + 1, 2);
    if (!settings.lockstep)
        live_until(clock_us() - epoch_us);
    if (type == RS_IDENTIFY)
        return rs_frame(out, type | RS_REPLY, tag, identity, sizeof identity);
    if (type == RS_SETTINGS && count == 3 + sizeof settings && body[3] <= 1 && body[4] <= 1) {
        set(body + 3);
        return rs_frame(out, type | RS_REPLY, tag, &settings, sizeof settings);
    }
    if (type == RS_COMMAND && count == 3 + sizeof asked_mA) {
        memcpy(&asked_mA, body + 3, sizeof asked_mA);
        if (isfinite(asked_mA))
            command(tag, asked_mA);
        else
            error = RS_ILLEGAL_VALUE;
    } else if (type == RS_SETTINGS && count == 3 + sizeof settings)
        error = RS_ILLEGAL_VALUE;
    else if (type != RS_READ)
        error = type == RS_COMMAND || type == RS_SETTINGS ? RS_WRONG_LENGTH : RS_UNKNOWN_TYPE;
    if (error)
        return rs_frame(out, RS_ERROR, tag, &error, 1);
    if (!settings.lockstep || !reading.counter)
        measure();
    return rs_frame(out, type | RS_REPLY, tag, &reading, sizeof reading);
}

/* ---- port ---- */
uint64_t clock_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

int main(int argc, char **argv)
{
    int in = 0, out = 1;
    if (argc != 2)
        return fprintf(stderr, "usage: %s LINK|-\n", argv[0]), 2;
    if (strcmp(argv[1], "-")) {
        struct termios raw;
        in = out = posix_openpt(O_RDWR | O_NOCTTY);
        if (in < 0 || grantpt(in) || unlockpt(in) || symlink(ptsname(in), argv[1]))
            return perror(argv[1]), 1;
        int slave = open(ptsname(in), O_RDWR | O_NOCTTY); /* stays open, else the master reports an error */
        tcgetattr(slave, &raw);
        cfmakeraw(&raw);
        tcsetattr(slave, TCSANOW, &raw);
    }
    printf("%s", in ? "ready\n" : "");
    fflush(stdout);
    epoch_us = clock_us();
    rs_reader reader = { .count = 0 };
    uint8_t arrived[256], body[RS_MAX_FRAME], reply[RS_MAX_FRAME];
    for (ssize_t count; (count = read(in, arrived, sizeof arrived)) > 0;)
        for (ssize_t i = 0; i < count; i++) {
            size_t length = rs_receive(&reader, arrived[i], body);
            if (length && write(out, reply, answer(body, length, reply)) < 0)
                return 1;
        }
    return 0;
}
