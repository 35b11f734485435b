"""Whether a law of no name explains more than causes that leave something: then none of them is the cause."""

from __future__ import annotations

from collections.abc import Callable

from rtctl.diagnosis.answer import sentence_of
from rtctl.diagnosis.budget import Budget
from rtctl.diagnosis.gate import examine
from rtctl.diagnosis.hypothesis import Data, Hypothesis, fitted
from rtctl.diagnosis.race import FIRST_LAP, race
from rtctl.diagnosis.runners import runners_of

SECONDS = 15.0
"""Of processor time, for all laws: their race takes ten on records of some seconds."""
BETTER = 0.8
"""Of the cost: a law of no name that leaves less than this share of what the named causes leave."""


def explaining_more(
    data: Data, nominal: Hypothesis, named: Hypothesis, budget: Budget,
    told: Callable[[str], None] = lambda text: None,
) -> str:  # fmt: skip
    """The sentence of the subject's law of no name that, alone, leaves least, if clearly less than `named`; else "".

    Both by a first look at the records. `budget`: of the diagnosis, which this may outlast a little. `told` hears each
    fit, and may raise to stop.
    """
    budget, glance = budget.further(SECONDS), data.glance
    seen = fitted(glance, named.simulation, named.mechanisms, named.starts, FIRST_LAP, still=named.still)
    if seen is None:
        return ""
    field = race(glance, runners_of(examine(nominal, data, data.subject.unnamed)), told, budget)
    if not field or field[0].cost >= BETTER * seen.cost:
        return ""
    return sentence_of(field[0].simulation, field[0].mechanisms[-1])
