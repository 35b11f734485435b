"""A served oscillator moves as the simulation of a record does, mechanisms and all; divergence is a sensor fault."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from plant_sim.oscillator.device_table import read_device_table
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.nominal import NOMINAL_PARAMETERS
from plant_sim.oscillator.plant import OscillatorPlant
from plant_sim.oscillator.streaming import cannot_stream
from rtctl.border.errors import InputError
from rtctl.border.model_file import ModelFile, read_model_file
from rtctl.border.records import DeviceStatus
from rtctl.border.simulation import Stimulus
from rtctl.wiring import load_plant

PERIOD_S = 1e-3
MODEL = """
[model]
kind = "oscillator"
[model.parameters]
damping = { value = 6.0, unit = "1/s" }
stiffness = { value = 9000.0, unit = "1/s^2" }
stiffness_cubic = { value = 3000.0, unit = "1/(mm^2*s^2)" }
drive_gain = { value = 3000.0, unit = "mm/s^2/V" }
"""
VALUES = {
    "stiffness.quadratic": "coefficient = { value = 900, unit = '1/(mm*s^2)' }",
    "stiffness.cubic": "coefficient = { value = 900, unit = '1/(mm^2*s^2)' }",
    "stiffness.quintic": "coefficient = { value = 900, unit = '1/(mm^4*s^2)' }",
    "stiffness.parametric": "coefficient = { value = 300, unit = '1/(V*s^2)' }",
    "stiffness.drift": "rate = { value = 700, unit = '1/s^3' }",
    "stiffness.viscoelastic": "stiffness = { value = 2000, unit = '1/s^2' }\n"
    "time_constant = { value = 20, unit = 'ms' }",
    "damping.nonlinear": "coefficient = { value = 5, unit = '1/(mm^2*s)' }",
    "damping.quadratic": "coefficient = { value = 0.05, unit = '1/mm' }",
    "friction.coulomb": "level = { value = 400, unit = 'mm/s^2' }",
    "mode.second": "gain = { value = 2000, unit = 'mm/s^2/V' }\nfrequency = { value = 40, unit = 'Hz' }\n"
    "mass_ratio = { value = 0.1, unit = 'dimensionless' }",
    "drive.harmonics": "second = { value = 0.1, unit = '1/V' }\nthird = { value = 0.05, unit = '1/V^2' }",
    "drive.saturation": "curvature = { value = 2, unit = '1/V^2' }",
    "drive.deadband": "width = { value = 0.4, unit = 'V' }",
    "drive.delay": "delay = { value = 2.3, unit = 'ms' }",
    "drive.lag": "time_constant = { value = 8, unit = 'ms' }",
    "drive.offset": "offset = { value = 0.7, unit = 'V' }",
    "sensor.saturation": "curvature = { value = 0.3, unit = '1/mm^2' }",
    "sensor.offset": "offset = { value = 0.2, unit = 'mm' }",
    "sensor.lag": "time_constant = { value = 6, unit = 'ms' }",
    "timing.skew": "late = { value = -2.3, unit = 'ms' }",
    "sensor.highpass": "rate = { value = 40, unit = '1/s' }",
    "sensor.crosstalk": "gain = { value = 0.2, unit = 'mm/V' }",
    "sensor.drift": "rate = { value = 0.2, unit = 'mm/s' }",
    "input.gain_drift": "rate = { value = 0.8, unit = '1/s' }",
    "sensor.hum": "cosine = { value = 0.1, unit = 'mm' }\nsine = { value = 0.05, unit = 'mm' }",
    "stiffness.clearance": "gap = { value = 0.3, unit = 'mm' }",
    "stop.one_sided": "above = { value = 40000, unit = '1/s^2' }\nplace = { value = 0.6, unit = 'mm' }\n"
    "retardation_time = { value = 1, unit = 'ms' }",
    "stop.two_sided": "stiffness = { value = 40000, unit = '1/s^2' }\nlower = { value = -0.5, unit = 'mm' }\n"
    "upper = { value = 0.6, unit = 'mm' }",
    "stiffness.gravity": "coefficient = { value = 6000, unit = '1/s^2' }\nradian = { value = 0.8, unit = 'mm' }",
    "base.motion": "cosine = { value = 700, unit = 'mm/s^2' }\nfrequency = { value = 12, unit = 'Hz' }",
    "actuator.backlash": "width = { value = 0.9, unit = 'V' }",
    "actuator.hysteresis": "density = { value = 0.3, unit = '1/V' }\nremanence = { value = 0.2, unit = 'V' }\n"
    "fading = { value = 0.4, unit = '1/V' }",
}


def model_file(folder: Path, *mechanisms: str, more: str = "") -> Path:
    tables = "".join(
        f'[[model.mechanisms]]\nid = "{name}"\n[model.mechanisms.parameters]\n{VALUES[name]}\n'
        for name in mechanisms
    )
    path = folder / "bench-rig.toml"
    path.write_text(MODEL + tables + more)
    return path


def played(plant: OscillatorPlant, drive: np.ndarray) -> np.ndarray:
    """Readings at the start and after each sample's hold."""
    first = plant.measure()[0][0]
    return np.array([first, *(plant.step((float(level),), PERIOD_S)[0][0] for level in drive[:-1])])


