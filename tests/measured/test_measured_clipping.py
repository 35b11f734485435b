"""Readings that a sensor cut off are told from those of an axis that rests at the end of its travel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.screening.excitation_checks import note_clipping
from rtctl.diagnosis.thresholds import ScreeningThresholds
from rtctl.measured.clipping import find_cut_off
from rtctl.measured.dataset import Dataset, Record
from rtctl.measured.summary import summarise

T = np.arange(8000) * 1e-3
TRAVEL_M, ACCELERATION = 0.2, 1.6


def axis_at_rest(resolution_m: float, noise_m: float = 0.0, share: float = 1.0) -> FloatArray:
    """Moves to the end of a travel of 0.2 m and back at a constant acceleration, with a rest of 0.5 s at each end."""
    half = np.sqrt(TRAVEL_M / ACCELERATION)
    t = np.arange(0.0, half, 1e-3)
    away = 0.5 * ACCELERATION * t**2
    out = np.concatenate([away, TRAVEL_M - away[::-1]])
    cycle = np.concatenate([np.zeros(500), out, np.full(500, TRAVEL_M), out[::-1]])
    path = share * np.tile(cycle, 4) + noise_m * np.random.default_rng(3).standard_normal(4 * len(cycle))
    return resolution_m * np.round(path / resolution_m)


def cut(share: float, noise: float = 0.0, resolution: float = 0.0) -> FloatArray:
    """Twenty periods of a sine of 1 that is cut off at a share of its amplitude."""
    sine = np.sin(2.0 * np.pi * 2.5 * T + 0.3) + noise * np.random.default_rng(4).standard_normal(len(T))
    read = np.minimum(sine, share)
    return resolution * np.round(read / resolution) if resolution else read


def noted(values: FloatArray) -> list[str]:
    record = Record(name="r", period_s=1e-3, signals={"displacement": values})
    return note_clipping([record], "displacement", "m", ScreeningThresholds())


def first_sight(values: FloatArray) -> str:
    record = Record(
        name="r",
        period_s=1e-3,
        signals={"drive": np.sin(1e-3 * np.arange(len(values))), "displacement": values},
    )
    dataset = Dataset(
        path=Path("nowhere.toml"), name="axis", plant="oscillator", units={"drive": "V", "displacement": "m"},
        holds={"drive": "linear"}, records=(record,),
    )  # fmt: skip
    return " | ".join(summarise(dataset).notes)


@pytest.mark.parametrize(
    "values",
    [
        pytest.param(axis_at_rest(5e-7), id="a fine encoder"),
        pytest.param(axis_at_rest(2e-4), id="a coarse encoder"),
        pytest.param(axis_at_rest(1e-6, 3e-7), id="an encoder that flickers"),
        pytest.param(axis_at_rest(5e-7)[::-1], id="backwards"),
    ],
)
def test_an_axis_that_rests_at_the_end_of_its_travel_is_not_clipped(values: FloatArray) -> None:
    for sign in (1.0, -1.0):
        assert find_cut_off(sign * values) == []
    assert noted(values) == []
    assert "clipped" not in first_sight(values)


@pytest.mark.parametrize(
    "values",
    [
        pytest.param(cut(0.5), id="at half"),
        pytest.param(cut(0.98), id="just below its peak"),
        pytest.param(cut(0.9, noise=0.01), id="with noise before the converter"),
        pytest.param(cut(0.9, resolution=0.01), id="of few levels"),
        pytest.param(-cut(0.7), id="from below"),
        pytest.param(np.minimum(axis_at_rest(5e-7, share=1.3), TRAVEL_M), id="an axis beyond its encoder"),
    ],
)
def test_a_motion_that_is_cut_off_is(values: FloatArray) -> None:
    (said,) = noted(values)
    assert "the sensor is clipped" in said
    assert "clipped?" in first_sight(values)
