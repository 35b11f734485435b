"""`unnamed.heat_balance`: a time constant that depends on direction and phase in any way, to second order.

tau (1 + cooling where T falls) (1 + heat g + sharpness g^2) T' = P - T with g = dphi/dT: whatever changes with the
film's state how fast it follows, and not where it comes to rest, which the identified loops hold.
"""

from rtctl.simulations.vo2.mechanism import (
    TYPICAL_POWER_MA2,
    Balance,
    Values,
    Vo2Mechanism,
    coefficient,
)


def slowed(balance: Balance, p: Values) -> Balance:
    """Slower while the phase changes, and while it cools."""
    return balance._replace(latent=balance.latent + p["heat"], sharpness=p["sharpness"], cooling=p["cooling"])


MECHANISM = Vo2Mechanism(
    id="unnamed.heat_balance",
    statement="The time constant depends on direction ({cooling}) and on the change of phase ({heat}, {sharpness}).",
    parameters=(
        coefficient("heat", "mA^2", "held by the phase", TYPICAL_POWER_MA2, low=0.0, high=1e3),
        coefficient("cooling", "dimensionless", "longer than heating", 1.0, low=-0.5, high=20.0),
        coefficient("sharpness", "mA^4", "of the capacity", TYPICAL_POWER_MA2**2, low=-1e5, high=1e5),
    ),
    balance=slowed,
)