def recorded(path: Path, drive: np.ndarray, steps_per_period: float = 1024.0) -> np.ndarray:
    """The same drive as a record with a zero-order hold, simulated finely."""
    simulation = oscillator_simulation(
        read_model_file(path, "oscillator"), {"drive": "V", "displacement": "mm"}, "test"
    )
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "zero"}, period_s=PERIOD_S)
    values = np.array([parameter.value for parameter in simulation.parameters])
    found = simulation.predict(stimulus, values, steps_per_period=steps_per_period)
    return np.asarray(found.outputs["displacement"][0])


def drive_of(samples: int = 600) -> np.ndarray:
    rng = np.random.default_rng(8)
    drive = np.repeat(rng.uniform(-3.0, 3.0, samples // 5), 5)
    drive[:3] = 0.0  # at rest at first: a lag that settles on the first value settles where the device is
    return drive


@pytest.mark.parametrize("name", VALUES)
def test_each_mechanism_acts_in_the_device_as_in_a_record(name: str, tmp_path: Path) -> None:
    path, drive = model_file(tmp_path, name), drive_of()
    served, simulated = played(load_plant(path), drive), recorded(path, drive)
    nominal = recorded(model_file(tmp_path), drive)
    effect, error = np.abs(simulated - nominal).max(), np.abs(served - simulated).max()
    assert effect > 1e-2
    assert error < 2e-3 * effect


def test_several_at_once_act_in_the_order_of_their_stages(tmp_path: Path) -> None:
    names = ["drive.delay", "drive.deadband", "drive.lag", "mode.second", "sensor.lag", "sensor.offset"]
    path, drive = model_file(tmp_path, *names), drive_of()
    simulated = recorded(path, drive)
    assert np.abs(played(load_plant(path), drive) - simulated).max() < 2e-3 * np.abs(simulated).max()


def test_every_mechanism_streams_or_is_refused_by_name(tmp_path: Path) -> None:
    early = {"late": -1e-3, "before": 1.0}
    assert [name for name, one in MECHANISMS.items() if cannot_stream(one, early)] == ["input.hold"]
    refused = {
        "input.hold": "toward_linear = { value = 0.5, unit = 'dimensionless' }",
        "timing.skew": "late = { value = 2.3, unit = 'ms' }",  # what is yet to come
        "sensor.crosstalk": "gain = { value = 0.1, unit = 'mm/V' }\nbefore = { value = 0, unit = 'dimensionless' }",
    }
    for name, values in refused.items():
        with pytest.MonkeyPatch.context() as patch:
            patch.setitem(VALUES, name, values)
            path = model_file(tmp_path, name)
        with pytest.raises(InputError, match=rf'bench-rig.toml: mechanism "{name}" .* sample by sample'):
            load_plant(path)


def test_a_served_device_rounds_its_readings_as_a_record_does(tmp_path: Path) -> None:
    values = "step = { value = 50, unit = 'um' }\nlevel = { value = 0.01, unit = 'mm' }"
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(VALUES, "sensor.quantisation", values)
        path, drive = model_file(tmp_path, "sensor.quantisation"), drive_of()
        served, simulated = played(load_plant(path), drive), recorded(path, drive)
    off_grid = (served - 0.01) / 0.05
    assert off_grid == pytest.approx(np.round(off_grid), abs=1e-9)
    assert np.mean(np.abs(served - simulated) > 1e-9) < 0.01  # within the integrators' difference of an edge


def test_units_and_identity_come_from_the_file_or_from_its_parameters(tmp_path: Path) -> None:
    plain = load_plant(model_file(tmp_path))
    assert plain.identity == "bench-rig"
    assert [channel.unit for channel in (*plain.profile.commands, *plain.profile.sensed)] == [
        "volt",
        "millimeter",
    ]
    beam = load_plant(bundled_plant("beam_hm"))
    assert beam.identity == "BEAM-HM"
    assert beam.profile.commands[0].unit == "m/s^2"
    assert (beam.low, beam.high, beam.safe) == ((-20.0,), (20.0,), (0.0,))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("[device.drive]\nunit = 'm'\n", "model.parameters.drive_gain"),
        ("[device.drive]\nlow = '3 V'\nhigh = '1 V'\n", "low = 3 volt must be below high = 1 volt"),
        ("[device.displacement]\nnoise = '1 V'\n", 'key "device.displacement.noise"'),
        ("[device.displacement]\nrnge = '1 mm'\n", 'did you mean "range"'),
        ("[device]\nname = 'a name that is too long'\n", 'key "device.name"'),
    ],
)
def test_a_wrong_device_table_is_told_with_its_key(more: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"bench-rig\.toml") as refused:
        load_plant(model_file(tmp_path, more=more))
    assert words in str(refused.value)


