/* Plain serial protocol of rtctl, for a device: frames, checksum, messages. C99, no library but string.h.
 *
 *   frame  = 00  COBS( type u8 | tag u16 | payload | CRC-16 u16 )  00       little-endian, float = IEEE 754 float32
 *   CRC-16 = CCITT: polynomial 0x1021, start 0xFFFF, over type, tag and payload
 *
 * Feed every byte that arrives to rs_receive; it returns a length when a sound frame is complete. Answer with rs_frame.
 * Assumes a little-endian processor (ARM, AVR, RISC-V, x86): payloads are copied with memcpy.
 */
#ifndef RTCTL_SERIAL_H
#define RTCTL_SERIAL_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum { RS_VERSION = 1, RS_MAX_BODY = 248, RS_MAX_FRAME = RS_MAX_BODY + 5 };
enum { RS_COMMAND = 0x01, RS_READ = 0x02, RS_SETTINGS = 0x03, RS_IDENTIFY = 0x04, RS_REPLY = 0x80, RS_ERROR = 0xFF };
enum { RS_UNKNOWN_TYPE = 1, RS_WRONG_LENGTH = 2, RS_ILLEGAL_VALUE = 3 };
enum { RS_ENABLED = 1, RS_TRIPPED = 2, RS_CLAMPED = 4, RS_SENSOR_FAULT = 8, RS_REFUSED = 16 };

typedef struct { uint8_t data[RS_MAX_FRAME]; size_t count; } rs_reader; /* start with all zero */
typedef struct { uint8_t enable, lockstep; uint16_t watchdog_ms; uint32_t period_us; } rs_settings;
typedef struct { uint8_t version, commands, sensed; char name[16]; } rs_identity; /* name: ASCII, zero-padded */
typedef struct { uint16_t sequence, status; uint32_t counter, time_us; float reference; } rs_reading; /* sensed follow */
typedef char rs_payloads_have_no_padding
    [sizeof(rs_settings) == 8 && sizeof(rs_identity) == 19 && sizeof(rs_reading) == 16 ? 1 : -1];

static inline uint16_t rs_crc(const uint8_t *data, size_t count)
{
    uint16_t crc = 0xFFFF;
    while (count--) {
        crc ^= (uint16_t)((uint16_t)*data++ << 8); /* an int of AVR has 16 bits */
        for (int bit = 0; bit < 8; bit++)
            crc = (uint16_t)(crc & 0x8000 ? crc << 1 ^ 0x1021 : crc << 1);
    }
    return crc;
}

/* One frame from type, tag and payload into out (RS_MAX_FRAME bytes); its length, 0 where the payload is too long. */
static inline size_t rs_frame(uint8_t *out, uint8_t type, uint16_t tag, const void *payload, size_t count)
{
    uint8_t body[RS_MAX_BODY + 2];
    if (count + 3 > RS_MAX_BODY)
        return 0;
    body[0] = type;
    memcpy(body + 1, &tag, 2);
    if (count)
        memcpy(body + 3, payload, count);
    uint16_t crc = rs_crc(body, count + 3);
    memcpy(body + 3 + count, &crc, 2);
    size_t length = 1, code = 1; /* code: where the count of the run under way goes */
    uint8_t run = 1;
    out[0] = 0;
    length++;
    for (size_t i = 0; i < count + 5; i++) {
        if (body[i]) {
            out[length++] = body[i];
            run++;
        } else {
            out[code] = run;
            code = length++;
            run = 1;
        }
    }
    out[code] = run;
    out[length++] = 0;
    return length;
}

/* One byte that has arrived. Returns the payload's length + 3 when it completes a sound frame, then body holds
 * type, tag and payload; else 0. body: RS_MAX_FRAME bytes. */
static inline size_t rs_receive(rs_reader *reader, uint8_t byte, uint8_t *body)
{
    if (byte) {
        if (reader->count < sizeof reader->data)
            reader->data[reader->count++] = byte;
        else
            reader->data[0] = 0xFF; /* too long for a frame: it will fail its check */
        return 0;
    }
    size_t end = reader->count, at = 0, length = 0;
    reader->count = 0;
    while (at < end) {
        size_t after = at + reader->data[at];
        if (after > end)
            return 0;
        if (at)
            body[length++] = 0;
        memcpy(body + length, reader->data + at + 1, after - at - 1);
        length += after - at - 1;
        at = after;
    }
    uint16_t crc;
    if (length < 5)
        return 0;
    memcpy(&crc, body + length - 2, 2);
    return crc == rs_crc(body, length - 2) ? length - 2 : 0;
}

#endif
