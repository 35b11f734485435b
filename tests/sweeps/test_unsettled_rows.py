"""Rows beyond a fold of the model: it has not settled there, and one of them outweighed all others of all causes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from sweep_cases import UP
from test_steady_state import UNITS, model, simulated, swept

from plant_sim.oscillator.model import simulation_of_data
from rtctl.diagnosis.residual.projection import RecordRows
from rtctl.identification.fit_record import FitRecord
from rtctl.plants.oscillator.steady import is_at_fold


def flagged(guide: np.ndarray, frequency_hz: np.ndarray, drive: float) -> np.ndarray:
    """Rows that tell nothing where the model is said to respond by `guide` (rows,)."""
    simulation: Any = simulation_of_data(model(), UNITS, "model")
    values = np.array([one.value for one in simulation.parameters])
    parts = np.column_stack([guide.real, guide.imag]).reshape(-1)
    record = FitRecord(
        name="r",
        stimulus=swept(frequency_hz, drive, guide={"displacement": parts}),
        measured={"displacement": parts},
    )
    hypothesis: Any = SimpleNamespace(
        simulation=simulation,
        sensitivity=SimpleNamespace(outputs=("displacement",)),
        values_of=lambda k: values,
    )
    problem: Any = SimpleNamespace(records=(record,), steps_per_period=None)
    found = is_at_fold(hypothesis, problem, 0)
    np.testing.assert_array_equal(found[::2], found[1::2])
    return np.flatnonzero(found[::2])


def test_rows_on_a_branch_of_the_model_tell_something() -> None:
    own = simulated(model(), UP, 0.08)
    assert len(flagged(own, UP, 0.08)) == 0


def test_a_row_where_the_model_has_no_such_motion_tells_nothing() -> None:
    own = simulated(model(), UP, 0.08)
    own[30] *= 1.15  # less than what another branch is looked for
    assert flagged(own, UP, 0.08).tolist() == [30]


def test_rows_that_tell_nothing_have_no_weight() -> None:
    ones = np.ones((2, 1, 6))
    rows = RecordRows(residual=ones[0], shared=ones, local=ones, directions=ones)
    left = rows.without(np.array([False, True, True, False, False, False]))
    for part in (left.residual, left.shared, left.local, left.directions):
        assert part.sum() == 4.0 * part[..., 0].size
        assert not part[..., 1:3].any()
