"""Steps of the readings, which no fit follows: they are left out of the fits, and told by the levels afterwards."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.simulation import FreeParameter, Simulation


def list_fitted(simulation: Simulation, ids: Sequence[str]) -> tuple[str, ...]:
    """Return those of `ids` that a fit can follow: not what the levels of the readings show."""
    return tuple(one for one in ids if not simulation.extended((one,)).mechanisms[-1].by_levels)


def without_steps(simulation: Simulation) -> Simulation:
    """Return a model whose readings are not rounded: no derivative shows what rounding does."""
    rounding = {one.id for one in simulation.mechanisms if one.by_levels}

    def value(one: FreeParameter) -> float:
        neutral = one.declared.neutral
        return one.value if neutral is None or one.mechanism not in rounding else neutral

    return simulation.with_values(np.array([value(one) for one in simulation.parameters]))