def test_units_that_the_parameters_do_not_tell_are_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "ratio.toml"
    path.write_text(MODEL.replace('"mm/s^2/V"', '"1/s^2"').replace("mm^2", "V^2"))
    with pytest.raises(InputError, match=r'"device.drive.unit" is missing'):
        load_plant(path)


@pytest.mark.parametrize("name", ["beam_hm", "beam_rm5", "beam_rm5c"])
def test_the_bundled_beams_settle_in_a_well_of_the_paper(name: str) -> None:
    beam = load_plant(bundled_plant(name))
    for k in range(30_000):
        beam.step((3.81 * math.cos(2.0 * math.pi * 8.0 * 1e-3 * k) if k < 2000 else 0.0,), 1e-3)
    well = {"beam_hm": 6.9625, "beam_rm5": 6.607, "beam_rm5c": 6.9615}[name]
    readings = [abs(beam.measure()[0][0]) for _ in range(400)]
    assert np.mean(readings) == pytest.approx(well, abs=0.08)  # the slow ring-down of HM is not over
    assert np.std(readings) == pytest.approx(5e-3, rel=0.2)


def test_a_bistable_beam_powers_up_in_a_well() -> None:
    for name, well in {"beam_hm": 6.9625, "beam_rm5": 6.607, "beam_rm5c": 6.9615}.items():
        beam = load_plant(bundled_plant(name))
        beam.advance((0.0,), 10.0)
        assert beam.displacement == pytest.approx(well, abs=1e-3)


