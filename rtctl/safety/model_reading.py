"""A reading that stays, to the bit, while the model's moves.

Where the estimator has a model of the reading, that model is asked beside the rules of `rtctl.safety.guards`: a reading
that stays, while the model's goes far beyond its own error and the reading's resolution and stays there, is stuck,
however little the command moves, and on a slope of any steepness. On a plateau the model's reading stays as well.
"""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import NDArray

from rtctl.border.kernels import background_kernel

LEAST_STEPS = 10.0
"""Steps of the resolution by which a live reading would have moved: with fewer expected it may well repeat."""
MODEL_ERRORS = 20.0
"""RMS errors of the model's reading by which it must have changed: a model is off by a few, in places by ten."""


@background_kernel
def contradicts_model(guarded: NDArray[Any], expected: float, sensed: float, error: float) -> bool:
    """Return whether a reading that repeats has been contradicted by its model for `frozen_after` samples.

    Args:
        guarded: rules and memory, after `follows` has judged this reading; advanced.
        expected: the model's reading of this sample, as a logarithm; its sign does not matter.
        sensed: the reading [its unit].
        error: RMS error of the model's reading, as a logarithm.
    """
    s = guarded[0]
    if s.equal <= 1 or math.isnan(s.model_from):  # of a reading that has just changed, Python does not ask
        s.model_from, s.apart = expected, 0
        return False
    change = abs(expected - s.model_from)
    is_far = change > MODEL_ERRORS * error and change * abs(sensed) > LEAST_STEPS * s.resolution
    s.apart = s.apart + 1 if is_far else 0
    return bool(0 < s.frozen_after <= s.apart)


def explained(name: str, sensed: float, repeats: int, change: float) -> str:
    """Return why a reading is stuck.

    Args:
        name: of its channel, with its unit.
        sensed: the reading [its unit].
        repeats: how often it has been read.
        change: of the model's reading meanwhile, as a logarithm.
    """
    return (
        f"{name} has read {sensed!r} {repeats} times in a row while the model's reading changed by "
        f"{100.0 * math.expm1(change):.3g} %: the sensor is stuck, or the device is far from its model; if both are "
        "healthy, --set safety.frozen_after=0 leaves this check out"
    )
