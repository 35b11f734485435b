#pragma once
#include <stddef.h>
#include <stdint.h>

struct TwoWire {
    void begin();
    void setClock(uint32_t hertz);
    void beginTransmission(uint8_t address);
    size_t write(uint8_t byte);
    uint8_t endTransmission();
    void setWireTimeout(uint32_t timeout_us, bool reset);
};
extern TwoWire Wire;
