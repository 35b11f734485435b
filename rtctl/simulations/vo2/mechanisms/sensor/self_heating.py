"""`sensor.self_heating`: the sensing current heats the film by heat R / R_cold, beside the heater."""

from rtctl.simulations.vo2.mechanism import (
    Balance,
    Values,
    Vo2Mechanism,
    coefficient,
    known,
    power_of,
)


def heating(balance: Balance, p: Values) -> Balance:
    """Add the heat of the sensing current, which falls as the film becomes a metal."""
    return balance._replace(self_heating=p["heat"], self_heating_known=p["known"] * p["heat"])


MECHANISM = Vo2Mechanism(
    id="sensor.self_heating",
    statement="The sensing current heats the film, by {heat} while it is cold and less as its resistance falls.",
    parameters=(
        coefficient(
            "heat", "mA^2", "of the cold film, as surrogate power", power_of, low=0.0
        ),
        known(also=(0.0,)),  # its heat follows the branch, so that loops over the current cannot hold all of it
    ),
    balance=heating,
)  # fmt: skip
