/* A device as its wire sees it: enable, sequence, limits, watchdog, lockstep (docs/serial-protocol.md).
 *
 * Free-running, device time is the board's clock; in lockstep it is the sum of the samples. The lease of a command ends
 * strictly after the watchdog time, in device time: in lockstep only inside a sample that is longer.
 * One device a program: its state is static, nothing is allocated.
 */
#include "rtctl_device.h"
#include "rtctl_board.h"
#include "rtctl_serial.h"

typedef struct { rs_reading fixed; float resistance_ohm; } reading_payload;

static struct {
    rs_reader reader;
    bool lockstep;
    bool has_sequence;  /* a command has been accepted since power-up */
    bool has_reading;   /* something has been measured since the clock was set */
    bool lease_runs;    /* false: the watchdog sleeps */
    uint16_t sequence, status;
    uint32_t counter, period_us, watchdog_us;
    uint64_t time_us;   /* device time */
    uint64_t epoch_us;  /* the board's clock at device time 0 */
    uint64_t fed_us;    /* device time of the last accepted command */
    float resistance_ohm, deflection_um;
} device;

static bool is_finite(float x)
{
    return x - x == 0.0f; /* no number is equal to NaN, and infinity less infinity is NaN */
}

static void trip(void)
{
    device.lease_runs = false;
    device.status = (uint16_t)((device.status & ~RS_CLAMPED) | RS_TRIPPED);
    board_set_current(board.safe_mA);
}

/* Free-running: bring device time up to the clock, and end the lease if that lies behind its end. */
static void live_until_now(void)
{
    if (device.lockstep)
        return;
    device.time_us = board_time_us() - device.epoch_us;
    if (device.lease_runs && device.watchdog_us && device.time_us > device.fed_us + device.watchdog_us)
        trip();
}

static void measure(void)
{
    device.counter++;
    device.has_reading = true;
    device.resistance_ohm = board_read_resistance();
    device.deflection_um = board_read_deflection();
    device.status = (uint16_t)(is_finite(device.resistance_ohm) ? device.status & ~RS_SENSOR_FAULT
                                                                : device.status | RS_SENSOR_FAULT);
}

/* One sample of lockstep, which begins with the command that has just fed the watchdog. */
static void sample(void)
{
    uint32_t left_us = device.period_us;
    if (device.watchdog_us && device.watchdog_us < left_us) {
        board_pass_time(device.watchdog_us);
        left_us -= device.watchdog_us;
        trip();
    }
    board_pass_time(left_us);
    device.time_us += device.period_us;
    measure();
}

static void command(uint16_t sequence, float asked_mA)
{
    if (device.has_sequence && sequence == device.sequence)
        return; /* a frame that arrives twice counts once */
    if ((device.status & (RS_ENABLED | RS_TRIPPED)) != RS_ENABLED) {
        device.status |= RS_REFUSED;
        return;
    }
    float level_mA = asked_mA < board.low_mA ? board.low_mA : asked_mA;
    level_mA = level_mA > board.high_mA ? board.high_mA : level_mA;
    bool clamped = level_mA < asked_mA || level_mA > asked_mA;
    device.status = (uint16_t)(RS_ENABLED | (clamped ? RS_CLAMPED : 0) | (device.status & RS_SENSOR_FAULT));
    device.sequence = sequence;
    device.has_sequence = true;
    device.fed_us = device.time_us;
    device.lease_runs = true;
    board_set_current(level_mA);
    if (device.lockstep)
        sample();
}

static void set_clock(bool lockstep, uint32_t period_us)
{
    if (lockstep != device.lockstep) {
        device.lockstep = board_set_lockstep(lockstep);
        if (device.lockstep && !device.has_sequence) {
            board_power_up(); /* a lockstep run does not depend on how long the device has waited for it */
            device.counter = 0;
            device.time_us = 0;
        }
        device.epoch_us = board_time_us() - device.time_us; /* free-running, time goes on from where it is */
        device.has_reading = false;
    }
    if (period_us)
        device.period_us = period_us;
}

