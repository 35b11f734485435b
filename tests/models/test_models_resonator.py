"""A resonator's model from an oscillator's file: units are converted, what is missing is named."""

from __future__ import annotations

import cmath
import math
from pathlib import Path

import numpy as np
import pytest

from rtctl.border.errors import InputError
from rtctl.models.resonator import ResonatorModel, read_resonator

FILE = """
[model]
kind = "oscillator"
[model.parameters]
damping = { value = 0.11781, unit = "1/ms" }
stiffness = { value = 2.22066e9, unit = "1/s^2" }
stiffness_cubic = { value = 1.895e13, unit = "1/(mm^2*s^2)" }
drive_gain = { value = 37.4, unit = "m/s^2/A" }
[[model.mechanisms]]
id = "stiffness.quintic"
parameters = { coefficient = { value = 1e18, unit = "1/(mm^4*s^2)" } }
[[model.mechanisms]]
id = "sensor.offset"
parameters = { offset = { value = 1.0, unit = "um" } }
[provenance]
identity = "ME-A"
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "model.toml"
    path.write_text(text)
    return path


def test_units_are_um_seconds_and_mA(tmp_path: Path) -> None:
    model = read_resonator(written(tmp_path, FILE))
    assert model.damping == pytest.approx(117.81)
    assert model.cubic == pytest.approx(1.895e7)
    assert model.quintic == pytest.approx(1e6)
    assert model.drive_gain == pytest.approx(3.74e4)
    assert model.identity == "ME-A"
    assert model.indifferent == ("sensor.offset (constant)",)
    assert model.not_considered == ()


def test_a_cubic_mechanism_adds_to_the_nominal_stiffness(tmp_path: Path) -> None:
    more = '[[model.mechanisms]]\nid = "stiffness.cubic"\n' + (
        'parameters = { coefficient = { value = 1e6, unit = "1/(um^2*s^2)" } }\n'
    )
    model = read_resonator(written(tmp_path, FILE.replace("[provenance]", more + "[provenance]")))
    assert model.cubic == pytest.approx(1.995e7)
    assert model.indifferent == ("sensor.offset (constant)",)


def test_a_current_holds_an_amplitude_where_losses_and_drive_are_equal(tmp_path: Path) -> None:
    model = read_resonator(written(tmp_path, FILE))
    current = model.holding_current(0.7)
    assert model.drive_gain * current == pytest.approx(model.damping * model.resonance * 0.7)


@pytest.mark.parametrize("name", ["damping", "stiffness", "drive_gain"])
def test_what_the_tuning_cannot_do_without_is_named(name: str, tmp_path: Path) -> None:
    lines = [line for line in FILE.splitlines() if not line.startswith(f"{name} ")]
    with pytest.raises(InputError, match=rf"model.toml.*{name} must be > 0"):
        read_resonator(written(tmp_path, "\n".join(lines)))


def test_a_unit_that_does_not_fit_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="drive_gain"):
        read_resonator(written(tmp_path, FILE.replace("m/s^2/A", "m/s^2/V")))


def test_the_motion_is_what_drive_and_sensor_have_made_the_reading_of() -> None:
    """A displacement 90 deg behind the force, delayed, lagged and saturated, comes back."""
    model = ResonatorModel(
        damping=117.8, stiffness=2.22e9, cubic=0.0, quintic=0.0, drive_gain=3.74e4, identity="", delay_s=20e-6,
        sensor_lag_s=5e-6, drive_lag_s=3e-6, sensor_curvature=0.5,
    )  # fmt: skip
    hz, late = 7500.0, 2.0 * math.pi * 7500.0 * 20e-6
    force_lag = 1.0 / (1.0 + 2j * math.pi * hz * 3e-6)
    lags = force_lag / abs(force_lag) / (1.0 + 2j * math.pi * hz * 5e-6)
    sensed = -1j * 0.8 * lags * cmath.exp(-1j * late)
    turns = np.linspace(0.0, 2.0 * np.pi, 4096, endpoint=False)
    read = np.tanh(math.sqrt(0.5) * abs(sensed) * np.cos(turns)) / math.sqrt(0.5)
    first = 2.0 * np.mean(read * np.cos(turns))
    found = model.motion(sensed / abs(sensed) * first, hz)
    assert found == pytest.approx(-0.8j, abs=1e-6), "the drive's lag shrinks the force, not the motion"


def test_the_damping_of_an_amplitude_is_the_energy_that_a_cycle_loses() -> None:
    a, w, c, c2, cq, friction = 0.7, 47124.0, 117.8, 300.0, 1e-3, 2e5
    model = ResonatorModel(
        damping=c, stiffness=w * w, cubic=0.0, quintic=0.0, drive_gain=3.74e4, identity="", damping_squared=c2,
        damping_quadratic=cq, friction=friction,
    )  # fmt: skip
    turns = np.linspace(0.0, 2.0 * np.pi, 100_000, endpoint=False)
    z, v = a * np.cos(turns), -a * w * np.sin(turns)
    force = c * v + c2 * z**2 * v + cq * np.abs(v) * v + friction * np.sign(v)
    lost = np.mean(force * v)
    current = model.holding_current(a)
    given = 0.5 * 3.74e4 * current * a * w  # of a force in step with the velocity
    assert given == pytest.approx(lost, rel=1e-6)
