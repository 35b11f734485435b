"""The systems of the blind check: their model files say what the SciPy integration beside them does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hidden.truth import PLAIN, levels, simulate
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