def test_a_mass_on_a_bistable_device_rests_with_it_at_power_up(tmp_path: Path) -> None:
    """It begins where the device is: at the origin it would pull at once."""
    path = model_file(tmp_path, "mode.second")
    path.write_text(path.read_text().replace("stiffness = { value = 9000.0", "stiffness = { value = -9000.0"))
    device = load_plant(path)
    assert device.displacement == pytest.approx(math.sqrt(3.0))
    device.advance((0.0,), 0.05)
    assert device.displacement == pytest.approx(math.sqrt(3.0), abs=1e-9)


def test_noise_repeats_with_the_seed_and_after_a_reset() -> None:
    beam = load_plant(bundled_plant("beam_hm"), 5)
    first = [beam.step((1.0,), 1e-3) for _ in range(20)]
    beam.reset()
    assert [beam.step((1.0,), 1e-3) for _ in range(20)] == first
    assert [load_plant(bundled_plant("beam_hm"), 6).step((1.0,), 1e-3) for _ in range(1)] != first[:1]


def test_a_long_hold_is_many_short_ones_and_no_time_is_nothing(tmp_path: Path) -> None:
    names = ["drive.delay", "drive.lag", "sensor.lag", "stiffness.viscoelastic"]
    once, often = load_plant(model_file(tmp_path, *names)), load_plant(model_file(tmp_path, *names))
    once.advance((1.0,), 3.0)
    for _ in range(3000):
        often.advance((1.0,), 1e-3)
    often.advance((-2.0,), 0.0)
    assert once.measure()[0][0] == pytest.approx(often.measure()[0][0], rel=1e-5)


def test_divergence_is_a_sensor_fault_until_the_power_is_cycled_and_does_not_hang(tmp_path: Path) -> None:
    path = tmp_path / "soft.toml"
    path.write_text(MODEL.replace('value = 3000.0, unit = "1/(mm', 'value = -3000.0, unit = "1/(mm'))
    plant = load_plant(path)
    device = SimulatedDevice(plant, clock=lambda: 0.0)
    device.set_clock(lockstep=True, period_us=1000)
    device.set_enable(True)
    statuses = [device.exchange((40.0,), sequence).status for sequence in range(1, 400)]
    assert not statuses[0] & DeviceStatus.SENSOR_FAULT
    assert statuses[-1] & DeviceStatus.SENSOR_FAULT
    assert plant.diverged
    plant.advance((0.0,), 1e6)
    assert math.isnan(plant.measure()[1])
    plant.reset()
    assert plant.measure() == ((0.0,), 0.0)


def test_beyond_its_range_the_sensor_has_no_reading(tmp_path: Path) -> None:
    plant = load_plant(model_file(tmp_path, more="[device.displacement]\nrange = '0.1 mm'\n"))
    reading, reference = plant.step((3.0,), 0.02)
    assert math.isnan(reading[0])
    assert reference > 0.1


def test_a_model_of_an_earlier_version_tells_them_too(tmp_path: Path) -> None:
    tables = {"drive_gain": {"value": 3.0, "unit": "(mm)/(s^2*((m/s^2)))"}}
    model = ModelFile.model_validate({"model": {"kind": "oscillator", "parameters": tables}})
    report = read_device_table(model, tmp_path / "model.toml")
    assert (report.displacement.unit, report.drive.unit) == ("mm", "m/s^2")


@pytest.mark.parametrize(("z", "u"), [("mm", "V"), ("mm", "m/s^2"), ("m/s", "N/(kg*m)")])
def test_a_model_that_the_program_wrote_tells_the_units_of_its_device(z: str, u: str, tmp_path: Path) -> None:
    """Compound ones too: an extended model is rehearsed on as it stands."""
    gain = next(one for one in NOMINAL_PARAMETERS if one.name == "drive_gain").unit_in(z=z, u=u, y=z)
    tables = {"drive_gain": {"value": 3.0, "unit": gain}}
    model = ModelFile.model_validate({"model": {"kind": "oscillator", "parameters": tables}})
    report = read_device_table(model, tmp_path / "model.toml")
    assert (report.displacement.unit, report.drive.unit) == (z, u)
