"""`actuation.deadband`: the heater's current y stays where it is until the command i is `width` away.

Then y = i - behind width sign(i - y): behind = 1 is a backlash, 0 a driver that takes the whole change at once.
Of y only what is beyond `zone` heats. Loops that were identified on the same device know the steady state with it: the
current that would hold a temperature is zone + sqrt(power).
"""

from __future__ import annotations

import numpy as np

from rtctl.kernels import FloatArray, background_kernel
from rtctl.simulations.vo2.mechanism import (
    Balance,
    Pieces,
    Values,
    Vo2Mechanism,
    Warm,
    coefficient,
    shape,
)


@background_kernel
def held_back(commands: FloatArray, width: float, behind: float) -> FloatArray:
    """y (n,) for commands (n,) [mA]; the first was reached from below."""
    y = np.empty_like(commands)
    held = commands[0] - behind * width
    for k in range(commands.size):
        away = commands[k] - held
        if away > width:
            held = commands[k] - behind * width
        elif away < -width:
            held = commands[k] + behind * width
        y[k] = held
    return y


def dead(pieces: Pieces, p: Values) -> Pieces:
    """Small changes of the current have no effect."""
    nodes = pieces.nodes
    if p["width"] > 0.0:
        nodes = held_back(nodes.reshape(-1), p["width"], p["behind"]).reshape(nodes.shape)
    return pieces._replace(nodes=np.maximum(nodes - p["zone"], 0.0))


def over_all_of_it(balance: Balance, p: Values) -> Balance:
    """What the phase does to the heat is read from the loops, which go over all of the current."""
    return balance._replace(zone=p["zone"])


def as_current(warm: Warm, p: Values) -> Warm:
    """Temperatures as the squares of the currents that would hold them."""

    def held(power: FloatArray) -> FloatArray:
        current: FloatArray = np.sqrt(np.maximum(power, 0.0)) + p["zone"]
        return current**2 + np.minimum(power, 0.0)

    if p["zone"] == 0.0:
        return warm
    power = held(warm.power)
    if warm.lagging is warm.power:
        return warm._replace(power=power, lagging=power, peaks=power)
    return warm._replace(power=power, lagging=held(warm.lagging), peaks=held(warm.peaks))


MECHANISM = Vo2Mechanism(
    id="actuation.deadband",
    statement="Changes of the current by less than {width} have no effect, nor have the first {zone} of it.",
    parameters=(
        coefficient(
            "width", "mA", "half of the dead band", lambda s: 0.1 * s.drive, default=0.0, low=0.0
        ),
        coefficient(
            "zone", "mA", "of the current, that does not heat", lambda s: 0.3 * s.drive, default=0.0, low=0.0,
        ),
        shape(
            "behind", "dimensionless", "share of the width by which the current stays behind a larger change", 1.0,
            default=1.0, low=0.0, high=1.0, shape_range=(0.0, 1.0),
        ),
    ),
    pieces=dead,
    balance=over_all_of_it,
    warm=as_current,
    stage=1,  # of all that warms the film
)  # fmt: skip
