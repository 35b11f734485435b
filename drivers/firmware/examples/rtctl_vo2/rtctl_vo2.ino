/* A VO2 film behind the USB serial port of an Arduino or a Teensy: what this board does for the device.
 *
 * Circuit (docs/firmware.md): a converter's voltage sets the heater current through an operational amplifier, and the
 * film's resistance is the lower half of a voltage divider. Change the constants to those of your circuit.
 * Boards with a converter of their own (UNO R4, Zero, MKR, Due, Teensy 3) use it, all others an MCP4725 on I2C.
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
static const int DAC_BITS = 12, ADC_BITS = 12;

#if defined(DAC0)
static const int HEATER_PIN = DAC0;
#elif defined(DAC)
static const int HEATER_PIN = DAC;
#elif defined(__MK20DX256__) /* Teensy 3.2 */
static const int HEATER_PIN = A14;
#elif defined(__MK64FX512__) || defined(__MK66FX1M0__) /* Teensy 3.5, 3.6 */
static const int HEATER_PIN = A21;
#else
#define HEATER_MCP4725
#include <Wire.h>
static const uint8_t MCP4725_ADDRESS = 0x60;
#endif

static void set_converter(uint16_t counts)
{
#if defined(HEATER_MCP4725)
    Wire.beginTransmission(MCP4725_ADDRESS); /* data sheet, figure 6-1: fast mode, two bytes */
    Wire.write((uint8_t)(counts >> 8));
    Wire.write((uint8_t)(counts & 0xFF));
    Wire.endTransmission();
#else
    analogWrite(HEATER_PIN, counts);
#endif
}

/* ---- serial line and clock ---- */

int board_receive(void)
{
    return Serial.read();
}

void board_send(const uint8_t *bytes, size_t count)
{
    if (Serial.availableForWrite() >= (int)count) /* else nobody reads: the lease must end all the same */
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
    if (counts < 1.0f || counts > full - 2.0f)
        return NAN; /* a short circuit or a broken wire */
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
#if defined(HEATER_MCP4725)
    Wire.begin();
    Wire.setClock(400000);
#else
    analogWriteResolution(DAC_BITS);
#endif
#if !defined(__AVR__)
    analogReadResolution(ADC_BITS);
#endif
    Serial.begin(115200);
    device_start();
}

void loop(void)
{
    device_turn();
}
