/* One exchange with a served device in C, as the yardstick of the drivers: wire_peer (rtu PATH | tcp HOST PORT | serial PATH) COUNT
 * prints the round trip of each exchange [ns]. Modbus through libmodbus (with -DWITH_LIBMODBUS -lmodbus), the serial
 * protocol through the header that devices use. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>
#include "../drivers/firmware/src/rtctl_serial.h"
#ifdef WITH_LIBMODBUS
#include <modbus.h>
#endif

static long long now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000000LL + now.tv_nsec;
}

static int failed(const char *what)
{
    fprintf(stderr, "%s: %s\n", what, strerror(errno));
    return 1;
}

#ifdef WITH_LIBMODBUS
static int over_modbus(modbus_t *line, int count)
{
    uint16_t reading[10], command[3] = { 0, 0, 0 };
    if (!line || modbus_set_slave(line, 1) || modbus_connect(line))
        return failed("connect");
    modbus_set_response_timeout(line, 1, 0);
    command[0] = 0x40A0; /* 5 mA, high word first; modbus_set_float_abcd swaps bytes in libmodbus 3.1.6 */
    uint16_t lockstep[3] = { 1, 0, 1000 };
    if (modbus_write_registers(line, 5, 3, lockstep) < 0 || modbus_write_register(line, 3, 1) < 0
        || modbus_read_registers(line, 100, 10, reading) < 0)
        return failed("set up");
    command[2] = reading[9];
    for (int i = 0; i < count; i++) {
        long long begun = now_ns();
        command[2]++;
        if (modbus_write_and_read_registers(line, 0, 3, command, 100, 10, reading) != 10)
            return failed("exchange");
        printf("%lld\n", now_ns() - begun);
    }
    modbus_write_register(line, 3, 0);
    modbus_close(line);
    return 0;
}
#endif

static int exchange(int port, uint8_t type, uint16_t tag, const void *payload, size_t count)
{
    uint8_t out[RS_MAX_FRAME], body[RS_MAX_FRAME], arrived[256];
    rs_reader reader = { .count = 0 };
    size_t length = rs_frame(out, type, tag, payload, count);
    if (write(port, out, length) != (ssize_t)length)
        return -1;
    for (;;) {
        struct pollfd waiting = { port, POLLIN, 0 };
        if (poll(&waiting, 1, 1000) != 1)
            return -1;
        ssize_t got = read(port, arrived, sizeof arrived);
        for (ssize_t i = 0; i < got; i++) {
            uint16_t found;
            if (rs_receive(&reader, arrived[i], body)) {
                memcpy(&found, body + 1, 2);
                if (found == tag && body[0] == (type | RS_REPLY))
                    return 0;
            }
        }
    }
}

static int over_serial(const char *path, int count)
{
    struct termios raw;
    int port = open(path, O_RDWR | O_NOCTTY);
    if (port < 0 || tcgetattr(port, &raw))
        return failed(path);
    cfmakeraw(&raw);
    tcsetattr(port, TCSANOW, &raw);
    struct __attribute__((packed)) { uint8_t enable, lockstep; uint16_t watchdog; uint32_t period; } on = { 1, 1, 0, 1000 };
    float level = 5.0f;
    uint16_t tag = (uint16_t)getpid();
    if (exchange(port, RS_SETTINGS, tag++, &on, sizeof on))
        return failed("set up");
    for (int i = 0; i < count; i++) {
        long long begun = now_ns();
        if (exchange(port, RS_COMMAND, tag++, &level, sizeof level))
            return failed("exchange");
        printf("%lld\n", now_ns() - begun);
    }
    on.enable = 0;
    exchange(port, RS_SETTINGS, tag, &on, sizeof on);
    close(port);
    return 0;
}

int main(int argc, char **argv)
{
    if (argc == 4 && !strcmp(argv[1], "serial"))
        return over_serial(argv[2], atoi(argv[3]));
#ifdef WITH_LIBMODBUS
    if (argc == 4 && !strcmp(argv[1], "rtu"))
        return over_modbus(modbus_new_rtu(argv[2], 115200, 'N', 8, 1), atoi(argv[3]));
    if (argc == 5 && !strcmp(argv[1], "tcp"))
        return over_modbus(modbus_new_tcp(argv[2], atoi(argv[3])), atoi(argv[4]));
#endif
    fprintf(stderr, "usage: %s (rtu PATH | tcp HOST PORT | serial PATH) COUNT\n", argv[0]);
    return 2;
}
