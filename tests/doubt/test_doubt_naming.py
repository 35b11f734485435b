"""A cause is named whose onset is known to a window only."""

from __future__ import annotations

import numpy as np
import pytest
from vo2_model_cases import small_model

from rtctl.doubt.belief import Rows
from rtctl.plants.vo2.doubt.explaining import Taken, explain
from rtctl.plants.vo2.doubt.free_run import Vo2Belief
from rtctl.plants.vo2.doubt.path_run import PathRun
from rtctl.plants.vo2.doubt.pure_phases import pure_phases
from rtctl.simulations.vo2.loop_dynamics import loop_dynamics


@pytest.mark.parametrize("late", [0, 90], ids=["at the onset", "most of a second later"])
@pytest.mark.parametrize(
    "off_um", [np.nan, 0.7], ids=["by the reading", "beside a reference with another past"]
)
def test_a_loss_of_gain_is_named_and_sized(late: int, off_um: float) -> None:
    n, onset, period_s = 1800, 1000, 0.01
    model, k = small_model(), np.arange(n, dtype=np.float64)
    levels = 6.3 + 1.4 * np.sin(2.0 * np.pi * 0.01 * k) + 0.5 * np.sin(2.0 * np.pi * 0.073 * k)
    path = PathRun(model, loop_dynamics(model))
    path.start(3.7)
    log_read, bent, _ = path.run(levels, np.full(n, period_s), np.zeros(n))
    noise = 1e-3 * np.random.default_rng(5).standard_normal(n)
    sensed = np.exp(log_read + noise) * np.where(k < onset + late, 1.0, 0.9)
    seen = bent + off_um + 0.05 * np.random.default_rng(6).standard_normal(n)
    rows = Rows(k, levels, np.full(n, period_s), sensed, seen, bent)
    taken = Taken(loop_dynamics(model), pure_phases(model), period_s)
    before = (1e-4, np.nan if np.isnan(off_um) else 0.05**2)
    nothing, best, *_ = explain(model, rows, onset, before, taken)
    assert best.id == "sensor.gain"
    assert best.size == pytest.approx(-0.1, abs=0.02)
    assert best.cost < 0.1 * nothing.cost


def test_what_moves_no_beam_says_nothing_about_the_reference() -> None:
    """Two copies that differ by rounding are one: along their difference any residual would look like something."""
    model, n = small_model(), 400
    levels = 6.3 + 1.4 * np.sin(0.05 * np.arange(n, dtype=np.float64))
    belief = Vo2Belief(model)
    belief.start(3.7)
    sensed = np.full(n, 5e4)
    seen = belief.predict(Rows(np.arange(n), levels, np.full(n, 0.01), sensed, np.zeros(n), np.zeros(n)))
    moved = dict(
        zip([one.id for one in belief.directions], np.abs(seen.output_answers).max(axis=0), strict=True)
    )
    read = dict(zip([one.id for one in belief.directions], np.abs(seen.answers).max(axis=0), strict=True))
    assert moved["sensor.lag"] == moved["sensor.gain"] == 0.0
    assert all(moved[name] > 0.0 for name in moved if not name.startswith("sensor."))
    assert all(read[name] > 0.0 for name in read)
