"""The drive's path from command to heating current: corrected, behind a dead band, delayed.

Memory: the current behind the backlash, the one that small changes leave [mA], how many held currents are on their way,
then of each of these its heating current [mA] and how long it goes on [s].
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics

HELD, KEPT, WAITING, FIRST = 0, 1, 2, 3
SHORTEST_S = 1e-12
"""What is left of a time below this is rounding [s]."""
ROOM = 8
"""Held currents for which there is room at first; a longer delay makes more."""


class DriveParams(NamedTuple):
    """Parameters of a drive."""

    gain: float
    """Of the heating current, over the commanded one."""
    offset: float
    """[mA]."""
    width: float
    """Half of the backlash [mA]."""
    behind: float
    """Share of the width by which the current stays behind a larger change."""
    hold: float
    """Of a change that is ignored [mA]."""
    held: float
    """Share of small changes that is ignored."""
    shortest_s: float
    """What is left of a time below this is rounding [s]."""


class Arrived(NamedTuple):
    """A heating current [mA] that arrives, and for how long [s]."""

    current: float
    duration_s: float


def drive_params(dynamics: Vo2Dynamics) -> DriveParams:
    """Return the parameters of a model's drive."""
    gain, offset = map(float, dynamics.current)
    return DriveParams(
        gain, offset, float(dynamics.deadband_mA), float(dynamics.behind),
        float(dynamics.hold_mA), float(dynamics.held), SHORTEST_S,
    )  # fmt: skip


@register_jitable
def heating_current(memory: FloatArray, command: float, p: DriveParams) -> float:
    """Return the heating current [mA] of a command [mA] that is held from now on; advance the dead band in place."""
    away = command - memory[HELD]
    if abs(away) > p.width:
        memory[HELD] = command - math.copysign(p.behind * p.width, away)
    if abs(memory[HELD] - memory[KEPT]) > p.hold:
        memory[KEPT] = memory[HELD]
    taken = memory[HELD] + p.held * (memory[KEPT] - memory[HELD])
    return float(p.gain * taken + p.offset)


@register_jitable
def send(memory: FloatArray, current: float, duration_s: float) -> None:
    """Put a heating current [mA], held for a time [s], behind those that are on their way."""
    last = FIRST + 2 * int(memory[WAITING])
    memory[last] = current
    memory[last + 1] = duration_s
    memory[WAITING] += 1.0


@register_jitable
def arrival(memory: FloatArray, left_s: float, shortest_s: float) -> Arrived:
    """Return what arrives next of the currents on their way, for at most `left_s` [s]; take it off in place."""
    current, duration_s = memory[FIRST], min(memory[FIRST + 1], left_s)
    if memory[FIRST + 1] - duration_s > shortest_s:
        memory[FIRST + 1] -= duration_s
    else:
        memory[WAITING] -= 1.0
        for k in range(FIRST, FIRST + 2 * int(memory[WAITING])):
            memory[k] = memory[k + 2]
    return Arrived(current, duration_s)


# 8 parameters because a kernel takes its arrays one by one
@kernel
def fill_pieces(  # noqa: PLR0913
    memory: FloatArray, levels: FloatArray, elapsed_s: FloatArray, heat: FloatArray, first: int, p: DriveParams,
    pieces: FloatArray, count: int,
) -> tuple[int, int]:  # fmt: skip
    """Put what arrives in the rows from `first` on behind `count` pieces; as `Drive.pieces`, for whole records.

    Args:
        memory: of the drive, advanced in place.
        levels: commands (n,) [mA].
        elapsed_s: how long each is held (n,) [s].
        heat: heat beside it (n,) [mA^2].
        first: row to begin with.
        p: parameters.
        pieces: row, heating current [mA], duration [s], heat of each held current (m, 4).
        count: pieces so far.

    Returns:
        The row before which the memory has no room left, n if all are done; the number of pieces.
    """
    for row in range(first, len(levels)):
        if FIRST + 2 * int(memory[WAITING]) + 2 > memory.size:
            return row, count
        current = heating_current(memory, levels[row], p)
        if elapsed_s[row] > 0.0:
            send(memory, current, elapsed_s[row])
        left_s, before = elapsed_s[row], count
        while left_s > p.shortest_s:
            piece = arrival(memory, left_s, p.shortest_s)
            pieces[count, 0], pieces[count, 1] = row, piece.current
            pieces[count, 2], pieces[count, 3] = piece.duration_s, heat[row]
            count += 1
            left_s -= piece.duration_s
        if count == before:  # nothing goes on: the row is there all the same
            pieces[count, 0], pieces[count, 1], pieces[count, 2], pieces[count, 3] = row, 0.0, 0.0, heat[row]
            count += 1
    return len(levels), count


def later(clock: FloatArray, duration_s: float) -> None:
    """Advance a time [s] in place; what its rounding loses is kept for the next time (W. Kahan, CACM 8 (1965) 40)."""
    step_s = duration_s - clock[1]
    now_s = clock[0] + step_s
    clock[1] = (now_s - clock[0]) - step_s
    clock[0] = now_s


class Drive:
    """A drive with its memory."""

    def __init__(self, dynamics: Vo2Dynamics) -> None:
        self.params = drive_params(dynamics)
        self._delay_s = float(dynamics.delay_s)
        self.memory = np.zeros(FIRST + 2 * ROOM)

    def start(self, command: float) -> float:
        """Start at rest at a command [mA] reached from below; return the heating current [mA]."""
        p = self.params
        self.memory[:] = 0.0
        self.memory[HELD] = self.memory[KEPT] = command - p.behind * p.width
        current = p.gain * float(self.memory[HELD]) + p.offset
        if self._delay_s > 0.0:
            send(self.memory, current, self._delay_s)
        return current

    def make_room(self) -> None:
        """Make room for one more held current on its way."""
        if FIRST + 2 * int(self.memory[WAITING]) + 2 > self.memory.size:
            self.memory = np.concatenate((self.memory, np.zeros(self.memory.size)))

    def all_pieces(self, levels: FloatArray, elapsed_s: FloatArray, heat: FloatArray) -> FloatArray:
        """Return row, heating current [mA], duration [s] and heat beside it [mA^2] of all held currents (m, 4).

        Args:
            levels: commands (n,) [mA].
            elapsed_s: how long each is held (n,) [s].
            heat: heat beside it (n,) [mA^2].
        """
        # each command adds one piece, and each row cuts one in two at most
        pieces = np.empty((2 * len(levels) + int(self.memory[WAITING]) + 1, 4))
        row = count = 0
        while row < len(levels):
            self.make_room()
            row, count = fill_pieces(self.memory, levels, elapsed_s, heat, row, self.params, pieces, count)
        return pieces[:count]

    def pieces(self, command: float, elapsed_s: float) -> list[tuple[float, float]]:
        """Return heating currents [mA] and their durations [s] over `elapsed_s` in which `command` [mA] is held."""
        self.make_room()
        current = heating_current(self.memory, command, self.params)
        if elapsed_s > 0.0:
            send(self.memory, current, elapsed_s)
        left_s, arrived = elapsed_s, []
        while left_s > self.params.shortest_s:
            piece = arrival(self.memory, left_s, self.params.shortest_s)
            arrived.append((float(piece.current), float(piece.duration_s)))
            left_s -= piece.duration_s
        return arrived
