"""A VO2 model over communication steps: it starts, moves on, and is read, with all that it remembers in one record.

Over a step the command is a straight line. It is cut into pieces where a delayed command has a corner, and these into
substeps, as `Vo2Simulation.predict` does: the same instants, the same order of everything, so the same numbers but for
rounding.
"""

from __future__ import annotations

import math
from typing import Any

from rtctl.simulations.vo2.heat import Powers
from rtctl.simulations.vo2.mechanism import Balance
from rtctl.simulations.vo2.relaxation import through
from rtctl.simulations.vo2.stepping.balance import balance_of, rest, warm_up
from rtctl.simulations.vo2.stepping.heater import (
    FORGOTTEN,
    SAME_INSTANT,
    command_at,
    first_held,
    heater_current,
    in_force,
    remember,
    until_corner,
)
from rtctl.simulations.vo2.stepping.readings import read
from rtctl.simulations.vo2.stepping.values import Constants, Parameters

Record = Any
NO_TIME_CONSTANT, RUNS_AWAY = 1, 2
"""Faults: the heating has no time constant, the temperature is not finite."""
MOST_SUBSTEPS, TOO_MANY = 1e8, 4
"""Substeps in a communication step, and the fault beyond."""
MOST = 1e100
"""Beyond it a temperature is not finite [mA^2]."""


def march_start(s: Record, command: float, p: Parameters, c: Constants) -> None:
    """Start at rest in the first command [mA], on the branch that a full cooling leaves."""
    s.begun = s.fault = s.time_s = s.since_s = s.count = 0.0
    s.first = command
    first_held(s, command, p)
    s.current = heater_current(s, command, 0.0, p, c.current_middle)
    rest(s, s.current, p, c)
    s.centre = -math.inf
    read(s, 0.0, s.current, True, p, c)


def march_look(s: Record, level: float, p: Parameters, c: Constants) -> None:
    """Set the readings of the present instant, where `level` [mA] is the command that follows."""
    after = float(s.current)
    if p.crosstalk.leak != 0.0 and p.crosstalk.before != 1.0:
        backlash, kept = float(s.backlash), float(s.kept)
        after = heater_current(s, level, s.time_s, p, c.current_middle)
        s.backlash, s.kept = backlash, kept
    read(s, s.since_s, after, False, p, c)


# 9 parameters because a piece is told by its course over time
def piece(  # noqa: PLR0913
    s: Record, k: int, source_s: float, duration_s: float, count: int, first: bool, b: Balance, p: Parameters,
    c: Constants,
) -> None:  # fmt: skip
    """Move over a piece, in which the command of step k acts, from its time `source_s` on."""
    half = 0.5 * duration_s
    start, middle, end = (
        command_at(s, k, source_s), command_at(s, k, source_s + half), command_at(s, k, source_s + duration_s),
    )  # fmt: skip
    start = heater_current(s, start, s.time_s, p, c.current_middle)
    if first or c.between:
        read(s, s.since_s, start, True, p, c)
        s.since_s, s.begun = 0.0, 1.0
    middle = heater_current(s, middle, s.time_s + half, p, c.current_middle)
    end = heater_current(s, end, s.time_s + duration_s, p, c.current_middle)
    h, dx = duration_s / count, 1.0 / count
    for j in range(count):
        x = j * dx
        i0, i1 = through(start, middle, end, x), through(start, middle, end, x + 0.25 * dx)
        i2, i3 = through(start, middle, end, x + 0.5 * dx), through(start, middle, end, x + dx)
        powers = Powers(i0 * i0, i1 * i1, i2 * i2, i3 * i3)
        warm_up(s, powers, h, b, p, c)
        s.current = i3
        s.time_s += h
        s.since_s += h
        if c.between and j < count - 1:
            read(s, s.since_s, s.current, True, p, c)
            s.since_s = 0.0


# 7 parameters because a command is told by its course over the step
def march_advance(  # noqa: PLR0913
    s: Record, level: float, slope: float, h: float, longest_s: float, p: Parameters, c: Constants
) -> None:
    """Move by h [s] under a command of level + slope t [mA], in substeps of at most `longest_s` [s]."""
    s.fault = 0.0
    if not p.nominal.time_constant > 0.0:
        s.fault = float(NO_TIME_CONSTANT)
        return
    began_s, delay_s = float(s.time_s), p.delay.delay
    remember(s, began_s, level, slope)
    b = balance_of(p)
    wanted = h / longest_s - 1e-9
    if wanted > MOST_SUBSTEPS:
        s.fault = float(TOO_MANY)
        return
    count = max(1, int(wanted) + 1 if wanted > int(wanted) else int(wanted))
    passed, first = 0.0, True
    while h - passed > SAME_INSTANT * h:
        source_s = began_s + passed - delay_s
        k = in_force(s, source_s, SAME_INSTANT * h)
        if k < -1:
            s.fault = float(FORGOTTEN)
            return
        left = h - passed
        if k + 1 < int(s.count):
            left = min(left, until_corner(s, k, source_s, h))
        piece(s, k, source_s, left, count, first, b, p, c)
        passed, first = passed + left, False
    s.time_s = began_s + h
    if not abs(s.power) < MOST:
        s.fault = float(RUNS_AWAY)
