"""`thermal.nonlinear_loss`: the heat that flows off is T (1 + loss T), T the temperature in mA^2 of a linear loss.

With all of its steady effect known to the loops it makes hot films faster: tau falls by 1 + 2 loss T.
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
    """Make the thermal conductance grow with temperature."""
    return balance._replace(loss=p["loss"], loss_known=p["known"] * p["loss"])


STRONG = 40.0
"""A conductance that grows by a factor of 1 + a has a loss of a (1 + a) / P at a power P: a = 14 is at 200 scales."""

MECHANISM = Vo2Mechanism(
    id="thermal.nonlinear_loss",
    statement="The thermal conductance grows with temperature, by {loss} (radiation, air).",
    parameters=(
        coefficient(
            "loss", "1/mA^2", "relative growth with the surrogate's power", lambda s: 1.0 / power_of(s), low=0.0,
            reach=STRONG,
        ),
        known(),
    ),
    balance=growing,
)  # fmt: skip
