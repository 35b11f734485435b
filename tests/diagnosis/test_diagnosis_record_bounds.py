"""An amplitude that each record has of its own is bounded as those are that all records share."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import NOISE_MM, PERIOD_S, dataset_of, device, measured, noise_drive

from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.search.request import DiagnosisOptions
from rtctl.models.oscillator import read_oscillator_model
from rtctl.session.validation.model_validation import simulation_of


@pytest.mark.parametrize(("amplitude", "named"), [(20.0, True), (2000.0, False)])
def test_a_hum_of_many_times_the_motion_is_no_cause(amplitude: float, named: bool, tmp_path: Path) -> None:
    records = []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        drive = noise_drive(seed)
        hum = amplitude * NOISE_MM * np.sin(2.0 * np.pi * 50.0 * PERIOD_S * np.arange(len(drive)) + seed)
        records.append((drive, measured(device(), drive) + hum, use))
    data = dataset_of(tmp_path, *records)
    model = read_oscillator_model(tmp_path / "model.toml")
    simulation = simulation_of("oscillator", model, data, "m")
    limits = DiagnosisOptions().thresholds
    tight = replace(limits, problem=replace(limits.problem, most_scales=0.1)) if not named else limits
    found = diagnose(data, model, simulation, ("sensor.hum",), DiagnosisOptions(thresholds=tight))
    assert ([cause.id for cause in found.causes] == ["sensor.hum"]) is named
