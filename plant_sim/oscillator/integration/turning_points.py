"""The Prandtl-Ishlinskii operator on a drive: a sum of play operators of all thresholds, from its turning points.

    H(u) = integral over r > 0 of density exp(-fading r) play_r(u) dr

From rest at 0 it is phi(u) = density (u / fading - (1 - exp(-fading u)) / fading^2), the density times u^2 / 2 without
fading (Rayleigh's law), and on from a turning point (u_0, H_0) it is H_0 +- 2 phi(|u - u_0| / 2): Masing's rule. A
drive that comes back to the turning point before the last one closes that loop, and goes on as if it had not been.

References: P. Krejci, Hysteresis, Convexity and Dissipation in Hyperbolic Equations, 1996, section II.2; K. Kuhnen,
Modeling, Identification and Compensation of Complex Hysteretic Nonlinearities, European Journal of Control 9 (2003).
"""

from __future__ import annotations

import math

import numpy as np

from plant_sim.oscillator.integration.holds import compiled
from rtctl.border.arrays import FloatArray

DEEPEST = 256
"""Turning points that are remembered: a loop within so many others changes nothing that is seen."""
COUNT, DRIVE, HEADING, FIRST = 0, 1, 2, 3
"""Places in a state: how many turning points there are, the last drive, its direction, then drive and H of each."""
STATE_SIZE = FIRST + 2 * DEEPEST
_HALVINGS = 60


def rest() -> FloatArray:
    """Return the state of a device that was never driven."""
    return np.zeros(STATE_SIZE)


@compiled
def rise_from_rest(size: float, density: float, fading: float) -> float:
    """Return phi at a drive of this size (0 or more), from rest."""
    x = fading * size
    if x < 1e-3:
        return density * size * size * (0.5 - x * (1.0 / 6.0 - x / 24.0))
    return density * (x + math.expm1(-x)) / (fading * fading)


@compiled
def branch(at: float, since: float, held: float, density: float, fading: float) -> float:
    """Return H at a drive `at` on the branch from a turning point at the drive `since`, where H was `held`."""
    change = 2.0 * rise_from_rest(0.5 * abs(at - since), density, fading)
    return held + change if at > since else held - change


@compiled
def from_rest(at: float, density: float, fading: float) -> float:
    """Return H at a drive of either sign, from rest."""
    return math.copysign(rise_from_rest(abs(at), density, fading), at)


@compiled
def on_branch(state: FloatArray, count: int, at: float, density: float, fading: float) -> float:
    """Return H at a drive on the branch from the last of `count` turning points, or from rest."""
    if count == 0:
        return from_rest(at, density, fading)
    return branch(at, state[FIRST + 2 * count - 2], state[FIRST + 2 * count - 1], density, fading)


@compiled
def follow_turning_points(
    state: FloatArray, nodes: FloatArray, density: float, fading: float, out: FloatArray
) -> None:
    """Fill `out` (steps, 3) with H behind `nodes` (steps, 3), from `state` (STATE_SIZE,), left at the end."""
    count, last, heading = int(state[COUNT]), state[DRIVE], state[HEADING]
    held = on_branch(state, count, last, density, fading)
    for i in range(nodes.shape[0]):
        for k in range(3):
            at = nodes[i, k]
            if at != last:
                ahead = 1.0 if at > last else -1.0
                if ahead * heading < 0.0 and count < DEEPEST:
                    state[FIRST + 2 * count], state[FIRST + 2 * count + 1] = last, held
                    count += 1
                heading = ahead
                while count > 1:
                    turn, before = state[FIRST + 2 * (count - 1)], state[FIRST + 2 * (count - 2)]
                    way = 1.0 if turn > before else -1.0
                    if way * (at - before) <= 0.0:
                        count -= 2
                    elif way * (at - turn) >= 0.0:  # after a turn that was one too many
                        count -= 1
                    else:
                        break
                if count == 1 and abs(at) >= abs(state[FIRST]):
                    count = 0
                held = on_branch(state, count, at, density, fading)
                last = at
            out[i, k] = held
    state[COUNT], state[DRIVE], state[HEADING] = count, last, heading


def farthest_before(remanence: float, density: float, fading: float) -> float:
    """Return a drive beyond the one that leaves this remanence at no drive, or as much of it as any drive leaves."""
    if remanence == 0.0 or density == 0.0:
        return 0.0
    return max(4.0 * math.sqrt(abs(remanence) / density), 50.0 / fading if fading else 0.0)


@compiled
def arrive(first: float, remanence: float, largest: float, density: float, fading: float) -> FloatArray:
    """Return the state of a device that is at the drive `first` with more of H than from rest.

    Args:
        first: Drive.
        remanence: What H has beyond what it has at `first` from rest, by one turning point before.
        largest: Size of the drive that this turning point does not exceed.
        density: Density of the play operators [1/u].
        fading: Its fading with the threshold [1/u].
    """
    state = np.zeros(STATE_SIZE)
    state[DRIVE] = first
    state[HEADING] = np.sign(first)
    if remanence == 0.0 or density == 0.0 or largest <= abs(first):
        return state
    way = math.copysign(1.0, remanence)
    rested = from_rest(first, density, fading)
    low, high = abs(first), largest
    for _ in range(_HALVINGS):
        size = 0.5 * (low + high)
        far = way * rise_from_rest(size, density, fading)
        if abs(branch(first, way * size, far, density, fading) - rested) < abs(remanence):
            low = size
        else:
            high = size
    size = 0.5 * (low + high)
    state[COUNT], state[HEADING] = 1.0, -way
    state[FIRST], state[FIRST + 1] = way * size, way * rise_from_rest(size, density, fading)
    return state
