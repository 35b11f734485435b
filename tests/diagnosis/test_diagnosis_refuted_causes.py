"""A cause that another decay refutes is left out, and the search is repeated without it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rtctl.api.diagnosing import diagnose
from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.diagnose import diagnose as diagnose_records
from rtctl.diagnosis.search.request import DiagnosisOptions
from rtctl.measured import open_dataset, read_dataset
from rtctl.models.oscillator import read_oscillator_model
from rtctl.session.validation.model_validation import simulation_for

GRAVITY, DAMPING, PERIOD_S, NOISE_RAD = 31.0, 0.16, 1.0 / 150.0, 1e-3
MANIFEST = """
[dataset]
name = "pendulum"
plant = "oscillator"
[signals.drive]
role = "input"
unit = "N"
[signals.displacement]
role = "output"
unit = "rad"
"""
MODEL = """
[model]
kind = "oscillator"
[model.parameters]
damping = { value = 0.05, unit = "1/s" }
stiffness = { value = 31.0, unit = "1/s^2" }
drive_gain = { value = 1.0, unit = "rad/s^2/N" }
"""


def decay(begin_rad: float, samples: int, seed: int) -> FloatArray:
    """Angle of a pendulum that is let go at `begin_rad`, by steps of a fiftieth of a sample."""
    angle, speed, read = begin_rad, 0.0, np.empty(samples)
    step_s = PERIOD_S / 50
    for k in range(samples):
        read[k] = angle
        for _ in range(50):
            speed += step_s * (-GRAVITY * np.sin(angle) - DAMPING * speed)
            angle += step_s * speed
    return read + NOISE_RAD * np.random.default_rng(seed).standard_normal(samples)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two decays of a pendulum: from 1.6 rad, to fit, and from 0.9 rad, to test."""
    folder, tables = tmp_path_factory.mktemp("pendulum"), [MANIFEST]
    for k, (begin_rad, use) in enumerate(((1.6, "fit"), (0.9, "test"))):
        read = decay(begin_rad, 3000, k)
        rows = np.column_stack((np.zeros(len(read)), read))
        np.savetxt(folder / f"r{k}.csv", rows, delimiter=",", header="drive,displacement", comments="")
        tables.append(f'[[records]]\nfile = "r{k}.csv"\nsample_rate_hz = {1.0 / PERIOD_S}\nuse = "{use}"\n')
    (folder / "dataset.toml").write_text("".join(tables))
    (folder / "model.toml").write_text(MODEL)
    return folder


def test_what_another_decay_refutes_makes_room_for_what_it_hid(bench: Path) -> None:
    """A stiffness that settles in time fits one decay best; without it a law of the amplitude is seen to come near."""
    laws = ["stiffness.drift", "stiffness.quintic"]
    found = diagnose(bench / "dataset.toml", bench / "model.toml", mechanisms=laws).to_dict()
    assert found["causes"] == []  # neither is a sine
    repeated, nearest = (
        next(one for one in found["warnings"] if text in one)
        for text in ("the search was repeated without it", "comes nearest")
    )
    assert repeated.startswith("stiffness.drift")
    assert "stiffness.quintic" in nearest


def test_who_stops_the_repeated_search_is_told_that_it_was_stopped(bench: Path) -> None:
    options, ended = DiagnosisOptions(), []

    def report(text: str) -> None:
        if text == "one cause does not explain it":
            ended.append(text)
        if len(ended) == 2:
            options.cancellation.cancel()

    manifest, model = bench / "dataset.toml", bench / "model.toml"
    simulation = simulation_for(model, open_dataset(manifest))
    laws = ("stiffness.drift", "stiffness.quintic")
    found = diagnose_records(
        read_dataset(manifest), read_oscillator_model(model), simulation, laws, options, report
    )
    assert len(ended) == 2
    assert found.stopped
    assert found.causes == ()
