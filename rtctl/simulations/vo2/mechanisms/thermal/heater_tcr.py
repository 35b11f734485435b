"""`heater.tcr`: the power is i^2 (1 + tcr T), T the temperature above ambient in mA^2 of a constant heater.

With all of its steady effect known to the loops it makes hot films slower: tau grows by 1 + tcr T.
"""

from rtctl.simulations.vo2.mechanism import (
    Balance,
    Values,
    Vo2Mechanism,
    coefficient,
    known,
    power_of,
)


def growing(balance: Balance, p: Values) -> Balance:
    """Make the heater's resistance grow with temperature."""
    return balance._replace(tcr=p["tcr"], tcr_known=p["known"] * p["tcr"])


MECHANISM = Vo2Mechanism(
    id="heater.tcr",
    statement="The heater's resistance grows with temperature, by {tcr}: hot, the same current heats more.",
    parameters=(
        coefficient(
            "tcr", "1/mA^2", "relative growth with the surrogate's power", lambda s: 0.3 / power_of(s), low=0.0
        ),
        known(),
    ),
    balance=growing,
)  # fmt: skip
