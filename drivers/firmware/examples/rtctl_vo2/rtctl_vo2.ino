/* A VO2 film behind the USB serial port of an Arduino or a Teensy: what this board does for the device.
 *
 * Circuit (docs/firmware.md): a converter's voltage sets the heater current through an operational amplifier, and the
 * film's resistance is the lower half of a voltage divider. Change the constants to those of your circuit.
 * Time is that of the film: there is no lockstep (clock.mode = "live" in the scenario).
 */
#include <rtctl_board.h>
#include <rtctl_device.h>

/* ---- your film: identity on the wire, limits of the heater current, current after the watchdog has tripped ---- */
const board_nameplate board = { "MY FILM", /* low_mA */ 0.0f, /* high_mA */ 8.5f, /* safe_mA */ 0.0f };

/* ---- your circuit ---- */
static const float FULL_SCALE_MA = 10.0f;     /* heater current at the converter's full scale: voltage / R_SET */
static const float DIVIDER_OHM = 47e3f;       /* upper half of the divider, to the reference of the analog input */
static const int SENSE_PIN = A1;
static const int READINGS = 8;                /* means of so many; each takes some microseconds */
static const int DAC_BITS = 12;
#ifdef __AVR__
static const int ADC_BITS = 10;               /* UNO, Nano, Mega: their analog inputs have no other resolution */
#else
static const int ADC_BITS = 12;
#endif

/* Remove the slashes if the board has a converter of its own, and name its pin: UNO R4, Zero, MKR: A0; Teensy 3.2: A14,
 * Teensy 3.5 and 3.6: A21. Else an MCP4725 on I2C is used; so on a Due, whose converter does not reach 0 V. */
// #define HEATER_PIN A0

#ifndef HEATER_PIN
#include <Wire.h>
static const uint8_t MCP4725_ADDRESS = 0x60;
#endif

static bool converter_answers = true;

static void set_converter(uint16_t counts)
{
#ifdef HEATER_PIN
    analogWrite(HEATER_PIN, counts);
#else
    Wire.beginTransmission(MCP4725_ADDRESS); /* data sheet, figure 6-1: fast mode, two bytes */
    Wire.write((uint8_t)(counts >> 8));
    Wire.write((uint8_t)(counts & 0xFF));
    converter_answers = Wire.endTransmission() == 0;
#endif
}

/* ---- serial line and clock ---- */

int board_receive(void)
{
    return Serial.read();
}

void board_send(const uint8_t *bytes, size_t count)
{
    static bool reports_room; /* some cores always say 0, those of lines that go on without a reader */
    int room = Serial.availableForWrite();
    reports_room = reports_room || room > 0;
    if (!reports_room || room >= (int)count) /* else nobody reads: the lease must end all the same */
        Serial.write(bytes, count);
}

void board_wait(void)
{
}

uint64_t board_time_us(void)
{
    static uint64_t time_us;
    static uint32_t last;
    uint32_t now = micros(); /* wraps every 71 minutes; asked in every turn of loop() */
    time_us += (uint32_t)(now - last);
    last = now;
    return time_us;
}

/* ---- heater and sensors ---- */

void board_set_current(float current_mA)
{
    const float full = (float)((1UL << DAC_BITS) - 1);
    set_converter((uint16_t)(full * current_mA / FULL_SCALE_MA + 0.5f));
}

float board_read_resistance(void)
{
    const float full = (float)(1UL << ADC_BITS);
    float counts = 0.0f;
    for (int k = 0; k < READINGS; k++)
        counts += (float)analogRead(SENSE_PIN);
    counts /= (float)READINGS;
    if (!converter_answers || counts < 1.0f || counts > full - 2.0f)
        return NAN; /* nobody knows which current flows; a short circuit; a broken wire */
    return DIVIDER_OHM * counts / (full - counts);
}

float board_read_deflection(void)
{
    return NAN; /* an external instrument of your own, such as a laser sensor at an analog input [um] */
}

/* ---- no lockstep ---- */

bool board_set_lockstep(bool on)
{
    (void)on;
    return false;
}

void board_pass_time(uint32_t duration_us)
{
    (void)duration_us;
}

void board_power_up(void)
{
}

void setup(void)
{
#ifdef HEATER_PIN
    analogWriteResolution(DAC_BITS);
#else
    Wire.begin();
    Wire.setClock(400000);
#ifdef WIRE_HAS_TIMEOUT
    Wire.setWireTimeout(5000, true); /* us; else a disturbed line may stop the program */
#endif
#endif
#ifndef __AVR__
    analogReadResolution(ADC_BITS);
#endif
    Serial.begin(115200);
    device_start();
}

void loop(void)
{
    device_turn();
}
