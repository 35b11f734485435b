/* Heater and sensors of a board without a film: the simulated one, which lives on the board's clock or in lockstep. */
#include "film.h"
#include "rtctl_board.h"

static struct {
    bool lockstep, is_on; /* is_on: the film has been reset since power-up */
    float current_mA;
    uint64_t lived_us;    /* the board's clock up to which the film has lived */
} heater;

static void live_until_now(void)
{
    if (!heater.is_on)
        board_power_up();
    if (heater.lockstep)
        return;
    uint64_t now_us = board_time_us(), past_us = now_us - heater.lived_us;
    film_hold(heater.current_mA, past_us > UINT32_MAX ? UINT32_MAX : (uint32_t)past_us);
    heater.lived_us = now_us;
}

void board_power_up(void)
{
    heater.is_on = true;
    heater.lived_us = board_time_us();
    film_reset();
}

void board_set_current(float current_mA)
{
    live_until_now();
    heater.current_mA = current_mA;
}

float board_read_resistance(void)
{
    live_until_now();
    return film_read_resistance();
}

float board_read_deflection(void)
{
    live_until_now();
    return film_read_deflection();
}

bool board_set_lockstep(bool on)
{
    live_until_now();
    heater.lockstep = on;
    heater.lived_us = board_time_us();
    return on;
}

void board_pass_time(uint32_t duration_us)
{
    film_hold(heater.current_mA, duration_us);
}
