"""`actuation.deadband`: the heater's current stays behind the command i, in one of three ways.

- `width`: a backlash. y stays until i is `width` away, then y = i - behind width sign(i - y).
- `held`: a driver that ignores small changes. y stays until i is `hold` away, then y = i; `held` = 1 is all of it.
- `zone`: of y only what is beyond `zone` heats.

Loops that were identified on the same device know the steady state with it: the current that would hold a temperature
is zone + sqrt(power), and `behind width` more where it rises, less where it falls, since a relay behind a backlash is
one that is wider by twice its width.
"""

from __future__ import annotations

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import background_kernel, kernel
from rtctl.simulations.vo2.mechanism import (
    Balance,
    Pieces,
    Values,
    Vo2Mechanism,
    Warm,
    coefficient,
    shape,
)

NO_TURN = 1e-9
"""Change [mA] that counts as round-off at rest, not as a reversal."""


@kernel
def held_step(held: float, command: float, width: float, behind: float) -> float:
    """Return y [mA] after a command [mA]."""
    away = command - held
    if away > width:
        return command - behind * width
    if away < -width:
        return command + behind * width
    return held


@background_kernel
def held_back(commands: FloatArray, width: float, behind: float) -> FloatArray:
    """Return y (n,) for commands (n,) [mA]; the first was reached from below."""
    y = np.empty_like(commands)
    held = commands[0] - behind * width
    for k in range(commands.size):
        held = held_step(held, commands[k], width, behind)
        y[k] = held
    return y


def dead(pieces: Pieces, p: Values) -> Pieces:
    """Remove small changes of the current."""
    nodes = pieces.nodes
    if p["width"] > 0.0:
        nodes = held_back(nodes.reshape(-1), p["width"], p["behind"]).reshape(nodes.shape)
    if p["held"] > 0.0:
        nodes = nodes + p["held"] * (
            held_back(nodes.reshape(-1), p["hold"], 0.0).reshape(nodes.shape) - nodes
        )
    return pieces._replace(nodes=np.maximum(nodes - p["zone"], 0.0))


def over_all_of_it(balance: Balance, p: Values) -> Balance:
    """Read the phase's heat from the loops, which refer to the whole current."""
    return balance._replace(zone=p["zone"])


def as_current(warm: Warm, p: Values) -> Warm:
    """Express temperatures as the squares of the currents that would hold them."""

    def held(power: FloatArray) -> FloatArray:
        current: FloatArray = np.sqrt(np.maximum(power, 0.0)) + p["zone"]
        return current**2 + np.minimum(power, 0.0)

    if p["zone"] == 0.0:
        return warm
    power = held(warm.power)
    if warm.lagging is warm.power:
        return warm._replace(power=power, lagging=power, peaks=power)
    return warm._replace(power=power, lagging=held(warm.lagging), peaks=held(warm.peaks))


@kernel
def command_for(v: float, last: FloatArray, back: float) -> float:
    """Return the command that leads to v [mA] through a backlash of half width `back` [mA].

    `last` (2,), advanced in place: its last turning point or furthest value since, and its direction.
    """
    if last[1] * (v - last[0]) >= 0.0:
        last[0] = v
    elif last[1] * (last[0] - v) > NO_TURN:
        last[0], last[1] = v, -last[1]
    return float(v + last[1] * back)


@background_kernel
def commands_for(seen: FloatArray, peaks: FloatArray, back: float) -> tuple[FloatArray, FloatArray]:
    """Return the commands for `seen` (n,) by way of `peaks` (n,) [mA], from below."""
    at, by = np.empty_like(seen), np.empty_like(peaks)
    last = np.array([peaks[0], 1.0])
    for k in range(seen.size):
        by[k] = command_for(peaks[k], last, back)
        at[k] = by[k] if peaks[k] == seen[k] else command_for(seen[k], last, back)
    return at, by


def through_the_backlash(seen: FloatArray, peaks: FloatArray, p: Values) -> tuple[FloatArray, FloatArray]:
    """Undo the backlash that the loops contain at rest."""
    back = p["behind"] * p["width"]
    return commands_for(seen, peaks, back) if back > 0.0 else (seen, peaks)


MECHANISM = Vo2Mechanism(
    id="actuation.deadband",
    statement=(
        "The heater's current stays behind changes by less than {width}, or within {hold} of them ({held}), and its "
        "first {zone} have no effect."
    ),
    parameters=(
        coefficient(
            "width", "mA", "half of the backlash", lambda s: 0.1 * s.drive, default=0.0, low=0.0
        ),
        coefficient(
            "zone", "mA", "of the current, that does not heat", lambda s: 0.3 * s.drive, default=0.0, low=0.0,
        ),
        coefficient(
            "held", "dimensionless", "share of small changes that is ignored", 1.0, default=0.0, low=0.0, high=1.5,
        ),
        shape(
            "behind", "dimensionless", "share of the width by which the current stays behind a larger change", 1.0,
            default=1.0, low=0.0, high=1.0, shape_range=(0.0, 1.0),
        ),
        shape(
            "hold", "mA", "of a change that is ignored", lambda s: 0.05 * s.drive, default=0.0, low=0.0,
            shape_range=(0.1, 6.0), grid=7, searched=True, kinked=True, of_form="held",
        ),
    ),
    forms={
        "width": "The heater's current stays behind changes of direction by {width} (a backlash).",
        "zone": "The first {zone} of the current have no effect.",
        "held": "Changes of the current by less than {hold} have no effect.",
    },
    pieces=dead,
    balance=over_all_of_it,
    warm=as_current,
    loops=through_the_backlash,
    stage=1,  # of all that warms the film
)  # fmt: skip
