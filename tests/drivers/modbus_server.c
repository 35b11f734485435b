/* A device of libmodbus's own making: modbus_server (rtu PATH | tcp PORT). Registers 0-7 are kept, 100-109 follow. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <modbus.h>

int main(int argc, char **argv)
{
    if (argc != 3)
        return 2;
    int is_tcp = !strcmp(argv[1], "tcp"), listener = -1;
    modbus_t *line = is_tcp ? modbus_new_tcp("127.0.0.1", atoi(argv[2])) : modbus_new_rtu(argv[2], 115200, 'N', 8, 1);
    modbus_mapping_t *map = modbus_mapping_new(0, 0, 128, 0);
    modbus_set_slave(line, 1);
    if (is_tcp) {
        listener = modbus_tcp_listen(line, 1);
        modbus_tcp_accept(line, &listener);
    } else if (modbus_connect(line)) {
        fprintf(stderr, "%s\n", modbus_strerror(errno));
        return 1;
    }
    printf("ready\n");
    fflush(stdout);
    uint8_t request[MODBUS_MAX_ADU_LENGTH];
    int at = modbus_get_header_length(line); /* of the function code */
    for (;;) {
        int length = modbus_receive(line, request);
        if (length < 0)
            return 0;
        if (length == 0)
            continue;
        uint16_t *registers = map->tab_registers;
        uint16_t sequence = registers[2];
        if (request[at] == 23) /* writes registers 0-2 before it reads: the number in force is the one on its way */
            sequence = (uint16_t)(request[at + 14] << 8 | request[at + 15]);
        registers[100] = 0x4640; /* 12345.5, high word first; modbus_set_float_abcd swaps bytes in libmodbus 3.1.6 */
        registers[101] = 0xE600;
        registers[103]++;
        registers[104] = 1;
        registers[109] = sequence;
        memcpy(registers + 120, "IL", 2);
        modbus_reply(line, request, length, map);
    }
}
