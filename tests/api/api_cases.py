"""A simulated device with a spring that its nominal model lacks, and its data."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import rtctl

PERIOD_S = 1.0 / 500.0
MODEL = """
[model]
kind = "oscillator"
[model.parameters]
damping = { value = 8.0, unit = "1/s" }
stiffness = { value = 9000.0, unit = "1/s^2" }
stiffness_cubic = { value = 4000.0, unit = "1/(mm^2*s^2)" }
drive_gain = { value = 300.0, unit = "mm/s^2/V" }
"""
QUINTIC = """
[[model.mechanisms]]
id = "stiffness.quintic"
parameters = { coefficient = { value = 9000.0, unit = "1/(mm^4*s^2)" } }
"""
NOISE_MM = 2e-3


def simulated(model: Path, drive: np.ndarray) -> np.ndarray:
    from rtctl.border.simulation import Stimulus
    from rtctl.wiring_models import build_simulation

    bound = build_simulation(
        rtctl.read_model(model).content, {"drive": "V", "displacement": "mm"}, str(model)
    )
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
    values = np.array([parameter.value for parameter in bound.parameters])
    return bound.predict(stimulus, values).outputs["displacement"][0]


def write_bench(folder: Path) -> Path:
    """Write a model without the fifth-order spring that the device has, and the device's data <& more>."""
    from rtctl.measured.writer import write_dataset

    (folder / "model.toml").write_text(MODEL)
    (folder / "device.toml").write_text(MODEL + QUINTIC)
    records = []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        draw = np.random.default_rng(seed)
        drive = 30.0 * np.convolve(draw.standard_normal(2000), np.hanning(15), mode="same") / 15.0
        motion = simulated(folder / "device.toml", drive)
        motion += NOISE_MM * draw.standard_normal(len(motion))
        signals = {"drive": drive, "displacement": motion}
        records.append(rtctl.Record(name=f"r{seed}", period_s=PERIOD_S, signals=signals, use=use))
    write_dataset(
        folder, name="bench <& more>", plant="oscillator", records=records,
        units={"drive": "V", "displacement": "mm"}, holds={"drive": "linear"},
    )  # fmt: skip
    return folder
