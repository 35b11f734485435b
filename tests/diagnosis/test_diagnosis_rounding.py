"""A converter's steps err on the mean, periodically in the motion: that is no gap of the model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, UNITS, answer_to, cause, device, measured, noise_drive, write_case

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.quantization import grid_level, quantization_step
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.report.pictures import before_after
from rtctl.diagnosis.residual.projection.quantization import changing_samples, rounding_error_directions
from rtctl.diagnosis.residual.projection.residual_rows import residual_rows
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.search.holdout_error import Gain
from rtctl.diagnosis.search.request import DiagnosisOptions
from rtctl.diagnosis.thresholds import ProblemThresholds, ResidualThresholds, Thresholds
from rtctl.diagnosis.verification.holdout_residual import explain_holdout_residual
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.measured import read_dataset
from rtctl.models.oscillator import read_oscillator_model
from rtctl.wiring_models import build_simulation

STEP_MM = 0.01
COARSE_MM = 0.3
LEVELS = ProblemThresholds()
DEFAULT = ResidualThresholds()
IDS = ("stiffness.cubic", "damping.quadratic", "friction.coulomb", "sensor.offset")


def ring_down(seed: int) -> FitRecord:
    """A pulse that rings down through the steps of the converter, with noise of a sixth of one."""
    rng = np.random.default_rng(seed)
    drive = np.zeros(3000)
    drive[10:60] = rng.uniform(8.0, 12.0)
    plant = device()
    values = np.array([one.value for one in plant.parameters])
    run = plant.predict(
        Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S), values
    )
    reading = STEP_MM * np.round(
        (run.outputs["displacement"][0] + rng.normal(scale=STEP_MM / 6.0, size=3000)) / STEP_MM
    )
    stimulus = Stimulus(
        inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S,
        initial={"displacement": float(reading[0])}, peak={"displacement": float(np.abs(reading).max())},
    )  # fmt: skip
    return FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}, first=1)


def examined(seed: int, thresholds: ResidualThresholds = DEFAULT) -> TestedHypothesis:
    records = tuple(ring_down(10 * seed + k) for k in range(3))
    problem = Problem(
        subject=subject_of("oscillator"), records=records, scales=estimate_scales(records), steps_per_period=64.0,
        thresholds=Thresholds(residual=thresholds),
    )  # fmt: skip
    nominal = fit_hypothesis(problem, device(), ())
    assert nominal is not None
    return run_residual_tests(nominal, problem, IDS)


def smallest_of_six(thresholds: ResidualThresholds = DEFAULT) -> list[float]:
    return sorted(examined(seed, thresholds).p_value for seed in range(1, 7))


def test_ring_downs_through_the_steps_show_nothing_wrong() -> None:
    assert smallest_of_six()[0] > 1e-2


@pytest.mark.slow
def test_without_the_error_of_the_steps_they_would() -> None:
    as_large_everywhere = ResidualThresholds(robust_below_excess=0.0, quantization_harmonics=0)
    assert smallest_of_six(as_large_everywhere)[2] < 1e-3


@pytest.mark.slow
def test_nor_do_samples_at_rest_say_how_large_the_noise_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "rtctl.diagnosis.residual.projection.residual_rows.changing_samples",
        lambda readings, *_: np.ones(len(readings), bool),
    )
    assert smallest_of_six()[0] > 1e-2  # of a noise that need not be as large everywhere
    assert smallest_of_six(ResidualThresholds(robust_below_excess=0.0))[2] < 1e-3


def test_readings_without_steps_are_left_as_they_are() -> None:
    readings = np.random.default_rng(0).standard_normal(400)
    readings[100:200] = readings[100]
    assert quantization_step([readings], LEVELS) == 0.0
    assert changing_samples(readings, 0.0, 20).all()
    assert len(rounding_error_directions(readings, 0.0, 2)) == 0


@pytest.mark.parametrize("scale", [1.0, 3e-7])
def test_the_step_is_that_of_the_grid_though_levels_are_skipped(scale: float) -> None:
    fast = scale * np.round(np.array([0, 7, 3, 40, 12, 41]).repeat(50).astype(float))
    assert quantization_step([fast], LEVELS) == pytest.approx(scale)
    assert quantization_step([fast, fast + 0.3 * scale], LEVELS) == 0.0
    assert quantization_step([np.zeros(50)], LEVELS) == 0.0


TIMES = np.arange(8000.0)
SWINGS = {
    "sine": np.sin(0.01 * TIMES),
    "ring-down": np.exp(-TIMES / 2000.0) * np.sin(0.05 * TIMES),
    "noise": np.random.default_rng(3).normal(size=8000),
    "at rest, then a sine": np.where(TIMES < 2500.0, 0.0, np.sin(0.01 * TIMES)),
    "two wells": 3.0 * np.sign(np.sin(0.003 * TIMES)) + 0.3 * np.sin(0.05 * TIMES),
}


@pytest.mark.parametrize("name", SWINGS)
@pytest.mark.parametrize("step", [0.02, 0.1])
def test_a_step_is_seen_below_noise_that_was_added_behind_it(name: str, step: float) -> None:
    noise = np.random.default_rng(4).normal(size=8000)
    swing = SWINGS[name]
    for share in (0.01, 0.1):
        readings = 0.3 * step + step * np.round(swing / step) + share * step * noise
        assert quantization_step([readings[:3000], readings[3000:]], LEVELS) == pytest.approx(step, rel=2e-3)
        level = grid_level(readings, step)
        assert level == pytest.approx(0.3 * step, abs=0.02 * step)
    assert quantization_step([step * np.round(swing / step) + 0.3 * step * noise], LEVELS) == 0.0
    assert quantization_step([swing + 0.01 * step * noise], LEVELS) == 0.0


def test_of_two_converters_one_behind_the_other_the_coarser_step_is_seen() -> None:
    """A display with few digits, its noise, and an analogue-to-digital converter of 10 bits that reads it."""
    noise, fine = np.random.default_rng(5).normal(size=8000), 2.0 / 2**10
    shown = 0.1 * np.round(SWINGS["sine"] / 0.1) + 0.002 * noise
    assert quantization_step([fine * np.round(shown / fine)], LEVELS) == pytest.approx(0.1, rel=2e-3)
    alone = fine * np.round((SWINGS["sine"] + 0.002 * noise) / fine)
    assert quantization_step([alone], LEVELS) == pytest.approx(fine)


def test_the_beginning_of_a_record_has_the_step_that_the_whole_record_shows(tmp_path: Path) -> None:
    """The first look took what rounding leaves for a finding, and the search used up its work.

    The drive is small at first: the beginning reaches few levels.
    """
    asymmetric = cause("stiffness.quadratic", coefficient=(3e3, "1/(mm*s^2)"))
    grows = np.where(np.arange(8000) < 6000, 0.25, 1.0)
    written = []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        drive = grows * noise_drive(seed, 8.0, 8000)
        exact = measured(device(asymmetric), drive, 0.0)
        rng = np.random.default_rng(seed)
        readings = COARSE_MM * np.round((exact + 0.002 * rng.standard_normal(8000)) / COARSE_MM)
        written.append((drive, readings + 3e-3 * COARSE_MM * rng.standard_normal(8000), use))
    records = tuple(
        FitRecord(
            name="r",
            stimulus=Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S),
            measured={"displacement": readings},
        )
        for drive, readings, use in written
        if use == "fit"
    )
    problem = Problem(subject=subject_of("oscillator"), records=records, scales=estimate_scales(records))
    assert problem.step("displacement") == pytest.approx(COARSE_MM, rel=2e-3)
    assert problem.initial_part(12_000).step("displacement") == 0.0
    known = problem.with_steps_of_all().initial_part(12_000)
    assert known.step("displacement") == problem.step("displacement")
    assert known.step("velocity") == 0.0, "no record has it"
    one_has = replace(
        records[0], measured={**records[0].measured, "velocity": records[0].measured["displacement"]}
    )
    some = replace(problem, records=(one_has, records[1])).with_steps_of_all()
    assert some.step("velocity") == pytest.approx(COARSE_MM, rel=2e-3)
    exact = fit_hypothesis(known, device(asymmetric), (), iterations=0)
    assert exact is not None
    rounding = Gain("displacement", "mm", 1.0, COARSE_MM / np.sqrt(12.0), 0.01 * COARSE_MM, 1.0, 1.0, 1.0)
    assert explain_holdout_residual(rounding, known, known.records, exact) is None, (
        "rounding is nothing to explain"
    )
    manifest = write_case(tmp_path, written)
    data, model = read_dataset(manifest), read_oscillator_model(tmp_path / "model.toml")
    ids = ["stiffness.quadratic", "sensor.quantisation", "friction.coulomb", "sensor.offset"]
    options = DiagnosisOptions(threads=1)
    found = diagnose(data, model, build_simulation(model, UNITS, "model.toml"), ids, options)
    assert found.verdict == "explained"
    assert {one.id for one in found.causes} == {"stiffness.quadratic", "sensor.quantisation"}
    assert not any("times the noise" in text for text in found.warnings), "what rounding leaves is no noise"
    shown = before_after(found)[0]
    assert np.sqrt(np.mean((shown.after - shown.measured) ** 2)) < 0.5 * COARSE_MM / np.sqrt(12.0)


def test_a_quiet_record_beside_loud_ones_is_thinned_for_every_hypothesis_alike() -> None:
    loud, quiet = ring_down(1), ring_down(2)
    drive = 0.05 * quiet.stimulus.inputs["drive"]
    weak = replace(
        quiet, name="weak", stimulus=replace(quiet.stimulus, inputs={"drive": drive}),
        measured={"displacement": STEP_MM * np.round(0.05 * quiet.measured["displacement"] / STEP_MM)},
    )  # fmt: skip
    problem = Problem(
        subject=subject_of("oscillator"),
        records=(loud, weak),
        scales=estimate_scales((loud, weak)),
        steps_per_period=64.0,
    )
    lengths = []
    for stiffness in (1.6e4, 2.4e4):
        found = fit_hypothesis(problem, device(stiffness=(stiffness, "1/s^2")), (), iterations=0)
        assert found is not None
        rows = residual_rows(problem, found)
        assert rows is not None
        lengths.append([row.residual.shape[1] for row in rows])
        assert run_residual_tests(found, problem, IDS).p_value >= 0.0
    assert lengths[0] == lengths[1]
    assert lengths[0][1] < 0.5 * lengths[0][0] < 0.5 * 3000


def test_a_noisy_drive_beside_readings_that_rest_on_a_step_is_no_error(tmp_path: Path) -> None:
    """Samples at rest are left out of the residual, and what the drive's noise does was compared with all samples."""
    rng, records = np.random.default_rng(4), []
    for k, use in enumerate(("fit", "test")):
        drive = noise_drive(k, 6.0)
        drive[len(drive) // 2 :] = 0.0
        reading = np.round(measured(device(), drive, noise=0.0) / 0.05) * 0.05
        records.append((drive + 0.05 * rng.standard_normal(len(drive)), reading, use))
    found = answer_to(tmp_path, records, "sensor.offset,drive.delay")
    assert found["verdict"] in ("adequate", "explained", "partly_explained")
