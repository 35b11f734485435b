"""Numbers far from all others are told where they may be codes or misread, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.measured.columns.outliers import describe_far_readings

K = np.arange(600)
MOTION = np.sin(0.1 * K)
NOISE = 0.01 * np.random.default_rng(1).standard_normal(600)
BLOW = NOISE + np.where(abs(K - 300) < 5, 40.0 * np.cos(0.3 * (K - 300)), 0.0)


def said(values: np.ndarray, *, is_input: bool = False) -> str:
    return describe_far_readings(values, "x", "mm", 0, is_input=is_input)


@pytest.mark.parametrize(
    ("rows", "code"), [([300], 9999.0), ([10, 20, 30], -999.25), (list(range(100, 160)), 1e6)]
)
def test_codes_are_told_with_their_rows(rows: list[int], code: float) -> None:
    told = said(np.where(np.isin(K, rows), code, MOTION))
    assert f"{code:.6g} mm" in told
    assert f"{rows[0]}" in told


def test_a_single_misread_input_is_told() -> None:
    assert "row 300" in said(np.where(K == 300, 9999.0, MOTION), is_input=True)


@pytest.mark.parametrize(
    "values",
    [
        MOTION,
        NOISE,
        BLOW,
        np.zeros(600),
        np.where(K == 0, 1e5, 100.0 + NOISE),
        np.where(K == 599, 1e5, 100.0 + NOISE),
    ],
)
def test_motions_blows_and_warm_ups_are_not(values: np.ndarray) -> None:
    assert said(values) == ""


def test_pulses_of_an_input_are_not() -> None:
    assert said(np.where(K % 10 == 0, 5.0, NOISE), is_input=True) == ""
    assert said(np.where(K % 10 == 0, 5.0, NOISE)) != ""
