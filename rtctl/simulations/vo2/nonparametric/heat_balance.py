"""`nonparametric.heat_balance`: a time constant that depends on direction and phase in any way, to second order.

tau (1 + cooling where T falls) (1 + heat g + film f + sharpness g^2) T' = P - T with g = dphi/dT of the phase that the
deflection shows and f of the one that the resistance shows: whatever changes with the film's state how fast it follows,
and not where it comes to rest, which the identified loops hold.
"""

from rtctl.simulations.vo2.mechanism import (
    Balance,
    Values,
    Vo2Mechanism,
    coefficient,
    power_of,
)


def slowed(balance: Balance, p: Values) -> Balance:
    """Slow down the temperature while the phase changes, and while it cools."""
    return balance._replace(
        latent=balance.latent + p["heat"], film_heat=p["film"], sharpness=p["sharpness"], cooling=p["cooling"]
    )


MECHANISM = Vo2Mechanism(
    id="nonparametric.heat_balance",
    statement="The time constant depends on direction ({cooling}) and on the change of phase ({heat}, {film}, "
    "{sharpness}).",
    parameters=(
        coefficient("heat", "mA^2", "held by the phase of the deflection", power_of),
        coefficient("film", "mA^2", "held by the phase of the resistance", power_of),
        coefficient("cooling", "dimensionless", "longer than heating", 1.0, low=-0.5, high=20.0),
        coefficient("sharpness", "mA^4", "of the capacity", lambda s: power_of(s) ** 2),
    ),
    balance=slowed,
)
