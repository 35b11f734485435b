"""How far an effect moves the response, and the amplitude at which it moves it by a wanted share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .effects import Recipe
from .plan import FloatArray, Input, LeftDeviceError, Plan, simulate

TOLERANCE = 0.04  # of the wanted share
EVALUATIONS = 16


class NoSuchSizeError(Exception):
    """No amplitude moves the response by the wanted share: draw another case."""


def distinct(inputs: list[Input]) -> list[Input]:
    """Fit records without repeats."""
    return list({r.number: r for r in reversed(inputs) if r.use == "fit"}.values())[::-1]


def responses(plan: Plan, inputs: list[Input]) -> FloatArray:
    """Noise-free readings of all records, one after the other."""
    return np.concatenate([simulate(plan, record)[0] for record in inputs])


def share_moved(without: FloatArray, having: FloatArray, rest: float) -> float:
    """rms(having - without) / rms(having - rest): the share of the response that the effect makes."""
    return float(np.sqrt(np.mean((having - without) ** 2) / np.mean((having - rest) ** 2)))


def amplitude_for(share: float, recipe: Recipe, plan: Plan, inputs: list[Input]) -> tuple[float, float]:
    """Amplitude at which the effect moves the response by `share`, and the share reached.

    Raises NoSuchSizeError where none does.
    """
    without = responses(plan, inputs)

    def reached(a: float) -> float:
        try:
            return share_moved(without, responses(recipe.apply(plan, a), inputs), plan.rest)
        except LeftDeviceError:
            return np.inf

    if np.isnan(recipe.guess):
        return 1.0, reached(1.0)
    return find_amplitude(reached, share, recipe.guess, recipe.largest)


def find_amplitude(
    reached: Callable[[float], float], share: float, guess: float, largest: float
) -> tuple[float, float]:
    """Bracket in log amplitude, then interpolate between the brackets, halving where that stalls."""
    low, high = (np.log(1e-6), 0.0), (np.log(largest), np.inf)
    log_a = np.log(guess)
    for turn in range(EVALUATIONS):
        now = reached(float(np.exp(log_a)))
        if abs(now - share) <= TOLERANCE * share:
            return float(np.exp(log_a)), now
        if now < share:
            low = (log_a, now)
        else:
            high = (log_a, now)
        if low[1] > 0.0 and np.isfinite(high[1]) and turn % 3 != 2:
            part = np.log(share / low[1]) / np.log(high[1] / low[1])
            log_a = low[0] + float(np.clip(part, 0.05, 0.95)) * (high[0] - low[0])
        else:
            step = np.log(share / now) if 0.0 < now < np.inf else -2.0
            log_a = float(np.clip(log_a + np.clip(step, -2.5, 2.5), low[0], high[0]))
            if not low[0] < log_a < high[0]:
                log_a = 0.5 * (low[0] + high[0])
    raise NoSuchSizeError