static void set_enable(bool enable)
{
    if (!enable) {
        device.status &= (uint16_t)~(RS_ENABLED | RS_CLAMPED);
        device.lease_runs = false;
        board_set_current(0.0f);
    } else if (!(device.status & RS_ENABLED))
        device.status = (uint16_t)(RS_ENABLED | (device.status & RS_SENSOR_FAULT)); /* a trip is over */
}

/* Settings count as a whole; false: one of them is illegal, and nothing has been set. */
static bool set(const rs_settings *asked)
{
    if (asked->enable > 1 || asked->lockstep > 1 || (asked->lockstep && !asked->period_us))
        return false;
    device.watchdog_us = 1000u * (uint32_t)asked->watchdog_ms;
    set_clock(asked->lockstep, asked->period_us);
    set_enable(asked->enable);
    return true;
}

static size_t error(uint8_t *out, uint16_t tag, uint8_t code)
{
    return rs_frame(out, RS_ERROR, tag, &code, sizeof code);
}

static size_t identity(uint8_t *out, uint16_t tag)
{
    rs_identity own = { RS_VERSION, 1, 1, { 0 } };
    for (size_t i = 0; i < sizeof own.name && board.name[i]; i++)
        own.name[i] = board.name[i];
    return rs_frame(out, RS_IDENTIFY | RS_REPLY, tag, &own, sizeof own);
}

static size_t settings_in_force(uint8_t *out, uint16_t tag)
{
    rs_settings own = { (device.status & RS_ENABLED) != 0, device.lockstep, (uint16_t)(device.watchdog_us / 1000u),
                        device.period_us };
    return rs_frame(out, RS_SETTINGS | RS_REPLY, tag, &own, sizeof own);
}

static size_t reading(uint8_t *out, uint8_t type, uint16_t tag)
{
    if (!device.lockstep || !device.has_reading)
        measure();
    reading_payload own = { { device.sequence, device.status, device.counter, (uint32_t)device.time_us,
                              device.deflection_um }, device.resistance_ohm };
    return rs_frame(out, (uint8_t)(type | RS_REPLY), tag, &own, sizeof own);
}

/* The answer to a sound message of `count` bytes (type, tag, payload) into `out`; its length. */
static size_t answer(const uint8_t *body, size_t count, uint8_t *out)
{
    uint8_t type = body[0];
    uint16_t tag;
    memcpy(&tag, body + 1, sizeof tag);
    const uint8_t *payload = body + 3;
    count -= 3;
    if (type == RS_COMMAND) {
        float asked_mA;
        if (count != sizeof asked_mA)
            return error(out, tag, RS_WRONG_LENGTH);
        memcpy(&asked_mA, payload, sizeof asked_mA);
        if (!is_finite(asked_mA))
            return error(out, tag, RS_ILLEGAL_VALUE);
        command(tag, asked_mA);
        return reading(out, type, tag);
    }
    if (type == RS_READ)
        return reading(out, type, tag);
    if (type == RS_SETTINGS) {
        rs_settings asked;
        if (count != sizeof asked)
            return error(out, tag, RS_WRONG_LENGTH);
        memcpy(&asked, payload, sizeof asked);
        return set(&asked) ? settings_in_force(out, tag) : error(out, tag, RS_ILLEGAL_VALUE);
    }
    return type == RS_IDENTIFY ? identity(out, tag) : error(out, tag, RS_UNKNOWN_TYPE);
}

void device_start(void)
{
    device.period_us = 1000;
    device.epoch_us = board_time_us();
    board_set_current(0.0f);
}

void device_turn(void)
{
    static uint8_t body[RS_MAX_FRAME], reply[RS_MAX_FRAME];
    live_until_now(); /* before every byte: a line that babbles does not keep a lease alive */
    int byte = board_receive();
    if (byte < 0) {
        board_wait();
        return;
    }
    size_t length = rs_receive(&device.reader, (uint8_t)byte, body);
    if (length)
        board_send(reply, answer(body, length, reply));
}
