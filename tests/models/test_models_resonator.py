"""A resonator's model from an oscillator's file: units are converted, what is missing is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from rtctl.border.errors import InputError
from rtctl.models.resonator import read_resonator

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
    assert model.not_considered == ("sensor.offset",)


def test_a_cubic_mechanism_adds_to_the_nominal_stiffness(tmp_path: Path) -> None:
    more = '[[model.mechanisms]]\nid = "stiffness.cubic"\n' + (
        'parameters = { coefficient = { value = 1e6, unit = "1/(um^2*s^2)" } }\n'
    )
    model = read_resonator(written(tmp_path, FILE.replace("[provenance]", more + "[provenance]")))
    assert model.cubic == pytest.approx(1.995e7)
    assert model.not_considered == ("sensor.offset",)


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
