"""Whether the small causes of a set help on records that no fit saw: noise that is no autoregression looks like one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.diagnosis.gain import free_run_error
from rtctl.diagnosis.gate import examine
from rtctl.diagnosis.hypothesis import Data, Hypothesis
from rtctl.diagnosis.pruning import without_each
from rtctl.diagnosis.search import Search, equivalents, in_its_place
from rtctl.identification.fit_record import FitRecord

SMALL = 0.02
"""Of what the set removes of the squared misfit: a cause that removes more is told, whatever test records say."""
SHOWN = 0.5
"""Of a test record, where its start and what else is its own are fitted: the rest has to follow from there."""


def supported(
    found: Search, data: Data, tests: Sequence[FitRecord], ids: Sequence[str]
) -> tuple[Search, tuple[str, ...]]:
    """Less the small causes without which the error on `tests` is no larger; and which those are.

    The gate's verdict stays the larger set's: what is left without them is too small to be a cause.
    """
    dropped: list[str] = []
    while tests:
        chosen = found.chosen.hypothesis
        causes = set(chosen.mechanisms) - set(found.nominal.hypothesis.mechanisms)
        removed = found.nominal.hypothesis.cost - chosen.cost
        small = [one for one in found.without if one.cost - chosen.cost < SMALL * removed]
        if len(causes) < 2 or not small:
            break
        least, fewer = min(((_error(one, data, tests), one) for one in small), key=lambda pair: pair[0])
        if not least <= _error(chosen, data, tests):
            break
        dropped += set(chosen.mechanisms) - set(fewer.mechanisms)
        examined = examine(fewer, data, ids)._replace(tests=found.chosen.tests)
        found = in_its_place(data, found, examined)
        found = found._replace(
            without=without_each(data, found.nominal.hypothesis, fewer, found.fitted),
            equivalent=equivalents(data, found.tried, examined, plain=not found.passes),
        )
    return found, tuple(dropped)


def _error(one: Hypothesis, data: Data, tests: Sequence[FitRecord]) -> float:
    """Mean square over all outputs that are there, in squares of their size."""
    names = [name for name in one.sensitivity.outputs if all(name in record.measured for record in tests)]
    squares = [
        np.concatenate([free_run_error(one.simulation, record, name, SHOWN) for record in tests]) ** 2
        / data.size(name) ** 2
        for name in names
    ]
    return float(np.mean(squares)) if squares else np.inf
