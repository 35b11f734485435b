"""Records of the campaign as a dataset for the diagnosis, and its answer.

The displacement and the base's acceleration (minus the derivative of the frame's velocity) come from polynomials of the
fourth order over 4 and 8 ms, which keep what is at 83 Hz, at 1 kHz.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from scipy.signal import savgol_filter

from rtctl.border.arrays import FloatArray
from rtctl.border.model_file import ModelFile
from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.search.request import DiagnosisOptions
from rtctl.measured import read_dataset
from rtctl.models.provenance import write_checked_model
from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import mark_of
from rtctl.recording import write_parquet
from rtctl.reproduce.bistable.protocol import RATE_HZ, Recorded
from rtctl.wiring_models import build_simulation, mechanism_ids

DECIMATION = 10
SECONDS = 8.0
"""Seconds of each record: a few dozen periods show its content."""
IGNORED = 2000
"""Samples in which a linear mode forgets that the model starts it at rest, while the record was in motion."""
ORDER, POINTS, DRIVE_POINTS = 4, 41, 81


def signals(one: Recorded, seconds: float) -> tuple[FloatArray, FloatArray]:
    """Return base acceleration [m/s^2] and displacement [mm] at 1 kHz."""
    samples = min(len(one.displacement), round(seconds * RATE_HZ) + 2 * DRIVE_POINTS)
    inner = slice(DRIVE_POINTS, samples - DRIVE_POINTS, DECIMATION)
    z = savgol_filter(one.displacement[:samples], POINTS, ORDER)
    slope = savgol_filter(one.frame_velocity[:samples], DRIVE_POINTS, ORDER, deriv=1, delta=1.0 / RATE_HZ)
    return np.asarray(-slope[inner] / 1000.0), np.asarray(z[inner])


def write_records(folder: Path, records: Sequence[Recorded], seconds: float, testing: int) -> Path:
    """Write a dataset of these records, the last `testing` for tests only; return the manifest."""
    tables = []
    for k, one in enumerate(records):
        u, z = signals(one, seconds)
        name = f"r{one.setting.number:03d}.parquet"
        write_parquet(
            folder / name,
            {"drive": u, "displacement": z},
            {"drive": "m/s^2", "displacement": "mm"},
            {},
            "reproduce",
        )
        use = "test" if k >= len(records) - testing else "fit"
        speed = float(np.polyfit(np.arange(9) / (RATE_HZ / DECIMATION), z[:9], 3)[-2])
        tables.append(
            {
                "file": name, "sample_rate_hz": RATE_HZ / DECIMATION, "use": use,
                "ignore_first": IGNORED,
                "conditions": {"frequency_hz": one.setting.frequency_hz},
                "initial": {"displacement": float(z[0]), "velocity": speed},
            }
        )  # fmt: skip
    manifest: dict[str, Any] = {
        "dataset": {"name": "bistable beam, flagged records", "plant": "oscillator"},
        "signals": {
            "drive": {"role": "input", "unit": "m/s^2", "hold": "band-limited"},
            "displacement": {"role": "output", "unit": "mm"},
        },
        "records": tables,
    }
    path = folder / "dataset.toml"
    with replacing(path, "reproduce") as partial:
        partial.write_text(
            f"# Written by {mark_of('reproduce')}\n\n{tomli_w.dumps(manifest)}", encoding="utf-8"
        )
    return path


def diagnosed(manifest: Path, model: ModelFile, mechanisms: Sequence[str] | None = None) -> dict[str, Any]:
    """Return the diagnosis's answer on a dataset, as `rtctl diagnose` writes it."""
    dataset = read_dataset(manifest)
    path = manifest.parent / "model.toml"
    write_checked_model(path, model)
    own = subject_of("oscillator").read_model(path)
    simulation = build_simulation(model, dataset.units, str(path))
    ids = tuple(mechanisms or mechanism_ids("oscillator"))
    found: dict[str, Any] = diagnose(dataset, own, simulation, ids, DiagnosisOptions()).json
    return found
