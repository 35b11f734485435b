"""The systems of the blind check: their model files say what the SciPy integration beside them does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hidden.truth import MOST_SHOWN, PLAIN, SHOWS, levels, simulate, size_that_shows
from hidden.unseen import UNSEEN

import rtctl
from rtctl import Record


@pytest.mark.parametrize("name", UNSEEN)
def test_the_model_file_moves_as_the_independent_integration_does(name: str, tmp_path: Path) -> None:
    system = UNSEEN[name]
    u = levels(system, seed=4, samples=60)[:, :1]
    y, _ = simulate(system, u, system.parameters, PLAIN)
    source, output = system.input[0], system.reading[0]
    data = rtctl.write_dataset(
        tmp_path, [Record(name="one", period_s=system.period_s, signals={source: u[:, 0], output: y[:, 0]})],
        name=name, plant="equations", units={source: system.input[1], output: system.reading[1]},
        holds={source: "zero"},
    )  # fmt: skip
    made = rtctl.simulate(system.path, data).records["one"].simulated[output]
    assert np.ptp(y) > 0.0
    np.testing.assert_allclose(made, y[:, 0], atol=2e-5 * np.ptp(y))


def test_an_effect_that_makes_another_device_beyond_some_size_stays_below_it() -> None:
    assert size_that_shows(lambda size: 40.0 * size) == pytest.approx(SHOWS / 40.0)
    broken = size_that_shows(lambda size: 8.0 * size if size < 0.45 else 1200.0)
    assert 8.0 * broken <= MOST_SHOWN
    assert 0.4 < broken < 0.45  # shows nothing like 12, and as much as it can


def test_an_effect_that_shows_much_at_any_size_is_taken_at_that_which_shows_least() -> None:
    assert size_that_shows(lambda size: 2e3 * (1.0 + size)) == pytest.approx(1e-4, rel=5.0)
