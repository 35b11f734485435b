"""The ME resonator: its equations against SciPy, its coil, its lock-in, its jumps, its end."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from me_cases import SILENT, me_file, phasor, settled, silent, solved
from scipy import integrate

from plant_sim.device import SimulatedDevice
from plant_sim.resonator.kernel import STATE, demodulated, half_grid, hold, langevin
from plant_sim.resonator.plant import MeResonator, kernel_parameters
from rtctl.border.errors import InputError
from rtctl.border.records import DeviceStatus


@pytest.mark.parametrize("name", ["me_a", "me_b"])
def test_it_is_the_equations_integrated_with_a_phase_that_goes_on_through_changes_of_frequency(
    name: str,
) -> None:
    device = me_file(name, SILENT)
    rest = device.coil.frequency_rest
    holds = [(300.0, rest, 1.23e-3), (120.0, rest + 37.0, 0.771e-3), (350.0, rest - 80.0, 2.0e-3)]
    plant = MeResonator(device)
    for current, frequency, duration in holds:
        plant.advance((current, frequency), duration)
    current_A, displacement, _ = solved(device, holds)
    assert plant.coil_current_mA == pytest.approx(1e3 * current_A, abs=2e-4 * 350.0)
    assert plant.displacement_um == pytest.approx(displacement, abs=2e-4 * 0.3)
    assert abs(displacement) > 0.02


def test_the_error_of_the_integration_is_far_below_the_phase_that_a_loop_holds() -> None:
    """RK4 at 80 steps a cycle: the frequency error (w h)^4 / 120 is 0.3 ppm, 2 mHz."""
    plant = silent(keys={"beam.stiffness_cubic": "0 1/(um^2*s^2)", "beam.quality": 1e6})
    plant.advance((100.0, 7500.0), 1e-3)
    plant.advance((0.0, 7500.0), 1e-3)
    plant.measure()
    first = phasor(plant.step((0.0, 7500.0), 1e-3))
    for _ in range(499):
        last = phasor(plant.step((0.0, 7500.0), 1e-3))
    turned = cmath.phase(last / first) / (2.0 * math.pi) / 0.499
    assert abs(turned) < 0.01, "Hz, against 7500"
    assert abs(last) == pytest.approx(abs(first) * math.exp(-math.pi * 7500.0 / 1e6 * 0.499), rel=1e-3)


def test_langevins_function_is_continuous_where_its_series_begins() -> None:
    a = np.array([1e-8, 0.1, 0.2999999, 0.3000001, 1.0, 5.0])
    expected = [integrate.quad(lambda x, b=b: math.exp(b * (x - 1)) * x, -1, 1)[0]
                / integrate.quad(lambda x, b=b: math.exp(b * (x - 1)), -1, 1)[0] for b in a]  # fmt: skip
    found = [langevin(b) for b in a]
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-16)
    assert [langevin(-b) for b in a] == [-value for value in found]


def test_the_magnetisation_is_the_papers() -> None:
    """Linear to 2.3 % at 1 mT, 20.8 % off at 3.5 mT (Ms = 159.15 kA/m, chi = 40)."""
    for field_mT, off in ((1.0, 0.023), (3.5, 0.208)):
        a = 3.0 * 40.0 * 1e-3 * field_mT / (4e-7 * math.pi) / 159.15e3
        assert 1.0 - langevin(a) / (a / 3.0) == pytest.approx(off, abs=0.002)


def test_in_the_linear_limit_the_outputs_are_the_transfer_function_against_the_true_current() -> None:
    keys = {"beam.stiffness_cubic": "0 1/(um^2*s^2)", "beam.quality": 100.0}
    device = me_file("me_a", keys)
    for frequency in (7400.0, 7500.0, 7580.0):
        omega, resonance = 2.0 * math.pi * frequency, 2.0 * math.pi * 7500.0
        current_mA = 1.0 / abs(1.0 + 1j * omega * device.coil.inductance / device.coil.resistance)
        field = device.coil.field * 1e-3 * current_mA / (4e-7 * math.pi)
        force = device.beam.drive * 40.0 * field
        expected = force / (resonance**2 - omega**2 + 1j * omega * resonance / 100.0)
        found = settled(silent(keys=keys), 1.0, frequency)
        assert abs(found - expected) < 3e-4 * abs(expected)


def test_at_resonance_the_displacement_is_90_degrees_behind_the_current() -> None:
    found = settled(silent(keys={"beam.stiffness_cubic": "0 1/(um^2*s^2)"}), 1.0, 7500.0)
    assert math.degrees(cmath.phase(found)) == pytest.approx(-90.0, abs=0.05)


def test_against_the_command_the_coils_lag_comes_on_top() -> None:
    keys = {"beam.stiffness_cubic": "0 1/(um^2*s^2)", "lock_in.reference": "command"}
    found = settled(silent(keys=keys), 1.0, 7500.0)
    lag = math.degrees(math.atan(2.0 * math.pi * 7500.0 * 0.1e-3 / 10.0))
    assert lag == pytest.approx(25.2, abs=0.1)
    assert math.degrees(cmath.phase(found)) == pytest.approx(-90.0 - lag, abs=0.05)


def test_a_steady_output_has_no_ripple_whatever_the_sample_period() -> None:
    """2 omega would show: a sample of 0.777 ms holds 5.83 cycles."""
    plant = silent()
    settled(plant, 5.0, 7490.0, 1.0)
    read = np.array([phasor(plant.step((5.0, 7490.0), 0.777e-3)) for _ in range(50)])
    assert abs(read - read.mean()).max() < 1e-6 * abs(read.mean())


def test_an_offset_of_the_displacement_does_not_reach_the_outputs() -> None:
    parameters = kernel_parameters(me_file())
    for name in ("stiffness", "cubic", "quintic", "damping", "force"):
        parameters[name] = 1e-12  # nothing moves the beam
    state, found = np.zeros(1, dtype=STATE), np.full(4, np.nan)
    state["displacement"] = 3.7
    hold(parameters, state, half_grid(), 0.1, 7500.0, 1.01e-3)
    assert demodulated(state, found) == pytest.approx(7 / 7500.0)
    assert abs(found[:2]).max() < 1e-12
    assert abs(complex(found[2], found[3])) > 0.08, "the current is seen"


def test_the_phase_reference_survives_a_current_of_zero() -> None:
    plant = silent()
    before = cmath.phase(settled(plant, 5.0, 7500.0))
    plant.step((0.0, 7500.0), 1e-3)
    ringing = phasor(plant.step((0.0, 7500.0), 1e-3))
    assert abs(ringing) > 1e-3
    assert cmath.phase(ringing) == pytest.approx(before, abs=math.radians(3.0))


def test_noise_falls_with_the_root_of_the_sample_period() -> None:
    for period in (0.5e-3, 2e-3):
        plant = MeResonator(me_file("me_a", {"lock_in.converter_bits": 0}), seed=4)
        readings = [plant.step((0.0, 7500.0), period) for _ in range(2000)]
        parts = np.array([sensed for sensed, _ in readings[1:]])
        expected = 2e-6 / math.sqrt(period)
        assert parts.std(axis=0) == pytest.approx([expected] * 2, rel=6.0 / math.sqrt(2 * 2000) + 0.07)


def test_the_converter_rounds_and_stays_at_its_end() -> None:
    coarse = {**SILENT, "lock_in.converter_bits": 8, "lock_in.converter_range": "0.2 um"}
    plant = MeResonator(me_file("me_a", coarse))
    found = settled(plant, 20.0, 7500.0)
    assert (found.imag * 128 / 0.2) == pytest.approx(round(found.imag * 128 / 0.2), abs=1e-6)
    assert settled(plant, 120.0, 7515.0, 1.0).imag == pytest.approx(-0.2)


def sweep(plant: MeResonator, frequencies: list[float]) -> dict[float, float]:
    """Amplitudes [um] of a slow open-loop sweep."""
    return {f: abs(settled(plant, 150.0 if plant.identity == "ME-A" else 110.0, f)) for f in frequencies}


@pytest.mark.parametrize("name", ["me_a", "me_b"])
def test_an_open_loop_sweep_jumps_and_the_jump_depends_on_its_direction(name: str) -> None:
    plant = silent(name)
    rest = plant.safe[1]
    offsets = range(-10, 31) if name == "me_a" else range(-30, 11)
    up = sweep(plant, [rest + k for k in offsets])
    down = sweep(plant, [rest + k for k in reversed(offsets)])
    apart = [f for f in up if abs(up[f] - down[f]) > 0.3]
    assert len(apart) >= 3, "two amplitudes at one frequency"
    for way in (list(up.values()), list(down.values())):
        assert np.abs(np.diff(way)).max() > 0.25, "a jump between neighbours 1 Hz apart"


def test_a_hold_that_nobody_has_looked_at_for_long_is_the_steady_state() -> None:
    watched, unwatched = silent(), silent()
    for _ in range(40):
        watched.advance((20.0, 7497.3), 0.1)
    unwatched.advance((20.0, 7497.3), 4.0)
    for plant in (watched, unwatched):
        plant.measure()
    one, two = (phasor(plant.step((20.0, 7497.3), 1e-3)) for plant in (watched, unwatched))
    assert abs(one - two) < 1e-6 * abs(one)


def test_a_beam_that_breaks_is_a_sensor_fault_and_stays_one() -> None:
    device = SimulatedDevice(silent(keys={"beam.broken_above": "0.2 um"}))
    device.set_clock(lockstep=True, period_us=1000)
    device.set_enable(True)
    readings = [device.exchange((300.0, 7500.0), k) for k in range(1, 60)]
    faulty = [bool(reading.status & DeviceStatus.SENSOR_FAULT) for reading in readings]
    assert not faulty[0]
    assert faulty[-1]
    assert math.isnan(readings[-1].sensed[0])
    assert math.isnan(readings[-1].reference)
    assert device.exchange((0.0, 7500.0), 99).status & DeviceStatus.SENSOR_FAULT


def test_a_beam_without_bound_ends_too() -> None:
    keys = {
        "beam.stiffness_cubic": "-2e9 1/(um^2*s^2)",
        "beam.broken_above": "1e6 um",
        "beam.drive": "5e4 um/s^2/(A/m)",
    }
    plant = silent(keys=keys)
    for _ in range(200):
        plant.advance((400.0, 7480.0), 1e-3)
    assert plant.diverged


def test_the_same_seed_repeats_and_a_reset_starts_over() -> None:
    plant = MeResonator(me_file())

    def run() -> list[float]:
        return [plant.step((30.0, 7500.0), 5e-4)[0][0] for _ in range(20)]

    first = run()
    plant.reset()
    assert run() == first
    assert MeResonator(me_file(), seed=9).step((30.0, 7500.0), 5e-4)[0][0] != first[0]


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"coil.frequency_low": "3 kHz"}, "coil.frequency_low"),
        ({"coil.frequency_rest": "9 kHz"}, "frequency_rest"),
        ({"beam.quality": 0.4}, "beam.quality"),
        ({"beam.drive": "3 um"}, "beam.drive"),
        ({"lock_in.reference": "coil"}, "lock_in.reference"),
    ],
)
def test_a_file_that_is_wrong_is_refused_with_its_key(keys: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        me_file("me_a", keys)
