"""Any oscillator on a lock-in's bench: steady states by formula, the device's own effects, bad files."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from rtctl.border.errors import InputError
from rtctl.wiring import load_plant

BEAM = """[model]
kind = "oscillator"
[model.parameters]
damping = { value = 1178.1, unit = "1/s" }
stiffness = { value = 2.22066e9, unit = "1/s^2" }
drive_gain = { value = 3.74e4, unit = "um/s^2/mA" }
[device.drive]
unit = "mA"
[device.displacement]
unit = "um"
"""
BENCH = """[plant]
kind = "me"
name = "ME-T"
model = "beam.toml"
[coil]
current_high = "400 mA"
frequency_low = "6.5 kHz"
frequency_high = "8.5 kHz"
frequency_rest = "7.5 kHz"
[lock_in]
white = "0 um/Hz^0.5"
converter_range = "2 um"
converter_bits = 0
vibrometer = "0 um/Hz^0.5"
"""


def bench(folder: Path, mechanism: str = ""):
    (folder / "beam.toml").write_text(BEAM.replace("[device.drive]", f"{mechanism}\n[device.drive]"))
    (folder / "bench.toml").write_text(BENCH)
    return load_plant(folder / "bench.toml")


def settled(plant, current_mA: float, hz: float) -> tuple[complex, float]:
    for _ in range(60):
        (x, y), amplitude = plant.step((current_mA, hz), 4e-4)
    return complex(x, y), amplitude


def linear(current_mA: float, hz: float) -> complex:
    w = 2.0 * math.pi * hz
    return 3.74e4 * current_mA / (2.22066e9 - w * w + 1178.1j * w)


@pytest.mark.parametrize("hz", [7400.0, 7500.0, 7613.7])
def test_a_linear_beam_settles_where_its_formula_says(hz, tmp_path):
    phasor, amplitude = settled(bench(tmp_path), 100.0, hz)
    assert phasor == pytest.approx(linear(100.0, hz), abs=1e-5)
    assert amplitude == pytest.approx(abs(linear(100.0, hz)), abs=1e-5)


def test_a_late_drive_and_a_lagging_sensor_turn_the_reading_and_the_instrument_sees_the_motion(tmp_path):
    late = '[[model.mechanisms]]\nid = "drive.delay"\nparameters = { delay = { value = 17.3, unit = "us" } }'
    lag = (
        '[[model.mechanisms]]\nid = "sensor.lag"\nparameters = { time_constant = { value = 8, unit = "us" } }'
    )
    phasor, amplitude = settled(bench(tmp_path, f"{late}\n{lag}"), 100.0, 7500.0)
    w, truth = 2.0 * math.pi * 7500.0, linear(100.0, 7500.0)
    turned = complex(math.cos(w * 17.3e-6), -math.sin(w * 17.3e-6)) / (1.0 + 1j * w * 8e-6)
    chords = 1e-3  # the sensor follows straight lines between 72 instants a cycle: (w h)^2 / 12 too little
    assert phasor == pytest.approx(truth * turned, rel=chords)
    assert amplitude == pytest.approx(abs(truth), abs=1e-5)


def test_a_saturating_sensors_harmonics_are_not_in_its_first(tmp_path):
    curved = "parameters = { curvature = { value = 4, unit = '1/um^2' } }"
    saturation = f'[[model.mechanisms]]\nid = "sensor.saturation"\n{curved}'
    phasor, amplitude = settled(bench(tmp_path, saturation), 400.0, 7500.0)
    from rtctl.models.describing import saturated_amplitude

    assert abs(phasor) == pytest.approx(saturated_amplitude(amplitude, 4.0), rel=2e-3)
    assert abs(phasor) < 0.97 * amplitude


def test_a_frequency_changes_without_a_jump_in_phase_and_a_reset_forgets(tmp_path):
    plant = bench(tmp_path)
    for hz in (7400.0, 7600.0, 7500.0):
        settled(plant, 200.0, hz)
    before = settled(plant, 200.0, 7500.0)
    plant.reset()
    after = settled(plant, 200.0, 7500.0)
    assert before[0] == pytest.approx(after[0], abs=1e-5)


def test_a_beam_that_is_not_there_or_in_other_units_is_named(tmp_path):
    (tmp_path / "bench.toml").write_text(BENCH)
    with pytest.raises(InputError, match=r'plant.model = "beam.toml": no such file beside it'):
        load_plant(tmp_path / "bench.toml")
    (tmp_path / "beam.toml").write_text(BEAM.replace('unit = "mA"', 'unit = "V"'))
    with pytest.raises(InputError, match="mA and um"):
        load_plant(tmp_path / "bench.toml")
