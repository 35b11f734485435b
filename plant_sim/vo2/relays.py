"""Two banks of relays that follow a temperature: up where `field >= T_up`, down where `field <= T_down`.

`field = temperature + coupling (fraction - 1/2)`, and a switched relay moves the field of its bank the way it
switched itself: relays switch until none is left to (the smallest solution in the direction of travel, hence
the same after one long step as after many short ones).

A sorted bank needs no comparison with all its relays: `warmed` counts the T_up that lie at or below the
field, `warm` the T_down that lie below it; only relays that these two counters pass can switch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from plant_sim.kernels import compiled
from plant_sim.vo2.domains import Floats, Thresholds

WARMED, WARM, SWITCHED = 0, 1, 2
"""Columns of `Banks.counters`."""


class Banks(NamedTuple):
    """Relays of both transitions (rows); the first three never change."""

    t_up: Floats
    """Switching-up temperatures [degC], ascending in each row; relay j of a bank is the one with the j-th T_up."""
    t_down: Floats
    """Switching-down temperatures [degC], ascending in each row."""
    by_t_down: NDArray[np.int64]
    """Relay that has the j-th T_down."""
    is_up: NDArray[np.bool_]
    counters: NDArray[np.int64]


def banks(thresholds: Thresholds) -> Banks:
    """Return sorted banks with every relay down (counters at the far cold end)."""
    by_t_up = np.argsort(thresholds.t_up, axis=1, kind="stable")
    place_by_t_up = np.argsort(by_t_up, axis=1)
    by_t_down = np.argsort(thresholds.t_down, axis=1, kind="stable")
    return Banks(
        t_up=np.take_along_axis(thresholds.t_up, by_t_up, axis=1),
        t_down=np.take_along_axis(thresholds.t_down, by_t_down, axis=1),
        by_t_down=np.take_along_axis(place_by_t_up, by_t_down, axis=1),
        is_up=np.zeros(by_t_up.shape, dtype=np.bool_),
        counters=np.zeros((len(by_t_up), 3), dtype=np.int64),
    )


@compiled
def settle(
    t_up: Floats,
    t_down: Floats,
    by_t_down: NDArray[np.int64],
    is_up: NDArray[np.bool_],
    counters: NDArray[np.int64],
    temperature: float,
    coupling: float,
) -> float:
    """Switch one bank to `temperature` [degC] under `coupling` [K]; return its transformed fraction."""
    count = t_up.size
    warmed, warm, switched = counters[WARMED], counters[WARM], counters[SWITCHED]
    settled = False
    while not settled:
        before = switched
        field = temperature + coupling * (switched / count - 0.5)
        while warmed < count and t_up[warmed] <= field:
            if not is_up[warmed]:
                is_up[warmed] = True
                switched += 1
            warmed += 1
        while warmed > 0 and t_up[warmed - 1] > field:
            warmed -= 1
        while warm > 0 and t_down[warm - 1] >= field:
            warm -= 1
            if is_up[by_t_down[warm]]:
                is_up[by_t_down[warm]] = False
                switched -= 1
        while warm < count and t_down[warm] < field:
            warm += 1
        settled = switched == before
    counters[WARMED], counters[WARM], counters[SWITCHED] = warmed, warm, switched
    return float(switched / count)
