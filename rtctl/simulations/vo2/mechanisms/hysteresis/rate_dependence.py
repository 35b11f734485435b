"""`hysteresis.rate_dependence`: the switched share follows T_h, time_constant T_h' = T - T_h, the pure phases T.

Loops that were identified by temperature alone do not separate the two, so fast records determine `activation`,
`expansion` and `mixing`; with all at 0 everything lags. See `rtctl.simulations.vo2.phases`.
"""

from rtctl.simulations.vo2.mechanism import (
    PURE_PHASES,
    Balance,
    Read,
    Values,
    Vo2Mechanism,
    coefficient,
    heating_times,
)
from rtctl.simulations.vo2.phases import mixed_along, switched_along


def behind(balance: Balance, p: Values) -> Balance:
    """Make the transition lag the temperature."""
    return balance._replace(lag_s=p["time_constant"])


def at_once(read: Read, p: Values) -> Read:
    """Add the immediate changes of the pure phases."""
    film, ahead = read.phases.of(p), read.temperature - read.relays_temperature
    phi = switched_along(read.reading, read.relays_temperature, film)
    return read._replace(
        reading=mixed_along(phi, read.temperature, film), deflection=read.deflection - p["expansion"] * ahead
    )


MECHANISM = Vo2Mechanism(
    id="hysteresis.rate_dependence",
    statement="The transition lags the film's temperature with a time constant of {time_constant}.",
    parameters=(
        coefficient(
            "time_constant", "s", "of the transition behind temperature", heating_times(5.0), low=0.0, high=1e3
        ),
        *PURE_PHASES,
    ),
    balance=behind,
    film=at_once,
    stage=1,
)  # fmt: skip
