"""So many samples as a diagnosis gets through; a model that it can run over them, or a message at once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, device, friction_case

from rtctl.border.errors import InputError
from rtctl.border.simulation import Stimulus
from rtctl.cli import main
from rtctl.diagnosis.problem.sample_budget import check_speed, truncate_records
from rtctl.diagnosis.thresholds import ScreeningThresholds, Thresholds
from rtctl.identification.fit_record import FitRecord

LIMITS = ScreeningThresholds()
MOST_SAMPLES, LEAST_SAMPLES = LIMITS.max_fit_samples, LIMITS.min_truncated_samples


def record(samples: int, name: str = "r") -> FitRecord:
    drive = np.linspace(0.0, 1.0, samples)
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
    return FitRecord(name=name, stimulus=stimulus, measured={"displacement": drive}, first=1)


def test_what_a_diagnosis_gets_through_is_left_as_it_is() -> None:
    records = (record(MOST_SAMPLES // 2), record(MOST_SAMPLES // 2))
    assert truncate_records(records, LIMITS) == (records, [])


def test_of_long_records_the_beginnings_are_used_and_that_is_said() -> None:
    kept, (said,) = truncate_records((record(300_000, "a"), record(100_000, "b"), record(500, "c")), LIMITS)
    assert [one.name for one in kept] == ["a", "b", "c"]
    assert sum(one.samples for one in kept) <= MOST_SAMPLES + LEAST_SAMPLES
    assert kept[0].samples == pytest.approx(3 * kept[1].samples, rel=1e-3)
    assert kept[2].samples == 500
    assert "400500 samples" in said
    assert "the first ones of each" in said


def test_of_very_many_records_some_are_used_evenly() -> None:
    kept, _ = truncate_records(tuple(record(1500, f"r{k}") for k in range(400)), LIMITS)
    names = [int(one.name[1:]) for one in kept]
    assert len(kept) == MOST_SAMPLES // LEAST_SAMPLES
    assert (names[0], names[-1]) == (0, 399)
    assert max(np.diff(names)) <= 5


def test_the_limits_are_those_that_are_given() -> None:
    limits = replace(LIMITS, max_fit_samples=600, min_truncated_samples=200)
    kept, (note,) = truncate_records(tuple(record(1000, f"r{k}") for k in range(5)), limits)
    assert [one.samples for one in kept] == [200, 200, 200]
    assert "more than the 600" in note


def test_a_model_that_is_run_at_once_passes() -> None:
    check_speed(device(), [record(2000)], "dataset.toml", Thresholds().budget.one_run)


def test_a_run_of_more_steps_than_allowed_is_refused() -> None:
    with pytest.raises(InputError, match="takes more than 1e-06 million"):
        check_speed(device(), [record(2000)], "dataset.toml", 1.0)


@pytest.mark.parametrize("factor", [1e-4, 1e-9])
def test_a_sample_rate_in_the_wrong_unit_is_a_message_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], factor: float
) -> None:
    manifest = friction_case(tmp_path)
    rate = 1.0 / PERIOD_S
    text = manifest.read_text()
    assert f"sample_rate_hz = {rate}" in text
    manifest.write_text(text.replace(f"sample_rate_hz = {rate}", f"sample_rate_hz = {factor * rate}"))
    command = [
        "diagnose",
        str(manifest),
        "--model",
        str(tmp_path / "model.toml"),
        "--out",
        str(tmp_path / "out"),
    ]
    assert main(command) == 2
    said = capsys.readouterr().err
    assert "dataset.toml" in said
    assert "in Hz" in said
    assert "Traceback" not in said
