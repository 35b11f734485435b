"""Units written, validated and simulated by FMPy beside `rtctl simulate` of the same records."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

import rtctl
from rtctl import Record

SAMPLES = 400
NOMINAL = """
[model]
kind = "oscillator"
[model.parameters]
damping         = { value = 4.0, unit = "1/s" }
stiffness       = { value = 8882.6, unit = "1/s^2" }
stiffness_cubic = { value = CUBIC, unit = "1/(mm^2*s^2)" }
drive_gain      = { value = 300.0, unit = "mm/s^2/V" }
"""
MECHANISMS: dict[str, str] = {
    "stiffness.quadratic": 'coefficient = { value = 3e4, unit = "1/(mm*s^2)" }',
    "stiffness.cubic": 'coefficient = { value = 3e5, unit = "1/(mm^2*s^2)" }',
    "stiffness.quintic": 'coefficient = { value = 3e7, unit = "1/(mm^4*s^2)" }',
    "stiffness.parametric": 'coefficient = { value = 500.0, unit = "1/(V*s^2)" }',
    "stiffness.drift": 'rate = { value = 500.0, unit = "1/s^3" }',
    "stiffness.drift settling": 'rate = { value = 500.0, unit = "1/s^3" }, settling_time = { value = 0.3, unit = "s" }',
    "stiffness.viscoelastic": 'stiffness = { value = 2000.0, unit = "1/s^2" }, time_constant = { value = 20.0, unit = "ms" }',
    "damping.nonlinear": 'coefficient = { value = 300.0, unit = "1/(mm^2*s)" }',
    "damping.quadratic": 'coefficient = { value = 0.5, unit = "1/mm" }',
    "damping.asymmetric": 'coefficient = { value = 2.0, unit = "1/s" }',
    "damping.power": 'level = { value = 50.0, unit = "mm/s^2" }, exponent = { value = 1.5, unit = "dimensionless" }, speed = { value = 5.0, unit = "mm/s" }',
    "friction.coulomb": 'level = { value = 60.0, unit = "mm/s^2" }',
    "friction.coulomb smooth": 'level = { value = 60.0, unit = "mm/s^2" }, transition_speed = { value = 1.0, unit = "mm/s" }',
    "friction.stribeck": 'level = { value = 40.0, unit = "mm/s^2" }, excess = { value = 30.0, unit = "mm/s^2" }, transition_speed = { value = 1.0, unit = "mm/s" }',
    "friction.presliding": 'level = { value = 60.0, unit = "mm/s^2" }, displacement = { value = 0.03, unit = "mm" }',
    "hysteresis.bouc_wen": 'level = { value = 100.0, unit = "mm/s^2" }, displacement = { value = 0.03, unit = "mm" }, order = { value = 2.0, unit = "dimensionless" }',
    "mode.second beside": 'gain = { value = 100.0, unit = "mm/s^2/V" }, frequency = { value = 40.0, unit = "Hz" }',
    "mode.second carried": 'mass_ratio = { value = 0.2, unit = "dimensionless" }, frequency = { value = 40.0, unit = "Hz" }',
    "drive.harmonics": 'second = { value = 0.1, unit = "1/V" }, third = { value = 0.05, unit = "1/V^2" }',
    "drive.saturation": 'curvature = { value = 2.0, unit = "1/V^2" }',
    "drive.saturation clipped": 'clipped = { value = 0.9, unit = "dimensionless" }, limit = { value = 0.4, unit = "V" }',
    "drive.deadband": 'width = { value = 0.2, unit = "V" }',
    "drive.delay": 'delay = { value = 5.3, unit = "ms" }',
    "drive.delay whole": 'delay = { value = 4.0, unit = "ms" }',
    "drive.lag": 'time_constant = { value = 4.0, unit = "ms" }, settled = { value = 0.5, unit = "dimensionless" }',
    "drive.offset": 'offset = { value = 0.3, unit = "V" }',
    "input.gain_drift": 'rate = { value = 0.2, unit = "1/s" }',
    "input.gain_drift settling": 'rate = { value = 0.2, unit = "1/s" }, settling_time = { value = 0.3, unit = "s" }',
    "actuator.backlash": 'width = { value = 0.1, unit = "V" }',
    "actuator.hysteresis": 'density = { value = 0.6, unit = "1/V" }, fading = { value = 0.8, unit = "1/V" }',
    "actuator.hysteresis left": 'density = { value = 0.6, unit = "1/V" }, remanence = { value = -0.2, unit = "V" }',
    "sensor.saturation": 'curvature = { value = 30.0, unit = "1/mm^2" }, clipped = { value = 0.5, unit = "dimensionless" }, limit = { value = 0.08, unit = "mm" }',
    "sensor.offset": 'offset = { value = 0.02, unit = "mm" }',
    "sensor.lag": 'time_constant = { value = 3.0, unit = "ms" }',
    "sensor.highpass": 'rate = { value = 10.0, unit = "1/s" }',
    "sensor.hum": 'cosine = { value = 0.01, unit = "mm" }, sine = { value = 0.005, unit = "mm" }, frequency = { value = 50.0, unit = "Hz" }',
    "sensor.drift": 'rate = { value = 0.02, unit = "mm/s" }',
    "sensor.drift settling": 'rate = { value = 0.02, unit = "mm/s" }, settling_time = { value = 0.3, unit = "s" }',
    "sensor.quantisation": 'step = { value = 0.001, unit = "mm" }',
    "stiffness.clearance": 'gap = { value = 0.01, unit = "mm" }, centre = { value = 0.2, unit = "dimensionless" }',
    "stiffness.gravity": 'coefficient = { value = 3000.0, unit = "1/s^2" }, radian = { value = 0.1, unit = "mm" }',
    "stop.one_sided": 'above = { value = 2e4, unit = "1/s^2" }, place = { value = 0.03, unit = "mm" }, '
    'retardation_time = { value = 1e-3, unit = "s" }',
    "stop.two_sided": 'stiffness = { value = 2e4, unit = "1/s^2" }, lower = { value = -0.04, unit = "mm" }, upper = { value = 0.05, unit = "mm" }',
    "base.motion": 'cosine = { value = 50.0, unit = "mm/s^2" }, sine = { value = 20.0, unit = "mm/s^2" }, frequency = { value = 11.0, unit = "Hz" }',
}  # fmt: skip
"""Parameters of each mechanism of an oscillator that has a form in C; a word after the id tells cases apart."""


def oscillator(folder: Path, *cases: str, cubic: float = 6e5) -> Path:
    """Write the nominal oscillator with some mechanisms, and return its file."""
    text = NOMINAL.replace("CUBIC", repr(cubic))
    for case in cases:
        text += f'[[model.mechanisms]]\nid = "{case.split()[0]}"\nparameters = {{ {MECHANISMS[case]} }}\n'
    path = folder / f"oscillator-{len(cases)}-{cubic:g}.toml"
    path.write_text(text)
    return path


def oscillator_data(folder: Path, hold: str = "zero", period_s: float = 2e-3) -> rtctl.Dataset:
    """Return a record of two tones; its displacement tells a size alone."""
    t = period_s * np.arange(SAMPLES)
    drive = np.sin(2 * np.pi * 12 * t) + 0.5 * np.sin(2 * np.pi * 23 * t + 1)
    signals = {"drive": drive, "displacement": 0.12 * np.sin(2 * np.pi * 15 * t)}
    start = {"displacement": 0.0, "velocity": 0.0}
    record = Record(name="a", period_s=period_s, use="test", signals=signals, initial=start)
    units = {"drive": "V", "displacement": "mm"}
    return rtctl.write_dataset(
        folder / "data", [record], name="x", plant="oscillator", units=units, holds={"drive": hold}
    )


def free_runs(model: Path, data: rtctl.Dataset, folder: Path, version: str = "3.0") -> dict[str, float]:
    """Return, by output, how far a unit's run is from the simulation, in parts of its range."""
    import fmpy

    record, inputs = data.records[0], list(data.holds)
    simulated = rtctl.simulate(model, data).records[record.name].simulated
    unit = rtctl.export_fmu(model, folder / "unit.fmu", version=version, dataset=data)
    ran = fmpy.simulate_fmu(
        str(unit.path), stop_time=record.period_s * (record.samples - 1), step_size=record.period_s,
        output_interval=record.period_s, output=list(simulated), input=stimulus(record, data.holds, inputs),
    )  # fmt: skip
    assert len(ran) == record.samples
    return {
        name: float(np.abs(ran[name] - course).max() / max(np.ptp(course), 1e-300))
        for name, course in simulated.items()
    }


def stimulus(record: Record, holds: Mapping[str, str], inputs: list[str]) -> np.ndarray:
    """Return a record's inputs as FMPy takes them, with their slopes."""
    time_s = record.period_s * np.arange(record.samples)
    columns: dict[str, np.ndarray] = {"time": time_s}
    for name in inputs:
        course = record.signals[name]
        rise = np.append(np.diff(course), 0.0) / record.period_s
        columns |= {name: course, f"{name}_slope": rise if holds[name] == "linear" else 0.0 * rise}
    made = np.empty(record.samples, dtype=[(name, "f8") for name in columns])
    for name, course in columns.items():
        made[name] = course
    return made
