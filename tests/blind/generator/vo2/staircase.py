"""Quasi-static staircases: the outer loop, then reversal curves; the end of each hold is its steady state."""

from __future__ import annotations

import numpy as np

from .physics import FloatArray

HOLD_SAMPLES = 20
HOLD_TAUS = 14.0
LEVELS = 72
TURNS = 36


def hold_time(tau: float, slowest: float) -> float:
    """s, such that what is left of any settling is under 1e-3 of the step."""
    return max(HOLD_TAUS * tau, 8.0 * slowest)


def even_levels(low: float, high: float, branches: list[FloatArray]) -> FloatArray:
    """Levels of the square of the current, dense where a first coarse loop changed: as an experimenter would choose.

    `branches`: readings along the heating and the cooling branch at equally spaced squares from low to high.
    """
    place = np.linspace(low, high, branches[0].size)
    moved = np.full(place.size, 2.0 / place.size)
    for branch in branches:
        moved += np.abs(np.gradient(branch)) / np.sum(np.abs(np.gradient(branch)))
    measure = np.r_[0.0, np.cumsum(0.5 * (moved[1:] + moved[:-1]))]
    return np.interp(np.linspace(0.0, measure[-1], LEVELS), measure, place)


def reversal_staircase(grid: FloatArray) -> FloatArray:
    """Up, down, then first-order reversal curves: up by every second level to falling turning points, down by each."""
    parts = [grid, grid[::-1]]
    for last in np.unique(np.linspace(4, LEVELS - 3, TURNS).astype(int))[::-1]:
        part = grid[: last + 1]
        parts += [part[last % 2 :: 2], part[::-1]]
    return _without_repeats(np.concatenate(parts))


def shrinking_staircase(rng: np.random.Generator, grid: FloatArray) -> FloatArray:
    """Swings over the levels that shrink about a drawn middle, four times, each from the bottom and back to it."""
    at = [0]
    for _ in range(4):
        middle = rng.uniform(0.35, 0.65)
        for shrink in np.linspace(1.0, 0.15, 7):
            for end in (1.0, 0.0):
                to = round((middle + shrink * (end - middle)) * (LEVELS - 1))
                at += _walk(at[-1], to, 2)
        at += _walk(at[-1], 0, 3)
    return _without_repeats(grid[at])


def _walk(begin: int, end: int, step: int) -> list[int]:
    """Places after `begin` up to `end`."""
    sign = 1 if end > begin else -1
    return [*range(begin + sign * step, end, sign * step), end] if begin != end else []


def _without_repeats(levels: FloatArray) -> FloatArray:
    return levels[np.r_[True, np.abs(np.diff(levels)) > 1e-9]]


def held(levels: FloatArray) -> FloatArray:
    """Current at each sample of a staircase, rounded as a converter would to a microampere."""
    return np.repeat(np.round(np.sqrt(levels), 3), HOLD_SAMPLES)
