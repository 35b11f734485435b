/* A device of the plain serial protocol with one command [mA] and one reading [ohm], around the functions of a board. */
#ifndef RTCTL_DEVICE_H
#define RTCTL_DEVICE_H

#ifdef __cplusplus
extern "C" {
#endif

void device_start(void); /* once: off, current 0, watchdog asleep */
void device_turn(void);  /* for ever: end the lease where it is due, take one byte, answer where it ends a request */

#ifdef __cplusplus
}
#endif
#endif
