"""Oscillators with known parameters: simulated records with noise, as a fit takes them and as files hold them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Simulation, Stimulus
from rtctl.identification.fit_record import FitRecord
from rtctl.measured.dataset import Record
from rtctl.measured.writer import write_dataset
from rtctl.wiring_models import build_simulation

FloatArray = NDArray[np.float64]
UNITS = {"drive": "m/s^2", "displacement": "mm", "velocity": "mm/s"}
PARAMETER_UNITS = {
    "damping": "1/s",
    "stiffness": "1/s^2",
    "stiffness_cubic": "1/(mm^2*s^2)",
    "drive_gain": "mm/(s^2*(m/s^2))",
}
DUFFING = {"damping": 4.0, "stiffness": 8882.6, "stiffness_cubic": 400.0, "drive_gain": 1000.0}
"""15 Hz, Q 24."""
HM = {"damping": 0.3, "stiffness": -4275.6, "stiffness_cubic": 88.2, "drive_gain": 1000.0}
RM5 = {"damping": 0.9, "stiffness": -3558.6, "stiffness_cubic": 82.1, "drive_gain": 1000.0}
RM5_QUINTIC = -1.34e-2
"""1/(mm^4 s^2). HM and RM5: the bistable beam's paper."""


def oscillator(values: Mapping[str, float], quintic: float | None = None) -> Simulation:
    """Bound to mm and m/s^2; all parameters free."""
    parameters = {name: {"value": value, "unit": PARAMETER_UNITS[name]} for name, value in values.items()}
    tables: dict[str, object] = {"kind": "oscillator", "parameters": parameters}
    if quintic is not None:
        coefficient = {"value": quintic, "unit": "1/(mm^4*s^2)"}
        tables["mechanisms"] = [{"id": "stiffness.quintic", "parameters": {"coefficient": coefficient}}]
    return build_simulation(ModelFile.model_validate({"model": tables}), UNITS, "case")


def record_of(
    simulation: Simulation,
    drive: FloatArray,
    sample_rate_hz: float,
    noise_mm: float,
    seed: int,
    *,
    initial: Sequence[float] = (0.0, 0.0),
    velocity_noise: float | None = None,
    name: str = "r0",
) -> FitRecord:
    """One record of `simulation` from `initial` (mm, mm/s)."""
    draw = np.random.default_rng(seed)
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=1.0 / sample_rate_hz)
    values = np.array([parameter.value for parameter in simulation.parameters])
    run = simulation.predict(stimulus, values, np.array([initial]))
    clean = run.outputs["displacement"][0]
    measured = {"displacement": clean + noise_mm * draw.standard_normal(len(clean))}
    if velocity_noise is not None:
        measured["velocity"] = run.outputs["velocity"][0] + velocity_noise * draw.standard_normal(len(clean))
    peak = {"displacement": float(np.abs(measured["displacement"]).max())}
    driven = Stimulus(
        inputs={"drive": drive}, holds={"drive": "linear"}, period_s=1.0 / sample_rate_hz, peak=peak,
        initial={"displacement": initial[0], "velocity": initial[1]},
    )  # fmt: skip
    return FitRecord(name=name, stimulus=driven, measured=measured)


def tone(frequency_hz: float, amplitude: float, sample_rate_hz: float, duration_s: float) -> FloatArray:
    """A sine."""
    time_s = np.arange(round(duration_s * sample_rate_hz)) / sample_rate_hz
    return amplitude * np.sin(2.0 * np.pi * frequency_hz * time_s)


def multisine(
    low_hz: float, high_hz: float, rms: float, sample_rate_hz: float, duration_s: float, seed: int
) -> FloatArray:
    """Random phases, every second line of the record's spectrum in the band."""
    n = round(duration_s * sample_rate_hz)
    lines = np.arange(round(low_hz * duration_s), round(high_hz * duration_s), 2)
    spectrum = np.zeros(n // 2 + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(seed).random(len(lines)))
    drive = np.fft.irfft(spectrum, n)
    scaled: FloatArray = rms * drive / np.sqrt(np.mean(drive**2))
    return scaled


def beam_records(
    simulation: Simulation,
    runs: Sequence[tuple[float, float]],
    noise_mm: float,
    seed: int,
    sample_rate_hz: float,
    duration_s: float,
) -> list[FitRecord]:
    """The beam's protocol: 3.81 m/s^2 at each frequency [Hz] from each start [mm]."""
    return [
        record_of(
            simulation, tone(frequency, 3.81, sample_rate_hz, duration_s), sample_rate_hz, noise_mm, seed + k,
            initial=(start, 0.0), name=f"r{k}",
        )
        for k, (frequency, start) in enumerate(runs)
    ]  # fmt: skip


def free_values(simulation: Simulation) -> FloatArray:
    """Of the parameters that a fit moves."""
    return np.array([parameter.value for parameter in simulation.parameters if not parameter.fixed])


def write_records(folder: Path, records: Sequence[FitRecord], uses: Sequence[str] = ()) -> Path:
    """As a dataset on disk; its manifest."""
    return write_dataset(
        folder,
        name="oscillator case",
        plant="oscillator",
        records=[
            Record(
                name=record.name,
                period_s=record.period_s,
                signals={**record.stimulus.inputs, **record.measured},
                use=uses[k] if uses else "fit",
            )
            for k, record in enumerate(records)
        ],
        units=UNITS,
        holds={"drive": "linear"},
    )
