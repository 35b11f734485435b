/* What the sketch uses of an Arduino core, as the cores declare it: the compiler checks the sketch against it. */
#pragma once
#include <math.h>
#include <stddef.h>
#include <stdint.h>

static const int A0 = 14, A1 = 15;

struct SerialPort {
    void begin(unsigned long baud);
    int read();
    int availableForWrite();
    size_t write(const uint8_t *bytes, size_t count);
};
extern SerialPort Serial;

unsigned long micros();
int analogRead(uint8_t pin);
void analogWrite(uint8_t pin, int counts);
void analogReadResolution(int bits);
void analogWriteResolution(int bits);
