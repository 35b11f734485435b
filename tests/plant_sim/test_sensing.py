"""Instruments: the converter's step, noise with the density that the file states, the same bits by seed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import welch

from plant_sim.sensing import NORMALS, OCTAVES, NoiseSource, drift

SENSE_A = 21e-6
STEP_OHM = 20.0 / 2**16 / SENSE_A


def is_float32(value: float) -> bool:
    return float(np.float32(value)) == value


def test_without_imperfections_a_reading_is_the_truth_in_float32(make_device, silent):
    device = make_device("vo2_a", silent)
    (resistance,), deflection = device.step((6.9,), 5e-3)
    assert resistance == pytest.approx(device.resistance_ohm, rel=1e-7)
    assert deflection == pytest.approx(device.deflection_um, rel=1e-7)
    assert is_float32(resistance)
    assert is_float32(deflection)


def test_readings_stand_on_the_converters_steps(make_device, silent):
    device = make_device("vo2_a", silent | {"sensing.converter_bits": 16})
    assert pytest.approx(14.53, abs=0.01) == STEP_OHM
    errors = []
    for current in np.linspace(3.7, 8.4, 400):
        (reading,), _ = device.step((float(current),), 1e-3)
        steps = reading / STEP_OHM
        assert steps == pytest.approx(round(steps), abs=1e-3)  # float32 of up to 9000 steps
        errors.append((reading - device.resistance_ohm) / STEP_OHM)
    assert np.abs(errors).max() == pytest.approx(0.5, abs=0.01)


def test_a_converter_beyond_its_end_stays_at_its_last_code(make_device, silent):
    keys = {"sensing.converter_bits": 16, "sensing.converter_range": "5 V", "sensing.white": "3 V"}
    device = make_device("vo2_a", silent | keys)
    readings = [device.measure()[0][0] for _ in range(400)]
    last_code_V = 5.0 * (1.0 - 2.0**-15)
    assert max(readings) == pytest.approx(last_code_V / SENSE_A, rel=1e-6)


def test_white_noise_has_the_stated_deviation(make_device, silent):
    device = make_device("vo2_a", silent | {"sensing.white": "300 uV", "sensing.reference": "0.05 um"})
    readings = np.array([(r, d) for (r,), d in (device.measure() for _ in range(4000))])
    five_deviations = 5.0 / math.sqrt(2.0 * 4000)  # relative, of a standard deviation's estimate
    assert readings[:, 0].std() == pytest.approx(300e-6 / SENSE_A, rel=five_deviations)
    assert readings[:, 1].std() == pytest.approx(0.05, rel=five_deviations)
    assert readings[:, 0].mean() == pytest.approx(device.resistance_ohm, abs=5.0 * 14.3 / math.sqrt(4000))


CORNERS_HZ = 0.0625 * 2.0 ** np.arange(OCTAVES)


def test_octaves_of_first_order_noise_add_up_to_one_over_f():
    """One-sided density of unit-variance octaves against `1/(f ln 2)`, at two octaves from either end."""
    frequency = np.geomspace(0.5, 80.0, 50)
    octaves = 2.0 / (np.pi * CORNERS_HZ) / (1.0 + (frequency[:, None] / CORNERS_HZ) ** 2)
    assert np.abs(octaves.sum(axis=1) * frequency * math.log(2.0) - 1.0).max() < 0.1


@pytest.mark.parametrize("dt_s", [1e-4, 1e-3, 4e-3])
def test_flicker_has_the_density_of_its_octaves_at_any_step(dt_s):
    """Against sampled first-order processes, `2 dt (1 - a^2) / |1 - a exp(-2 pi i f dt)|^2` each.

    63 Welch averages leave 13 % a line; neighbours in a Hann window correlate, so 1000 lines leave 0.6 %.
    """
    normals = np.random.default_rng(7).standard_normal((2**17, NORMALS))
    octaves = normals[0, :OCTAVES].copy()
    samples = np.array([drift(octaves, row, dt_s) for row in normals])
    frequency, density = welch(samples, fs=1.0 / dt_s, nperseg=2**12, detrend=False)
    decay = np.exp(-2.0 * np.pi * CORNERS_HZ * dt_s)
    response = np.abs(1.0 - decay * np.exp(-2j * np.pi * frequency[:, None] * dt_s)) ** 2
    expected = (2.0 * dt_s * (1.0 - decay**2) / response).sum(axis=1)
    ratio = (density / expected)[4:1004]
    assert ratio.mean() == pytest.approx(1.0, abs=0.03)
    assert ratio.std() < 0.2


def test_flicker_does_not_move_while_no_time_passes(make_device, silent):
    device = make_device("vo2_a", silent | {"sensing.flicker": "1e-2 1/Hz^0.5"})
    first = device.step((0.0,), 1e-3)
    assert device.measure() == first
    assert device.step((0.0,), 1e-3) != first


def test_flicker_of_the_resistance_is_relative_and_has_the_stated_density(make_device, silent):
    """Readings 100 s apart are independent; the variance is that of 14 octaves of `S(1 Hz) ln 2`."""
    device = make_device("vo2_a", silent | {"sensing.flicker": "1e-3 1/Hz^0.5"})
    readings = np.array([device.step((4.0,), 100.0)[0][0] for _ in range(4000)])
    expected = 1e-3 * math.sqrt(OCTAVES * math.log(2.0))
    assert readings.std() / device.resistance_ohm == pytest.approx(expected, rel=5.0 / math.sqrt(2.0 * 4000))


def readings(device, count: int = 600) -> list[object]:
    """More than one block of noise; with the reference, which no converter rounds."""
    return [device.step((6.5 + 0.5 * math.sin(0.1 * k),), 1e-3) for k in range(count)]


@pytest.mark.parametrize("name", ["vo2_a", "vo2_b", "vo2_l2p"])
def test_the_same_seed_gives_the_same_bits_and_reset_starts_again(make_device, name):
    device = make_device(name, seed=4)
    first = readings(device)
    assert first == readings(make_device(name, seed=4))
    device.reset()
    assert first == readings(device)


def test_another_seed_changes_every_reference_reading_but_not_the_film(make_device):
    one, other = make_device(seed=1), make_device(seed=2)
    pairs = list(zip(readings(one), readings(other), strict=True))
    assert all(a[1] != b[1] for a, b in pairs)
    assert one.deflection_um == other.deflection_um


def test_no_row_of_noise_is_used_twice():
    source = NoiseSource(3)
    values = [source.block[source.next_row(), 0] for _ in range(1000)]
    assert len(set(values)) == 1000
