"""The acceleration of the base as the input of an oscillator: held as its drive."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import odeint

import rtctl
from rtctl.border.errors import InputError

MANIFEST = """
[dataset]
name = "shaken beam"
plant = "oscillator"

[signals.{name}]
role = "input"
unit = "{unit}"
hold = "linear"
{more}
[signals.displacement]
role = "output"
unit = "mm"
"""
RECORD = """
[[records]]
file = "{file}"
sample_rate_hz = 500.0
use = "{use}"
"""
DAMPING, STIFFNESS = 6.0, 3600.0


@cache
def moved(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the acceleration of the base [m/s^2] and the displacement [mm] (1500,), with noise."""
    times, rng = np.arange(1500) / 500.0, np.random.default_rng(seed)
    phases = rng.uniform(0.0, 2.0 * np.pi, 8)
    base = sum(np.sin(2.0 * np.pi * (3.0 + 2.0 * k) * times + phases[k]) for k in range(8))
    base = base * np.minimum(times / 0.2, 1.0)

    def rate(t: float, y: Any) -> list[float]:
        return [y[1], -DAMPING * y[1] - STIFFNESS * y[0] - 1e3 * np.interp(t, times, base)]

    z = odeint(rate, [0.0, 0.0], times, tfirst=True, rtol=1e-8, atol=1e-8, hmax=2e-3)[:, 0]
    return base, z + rng.normal(scale=0.003, size=len(z))


def shaken(folder: Path, name: str = "base_acceleration", unit: str = "m/s^2", more: str = "") -> Path:
    """Write records of a beam, relative to its shaken base, by SciPy: z'' = - damping z' - stiffness z - a."""
    text = MANIFEST.format(name=name, unit=unit, more=more)
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        base, z = moved(seed)
        np.savez(folder / f"r{seed}.npz", **{name: base, "displacement": z})
        text += RECORD.format(file=f"r{seed}.npz", use=use)
    path = folder / "dataset.toml"
    path.write_text(text)
    return path


def test_its_gain_is_minus_one_and_the_model_follows(tmp_path: Path) -> None:
    manifest = shaken(tmp_path)
    data = rtctl.read_dataset(manifest)
    assert dict(data.units) == {"drive": "m/s^2", "displacement": "mm"}
    assert any("base" in one and "-1000 mm/s^2 for 1 m/s^2" in one for one in data.remarks)
    found = rtctl.identify(data)
    values = {name: one.value for name, one in found.model.parameters.items()}
    assert values["drive_gain"] == pytest.approx(-1000.0, rel=2e-3)  # mm/s^2 per m/s^2
    assert values["stiffness"] == pytest.approx(STIFFNESS, rel=2e-3)
    assert values["damping"] == pytest.approx(DAMPING, rel=2e-2)


@pytest.mark.parametrize(
    ("name", "unit", "more", "said"),
    [
        ("base_acceleration", "m/s", "", 'unit "m/s" is not compatible with m/s^2'),
        ("base_acceleration", "g", "", "standard gravity is"),
        ("base_acceleration", "m/s^2", '[signals.drive]\nrole = "input"\nunit = "V"\n', "are both there"),
        ("base_accelaration", "m/s^2", "", 'did you mean "base_acceleration"'),
    ],
)
def test_what_it_cannot_be_is_one_message(tmp_path: Path, name: str, unit: str, more: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        rtctl.read_dataset(shaken(tmp_path, name, unit, more))
    assert said in str(caught.value)


def test_acceleration_in_g_is_an_acceleration(tmp_path: Path) -> None:
    assert rtctl.read_dataset(shaken(tmp_path, unit="g_0")).units["drive"] == "g_0"
