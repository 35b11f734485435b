"""The baselines do what they are said to do: SINDy finds a clean effect by its term, and always names something."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from sindy import LIBRARY, sindy

from rtctl.border.simulation import Stimulus
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales

pytestmark = pytest.mark.slow  # the cases are made by hand and weekly, and so is what makes them checked

PERIOD_S = 0.02
SAMPLES = 6000


def data(restoring: float, friction: float, noise: float) -> SimpleNamespace:
    """z'' + 0.2 z' + z + restoring z^2 + friction tanh(30 z') = u, by small steps; 314 samples a period."""
    rng = np.random.default_rng(4)
    t = PERIOD_S * np.arange(SAMPLES)
    u = 0.3 * sum(np.sin(f * t + rng.uniform(0, 6)) for f in (0.37, 0.71, 1.13, 1.59))
    z, v, seen = 0.0, 0.0, np.empty(SAMPLES)
    for k in range(SAMPLES):
        seen[k] = z
        for step in range(4):
            drive = u[k] + (u[min(k + 1, SAMPLES - 1)] - u[k]) * (step + 0.5) / 4
            v += PERIOD_S / 4 * (drive - 0.2 * v - z - restoring * z * z - friction * np.tanh(30.0 * v))
            z += PERIOD_S / 4 * v
    stimulus = Stimulus(
        inputs={"drive": u},
        holds={"drive": "linear"},
        period_s=PERIOD_S,
        initial={"displacement": 0.0},
        peak={},
    )
    measured = {"displacement": seen + noise * seen.std() * rng.normal(size=SAMPLES)}
    records = (FitRecord(name="r", stimulus=stimulus, measured=measured),)
    return SimpleNamespace(records=records, scales=estimate_scales(records))


@pytest.mark.parametrize(
    ("restoring", "friction", "expected"),
    [(0.15, 0.0, "stiffness.quadratic"), (0.0, 0.15, "friction.coulomb")],
)
def test_sindy_names_an_effect_without_noise(restoring: float, friction: float, expected: str) -> None:
    found = sindy(data(restoring, friction, 1e-5), cubic=False)
    assert expected in [one["id"] for one in found["causes"]]


def test_sindy_names_each_id_once() -> None:
    found = sindy(data(0.15, 0.15, 1e-3), cubic=True)
    names = [one["id"] for one in found["causes"]]
    assert len(names) == len(set(names))
    assert "x^3" not in found["terms"]  # a parameter of that nominal model, no effect
    assert {name for term in LIBRARY for name in term.ids} >= set(names)
