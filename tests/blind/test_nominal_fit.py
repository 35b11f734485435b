"""Nothing hidden: the re-fitted nominal model reaches the noise, also where whole records have many minima."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from calibration import nominal_of
from generator import generate

pytestmark = pytest.mark.slow  # the cases are made by hand and weekly, and so is what makes them checked


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(100_249, id="hops between two wells"),
        pytest.param(100_248, id="short stretches of which some escape"),
    ],
)
def test_the_nominal_model_is_fitted_down_to_the_noise(seed: int, tmp_path: Path) -> None:
    truth = generate(seed, tmp_path, kind="null", samples=4000)
    nominal, data = nominal_of(tmp_path)
    samples = sum(record.samples - record.first for record in data.records)
    left = data.size("displacement") * np.sqrt(2.0 * nominal.cost / samples)
    assert left == pytest.approx(truth.noise.rms, rel=0.1)
