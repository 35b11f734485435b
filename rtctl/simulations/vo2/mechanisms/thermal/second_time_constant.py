"""`thermal.second_time_constant`: T = (1 - share) T_1 + share T_2, each with its own time constant."""

from rtctl.simulations.vo2.mechanism import (
    Balance,
    Values,
    Vo2Mechanism,
    coefficient,
    heating_times,
    shape,
)


def beside(balance: Balance, p: Values) -> Balance:
    """Add a second part of the heating."""
    return balance._replace(share=p["share"], second_time_constant_s=p["time_constant"])


MECHANISM = Vo2Mechanism(
    id="thermal.second_time_constant",
    statement="A share {share} of the heating follows a second time constant of {time_constant}.",
    parameters=(
        coefficient("share", "dimensionless", "of the second part", 0.3, low=0.0, high=1.0),
        shape(
            "time_constant", "s", "of the second part", heating_times(5.0), low=1e-6, high=1e3,
            shape_range=(0.02, 100.0),
        ),
    ),
    balance=beside,
)  # fmt: skip
