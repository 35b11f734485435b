"""Blind: sweeps with a hidden effect, by harmonic balance: the diagnosis names it, or says that nothing is wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from sweep_cases import DAMPING, RATE, Sweep, noisy, nothing, response, sweeps, write_sweeps

import rtctl

CANDIDATES = [
    "stiffness.quintic",
    "damping.nonlinear",
    "damping.quadratic",
    "friction.coulomb",
    "drive.delay",
    "mode.second",
]
Force = Callable[[np.ndarray, np.ndarray], np.ndarray]


def diagnosed(folder: Path, made: list[Sweep], candidates: list[str]) -> rtctl.Diagnosis:
    path = write_sweeps(folder, made)
    return rtctl.diagnose(path, rtctl.identify(path).model, mechanisms=candidates)


def few_rows(force: Force = nothing) -> list[Sweep]:
    """Two rising sweeps to fit and one to test, each of 30 rows and on one branch."""
    rows = np.linspace(96.0, 104.0, 30)
    plan = ((0.03, "fit"), (0.12, "fit"), (0.08, "test"))
    return [
        Sweep(rows, drive, noisy(response(rows, drive, force), 0.002, seed), use)
        for seed, (drive, use) in enumerate(plan)
    ]


def test_a_hidden_quadratic_damping_is_named_with_its_size(tmp_path: Path) -> None:
    made = few_rows(lambda z, v: 0.02 * np.abs(v) * v)
    found = diagnosed(tmp_path, made, ["damping.quadratic"])
    assert [one.id for one in found.causes] == ["damping.quadratic"]
    coefficient = found.causes[0].parameters["coefficient"]
    assert abs(coefficient.value - 0.02) < coefficient.high - coefficient.low  # four standard errors
    assert found.gain is not None
    assert found.gain.after < 1.2 * 0.002
    assert any("sensor.offset" in one and "did not judge" in one for one in found.warnings)
    found.save(tmp_path / "out")
    assert "nominal model" in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("truth", "force"),
    [
        ("", nothing),
        ("stiffness.quintic", lambda z, v: 0.03 * RATE**2 * z**5),
        ("damping.nonlinear", lambda z, v: 0.8 * DAMPING * z**2 * v),
    ],
    ids=["nothing", "quintic", "nonlinear"],
)
def test_each_effect_is_named_among_the_others(tmp_path: Path, truth: str, force: Force) -> None:
    found = diagnosed(tmp_path, sweeps(force), CANDIDATES)
    if not truth:
        assert found.verdict == "adequate"
        return
    named = {one.id for one in found.causes}
    named |= {other for one in found.causes for other in one.indistinguishable_from}
    assert truth in named
    assert len(named) <= 2
