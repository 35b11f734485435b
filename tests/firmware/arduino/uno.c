/* An emulated Arduino UNO: its serial port is standard input and output, its input A1 has a constant voltage.
 *
 *   uno SKETCH.elf MILLIVOLTS
 */
#include <poll.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <stdlib.h>
#include <unistd.h>

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

int main(int argc, char **argv)
{
    elf_firmware_t sketch = { .frequency = CLOCK_HZ };
    if (argc != 3 || elf_read_firmware(argv[1], &sketch))
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
