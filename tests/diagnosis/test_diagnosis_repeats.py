"""What repeats when an input is repeated is no noise, whatever it looks like; noise alone is told to be noise."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.residual.projection import RecordRows, project, residual_beyond_parameters
from rtctl.diagnosis.residual.testing.repeats import f_test_repeats
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import NoiseModel

FloatArray = NDArray[np.float64]
N = 2000


def p_value(seed: int, gap: float, repeats: int = 2, letter: str | None = "A") -> float | None:
    """Of AR(1) noise of RMS 1 on a motion, and a white gap of RMS `gap` that is the same in each record."""
    rng = np.random.default_rng(seed)
    motion, missed = 30.0 * np.sin(0.1 * np.arange(N)), gap * rng.standard_normal(N)
    noise = NoiseModel(np.array([-0.8]), 1.0)
    records, residuals = [], []
    for k in range(repeats):
        read = motion + missed + lfilter([1.0], [1.0, -0.8], rng.standard_normal(N))
        stimulus = Stimulus(inputs={"drive": motion}, holds={"drive": "zero"}, period_s=1e-3)
        records.append(
            FitRecord(name=str(k), stimulus=stimulus, measured={"displacement": read}, repeat=letter)
        )
        residuals.append((motion - read)[None])
    found = f_test_repeats(residuals, [noise], records, ["displacement"])
    return found.p_value if found else None


def test_noise_alone_has_p_values_that_are_uniform() -> None:
    found = np.array([p_value(seed, 0.0) for seed in range(200)])
    assert np.mean(found < 0.1) == pytest.approx(0.1, abs=3.0 * np.sqrt(0.09 / 200))
    assert np.mean(found < 0.5) == pytest.approx(0.5, abs=3.0 * np.sqrt(0.25 / 200))


@pytest.mark.parametrize("repeats", [2, 4])
def test_a_gap_of_no_shape_is_seen_because_it_repeats(repeats: int) -> None:
    p = p_value(1, 0.5, repeats)
    assert p is not None
    assert p < 1e-6


def test_what_the_models_own_parameters_follow_is_nothing_that_repeats() -> None:
    # finer steps than a fit's move the residual along them, in each record alike
    rng, noise = np.random.default_rng(3), [NoiseModel(np.empty(0), 1.0)]
    slope = np.sin(0.1 * np.arange(N))[None, None]
    stimulus = Stimulus(inputs={"drive": slope[0, 0]}, holds={"drive": "zero"}, period_s=1e-3)
    rows = [
        RecordRows(
            residual=slope[0] + rng.standard_normal((1, N)),
            shared=slope, local=np.exp(-0.01 * np.arange(N))[None, None], directions=np.zeros((0, 1, N)),
        )
        for _ in range(2)
    ]  # fmt: skip
    records = [
        FitRecord(name=str(k), stimulus=stimulus, measured={"displacement": row.residual[0]}, repeat="A")
        for k, row in enumerate(rows)
    ]
    as_it_is = f_test_repeats([row.residual for row in rows], noise, records, ["displacement"])
    beyond = f_test_repeats(
        residual_beyond_parameters(rows, project(rows, noise)), noise, records, ["displacement"]
    )
    assert as_it_is is not None
    assert as_it_is.p_value < 1e-6
    assert beyond is not None
    assert beyond.p_value > 0.05


def test_without_repeats_there_is_no_such_question() -> None:
    assert p_value(1, 0.5, repeats=1) is None
    assert p_value(1, 0.5, letter=None) is None
