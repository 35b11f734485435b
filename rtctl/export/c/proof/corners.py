"""Inputs that no healthy run has: noise, readings that are stale, infinite or no number, missed periods, saturation.

Each stretch starts anew. Its readings wander over the plausible range and beyond, its setpoints step beyond the reach
of the limits, and now and then one thing is wrong.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.export.c.laws.law import Law, aligned_dtype
from rtctl.export.c.proof.recorded import Rows

STRETCH = 400
ENABLED = 1
WRONG_SHARE = 0.01
"""Share of the rows with something wrong; the first of them that is refused ends the stretch in a fault."""
WRONG = (np.nan, np.inf, -np.inf, 0.0, -1.0, 1e-30, 1e30)


def corner_rows(law: Law, count: int, real: Any, seed: int) -> Rows:
    """Return inputs (count,) of a law; `real`: precision of the exported arithmetic."""
    random = np.random.default_rng(seed)
    rows = np.zeros(count, dtype=aligned_dtype(law.input, real))
    period_us = round(1e6 * law.constants.rules.period_s)
    low, high = law.corners.readings
    for name in (one for one in rows.dtype.names or () if one.startswith("sensed")):
        walk = np.sin(np.cumsum(random.normal(0.0, 0.05, count)) + random.normal(0.0, 1e-3, count))
        share = 0.5 + 0.5 * walk
        rows[name] = low * (high / low) ** share if low > 0.0 else low + (high - low) * share
    levels = random.uniform(*law.corners.setpoints, count // 50 + 1)
    rows["setpoint"] = np.repeat(levels, 50)[:count]
    rows["upcoming"] = np.append(rows["setpoint"][1:], rows["setpoint"][-1:])
    rows["periods"], rows["status"] = 1, ENABLED
    missed = random.random(count) < WRONG_SHARE
    rows["periods"][missed] = random.integers(2, 6, int(missed.sum()))
    rows["counter"] = np.arange(count)
    rows["time_us"] = np.arange(count) * period_us & 0xFFFFFFFF
    rows["begun_ns"] = rows["answered_ns"] = np.arange(count) * period_us * 1000
    _spoil(rows, random)
    rows["periods"][::STRETCH] = 0
    return rows


def _spoil(rows: Rows, random: np.random.Generator) -> None:
    """Make something wrong in some rows of two stretches of three."""
    count = len(rows)
    wrong = random.random(count) < WRONG_SHARE
    wrong[np.arange(count) // STRETCH % 3 == 0] = False
    for k in np.flatnonzero(wrong).tolist():
        kind = int(random.integers(5))
        if kind == 0:
            rows["sensed"][k] = random.choice(WRONG)
        elif kind == 1:  # stale: the sample before again
            rows["counter"][k] = rows["counter"][k - 1]
        elif kind == 2:
            rows["status"][k] = int(random.integers(0, 32))
        elif kind == 3:
            rows["time_us"][k] += int(random.integers(-5000, 5000))
        else:  # a sensor that is stuck
            for name in (one for one in rows.dtype.names or () if one.startswith("sensed")):
                rows[name][k : k + 100] = rows[name][k]
