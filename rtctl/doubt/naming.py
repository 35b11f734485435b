"""From what each cause leaves of the residuals to names with probabilities.

    p_j ~ exp(-N cost_j / 2),    cost 1: what is left is as small as before the change

N is far below the number of rows: residuals are errors of a model, alike wherever the device moves alike. Its value is
an assumption: no search or calibration stands behind it, so the probabilities rank causes and are no rates.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from rtctl.doubt.belief import Named

INDEPENDENT = 8.0
"""N."""
LEAST = 0.05
"""Probability below which a cause is not told."""
EXPLAINS = 0.5
"""Of the cost of no change: a cause that leaves more explains nothing."""


class Answer(NamedTuple):
    """A cause that was named."""

    id: str
    statement: str
    size: float
    unit: str
    probability: float
    removes: float
    """Part of the error since the change that it removes."""
    shape: float = math.nan
    """See `Named`."""


def answer_of(found: Sequence[Named]) -> tuple[Answer, ...]:
    """Return the causes that explain a change, the most likely first; `found` begins with no change at all."""
    nothing, *causes = found
    good = [one for one in causes if one.cost < EXPLAINS * nothing.cost]
    if not good:
        return ()
    least = min(one.cost for one in good)
    weights = [math.exp(-0.5 * INDEPENDENT * (one.cost - least) / max(least, 1.0)) for one in good]
    told = [
        Answer(
            one.id,
            one.statement,
            one.size,
            one.unit,
            weight / sum(weights),
            1.0 - one.cost / nothing.cost,
            one.shape,
        )
        for one, weight in zip(good, weights, strict=True)
    ]
    return tuple(sorted((one for one in told if one.probability >= LEAST), key=lambda one: -one.probability))
