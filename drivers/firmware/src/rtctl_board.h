/* What a board provides to the device: a serial line, a clock, a heater and its sensors. One board, one file of these.
 *
 * Units are those of the wire: mA, ohm, um. A board is never asked for a current outside of its nameplate.
 */
#ifndef RTCTL_BOARD_H
#define RTCTL_BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    char name[17];           /* identity on the wire: ASCII, at most 16 characters */
    float low_mA, high_mA;   /* limits of the heater current; a command beyond is clamped */
    float safe_mA;           /* current after the watchdog has tripped */
} board_nameplate;

extern const board_nameplate board;

/* ---- serial line and clock ---- */

int board_receive(void);                                /* the next byte that has arrived; -1: none */
void board_send(const uint8_t *bytes, size_t count);    /* drops them where the line takes none: a host that does not
                                                           read must not keep the device from ending a lease */
void board_wait(void);                                  /* sleep until a byte arrives, at most about 1 ms */
uint64_t board_time_us(void);                           /* since any moment; never goes back, never wraps */

/* ---- heater and sensors ---- */

void board_set_current(float current_mA);               /* heater current from this moment on */
float board_read_resistance(void);                      /* [ohm]; NaN: the sensor has failed */
float board_read_deflection(void);                      /* external instrument [um]; NaN: there is none */

/* ---- lockstep: time that passes only when the host says so; a real film has none ---- */

bool board_set_lockstep(bool on);                       /* returns what is in force: false on a real film */
void board_pass_time(uint32_t duration_us);             /* in lockstep: hold the current for so long */
void board_power_up(void);                              /* in lockstep: the film is cold, as at power-up */

#ifdef __cplusplus
}
#endif
#endif
