"""Steps of the set-point as a control engineer reads them: settling time, overshoot, settled error.

Of a step from r0 to r at t0: the settling time is how long after t0 the output last leaves r +- 2 % of |r - r0|, the
overshoot how far it goes beyond r, in percent of |r - r0|, the settled error the mean of |y - r| over the last quarter.
Reference: K. J. Astrom, R. M. Murray, Feedback Systems, section 6.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.evaluation.setpoint_holds import Hold

BAND = 0.02
"""Half width of the band in which an output is settled, in heights of the step."""
LAST = 4
"""One over the share of a hold, at its end, that the settled error is of."""
FEWEST = 8
"""Samples below which a hold shows no settling."""


class StepResponse(NamedTuple):
    """Response to one step of the set-point."""

    settling_s: float | None
    """Time until the output stays in the band [s]; None: it does not."""
    overshoot: float
    """Farthest beyond the new set-point, in heights of the step."""
    settled_error: float
    """Mean absolute error of the last quarter, in the output's unit."""


def step_responses(
    index: FloatArray, setpoint: FloatArray, output: FloatArray, period_s: float, holds: Sequence[Hold]
) -> list[StepResponse]:
    """Return the response to every step of a held set-point whose output was measured.

    Args:
        index: periods since the start of each row (n,), missed ones included.
        setpoint: set-point of each row (n,).
        output: output of each row (n,), in the set-point's unit; NaN where it was not measured.
        period_s: sample period [s].
        holds: the holds of the set-point.
    """
    found = []
    for before, hold in zip(holds, holds[1:], strict=False):
        new = float(setpoint[hold.first])
        height, error = new - float(setpoint[before.first]), output[hold.first : hold.end] - new
        if len(error) < FEWEST or height == 0.0 or not np.isfinite(error).all():
            continue
        outside = np.flatnonzero(np.abs(error) > BAND * abs(height))
        last = int(outside[-1]) if len(outside) else -1
        since = index[hold.first : hold.end] - index[hold.first]
        settled_s = period_s * (float(since[last]) + 1.0) if last >= 0 else 0.0
        found.append(
            StepResponse(
                settling_s=settled_s if last < len(error) - 1 else None,
                overshoot=max(0.0, float(np.max(np.sign(height) * error)) / abs(height)),
                settled_error=float(np.mean(np.abs(error[-max(1, len(error) // LAST) :]))),
            )
        )
    return found


def summarise_steps(responses: Sequence[StepResponse], factor: float, unit: str) -> dict[str, Any]:
    """Return the figures of all steps for a summary; empty where there is none.

    Args:
        responses: Response to each step.
        factor: From the output's unit to `unit`.
        unit: Unit of the settled errors.
    """
    if not responses:
        return {}
    times = [1e3 * one.settling_s for one in responses if one.settling_s is not None]
    overshoots = [100.0 * one.overshoot for one in responses]
    errors = [factor * one.settled_error for one in responses]
    return {
        "steps": len(responses),
        "settled": len(times),
        "band_percent": 100.0 * BAND,
        "settling_ms": {"median": float(np.median(times)), "max": max(times)} if times else None,
        "overshoot_percent": {"median": float(np.median(overshoots)), "max": max(overshoots)},
        "settled_error": {"median": float(np.median(errors)), "max": max(errors), "unit": unit},
    }
