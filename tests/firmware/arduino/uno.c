/* An emulated Arduino UNO: its serial port is standard input and output, its input A1 has a constant voltage, and an
 * MCP4725 at address 0x60 of its I2C writes each value that it is set to on a line of standard error.
 *
 *   uno SKETCH.elf MILLIVOLTS [without-converter]
 */
#include <poll.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_twi.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

enum { CONVERTER_ADDRESS = 0x60 };
enum { CLOCK_HZ = 16000000, SUPPLY_MV = 5000, BEFORE_SERIAL = 400000, BETWEEN_BYTES = 2000 }; /* instructions */

static int takes_bytes = 1;

static void sent(avr_irq_t *irq, uint32_t value, void *unused)
{
    uint8_t byte = (uint8_t)value;
    (void)irq, (void)unused;
    if (write(1, &byte, 1) != 1)
        exit(1);
}

static void room(avr_irq_t *irq, uint32_t value, void *takes)
{
    (void)irq, (void)value;
    takes_bytes = takes != NULL;
}

/* Fast mode of the data sheet: two bytes, the upper four bits of the first one are zero. */
static void converter(avr_irq_t *irq, uint32_t value, void *to_master)
{
    static int is_selected, bytes, counts;
    avr_twi_msg_irq_t message = { .u.v = value };
    (void)irq;
    if (message.u.twi.msg & TWI_COND_STOP) {
        if (is_selected && bytes == 2)
            fprintf(stderr, "%d\n", counts);
        is_selected = 0;
    }
    if (message.u.twi.msg & TWI_COND_START) {
        is_selected = message.u.twi.addr >> 1 == CONVERTER_ADDRESS;
        bytes = counts = 0;
    }
    if (is_selected && message.u.twi.msg & TWI_COND_WRITE && !(message.u.twi.msg & TWI_COND_ADDR)) {
        counts = counts << 8 | message.u.twi.data;
        bytes++;
    }
    if (is_selected && message.u.twi.msg & (TWI_COND_ADDR | TWI_COND_START | TWI_COND_WRITE))
        avr_raise_irq(to_master, avr_twi_irq_msg(TWI_COND_ACK, message.u.twi.addr, 1));
}

int main(int argc, char **argv)
{
    elf_firmware_t sketch = { .frequency = CLOCK_HZ };
    if (argc < 3 || elf_read_firmware(argv[1], &sketch))
        return 2;
    avr_t *avr = avr_make_mcu_by_name("atmega328p");
    avr_init(avr);
    sketch.frequency = CLOCK_HZ;
    avr_load_firmware(avr, &sketch);
    avr->vcc = avr->avcc = avr->aref = SUPPLY_MV;
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(uint32_t)AVR_UART_FLAG_STDIO;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), sent, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON), room, avr);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF), room, NULL);
    avr_irq_t *received = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    if (argc == 3)
        avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_OUTPUT), converter,
                                avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_INPUT));
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC1), (uint32_t)atoi(argv[2]));
    for (unsigned long n = 0;; n++) {
        int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed)
            return 1;
        struct pollfd line = { .fd = 0, .events = POLLIN };
        uint8_t byte;
        if (n < BEFORE_SERIAL || n % BETWEEN_BYTES || !takes_bytes || poll(&line, 1, 0) <= 0)
            continue;
        if (read(0, &byte, 1) <= 0)
            return 0;
        avr_raise_irq(received, byte);
    }
}
