"""From commands to the heater's current: delay, drift of the gain, dead band, gain and offset.

A communication step is cut where the delayed command has a corner: into pieces over which it is a straight line. Each
mechanism is one of `rtctl.simulations.vo2.mechanisms.actuation`.
"""

from __future__ import annotations

from typing import Any

from rtctl.border.kernels import kernel
from rtctl.simulations.vo2.heat import drifted_s
from rtctl.simulations.vo2.mechanisms.actuation.deadband import held_step
from rtctl.simulations.vo2.stepping.values import Parameters

SAME_INSTANT = 1e-9
"""Of a communication step: closer instants are one."""
FORGOTTEN = 3
"""Fault: the delay is longer than the steps that are remembered."""

MOST_COUNTED = 1073741824.0
"""Communication steps from which on their count begins anew: it stays an integer of 32 bits."""

Record = Any


@kernel
def about(x: float, middle: float, gain: float, offset: float) -> float:
    """Return x with a gain about the middle and an offset; see `corrected`."""
    return x if gain == 1.0 and offset == 0.0 else x + (gain - 1.0) * (x - middle) + offset


def first_held(s: Record, command: float, p: Parameters) -> None:
    """Begin with a command that was reached from below."""
    s.backlash = command - p.deadband.behind * p.deadband.width
    s.kept = s.backlash


def heater_current(s: Record, command: float, time_s: float, p: Parameters, middle: float) -> float:
    """Return the heater's current [mA] of a command at a time; what a dead band holds back advances."""
    drift, dead = p.gain_drift, p.deadband
    x = command * (1.0 + drift.rate * drifted_s(time_s, drift.settling_time))
    if dead.width > 0.0:
        x = held_step(s.backlash, x, dead.width, dead.behind)
    s.backlash = x
    if dead.held > 0.0:
        s.kept = held_step(s.kept, x, dead.hold, 0.0)
        x += dead.held * (s.kept - x)
    if dead.width > 0.0 or dead.held > 0.0 or dead.zone > 0.0:
        x = max(x - dead.zone, 0.0)
    return about(x, middle, p.nominal.current_gain, p.nominal.current_offset)


def remember(s: Record, time_s: float, level: float, slope: float) -> None:
    """Note the command of a communication step that begins."""
    at = int(s.count) % s.levels.size
    s.begins_s[at], s.levels[at], s.slopes[at] = time_s, level, slope
    s.count += 1.0
    if s.count >= MOST_COUNTED:
        s.count = float(s.levels.size + int(s.count) % s.levels.size)


def in_force(s: Record, time_s: float, near_s: float) -> int:
    """Return which communication step's command was in force at a time; -1: before the first, -2: forgotten."""
    size, newest = s.levels.size, int(s.count) - 1
    oldest = max(0, newest - size + 1)
    k = newest
    while k >= oldest and s.begins_s[k % size] > time_s + near_s:
        k -= 1
    if k >= oldest:
        return k
    return -1 if oldest == 0 else -2


def command_at(s: Record, k: int, time_s: float) -> float:
    """Return the command of a communication step at a time within it [mA]."""
    if k < 0:
        return float(s.first)
    at = k % s.levels.size
    return float(s.levels[at] + s.slopes[at] * (time_s - s.begins_s[at]))


def until_corner(s: Record, k: int, time_s: float, h: float) -> float:
    """Return how long the command of a communication step that has ended is in force from a time on [s].

    Before the first one there were others of the same length `h` [s], all of the first command.
    """
    if k >= 0:
        following = k + 1
        return float(s.begins_s[following % s.levels.size] - time_s)
    ahead = s.begins_s[0] - time_s
    left = ahead - int(ahead / h + SAME_INSTANT) * h
    return float(left if left > SAME_INSTANT * h else h)
