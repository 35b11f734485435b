"""Between two wells a model with an error parts from the record; what it follows until then says what is missing."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, device, noise_drive

from rtctl.border.simulation import Simulation, Stimulus
from rtctl.diagnosis.nominal_fit.misfit.relative_misfit import relative_misfit
from rtctl.diagnosis.nominal_fit.nominal_fit import fit_nominal
from rtctl.diagnosis.nominal_fit.predictability import (
    WHOLE,
    _before_diverging,
    _share_after,
    count_unpredictable,
    cut_tests_of_another_course,
    cut_unpredictable,
    cut_unpredictable_tests,
    fit_followed_parts,
    period_of,
)
from rtctl.diagnosis.nominal_fit.whole_record_start import fit_from_starts
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.holdout_error import Gain, compute_free_run_error
from rtctl.diagnosis.thresholds import NominalFitThresholds
from rtctl.diagnosis.verification.holdout_residual import explain_holdout_residual
from rtctl.identification.fit_record import CONTINUATION_SAMPLES, FitRecord
from rtctl.identification.scales import estimate_scales

LIMITS = NominalFitThresholds()

DELAY = {"id": "drive.delay", "parameters": {"delay": {"value": 2e-3, "unit": "s"}}}
WELLS = {"stiffness": (-1.6e3, "1/s^2"), "stiffness_cubic": (30.0, "1/(mm^2*s^2)"), "damping": (3.0, "1/s")}
"""At 7.3 mm either way; it rocks in one at 9 Hz."""
SAMPLES = 4000


def record_of(plant: Simulation, seed: int, drive: np.ndarray) -> FitRecord:
    stimulus = Stimulus(
        inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S, initial={"displacement": 7.3}
    )
    values = np.array([one.value for one in plant.parameters])
    reading = plant.predict(stimulus, values, np.array([[7.3, 0.0]])).outputs["displacement"][0]
    reading = reading + 0.02 * np.random.default_rng(seed).standard_normal(SAMPLES)
    return FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}, first=1)


@cache
def hopping() -> tuple[Problem, Hypothesis]:
    """Three records of a device whose drive comes late, and the best that a model without knows of them."""
    plant = device(DELAY, **WELLS)
    drives = {seed: noise_drive(seed, level=4.0, samples=SAMPLES) for seed in (1, 2, 3)}
    records = tuple(record_of(plant, seed, drive) for seed, drive in drives.items())
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    nominal = fit_from_starts(problem, device(**WELLS), ())
    assert nominal is not None
    return problem, nominal


@pytest.mark.slow
def test_where_it_hops_the_beginnings_show_what_is_missing() -> None:
    problem, nominal = hopping()
    assert relative_misfit(problem, nominal) > LIMITS.close_misfit
    found = fit_followed_parts(problem, nominal)
    assert found is not None
    short, refitted = found
    kept = sum(record.samples for record in short.records)
    assert 0.1 * 3 * SAMPLES < kept < 0.9 * 3 * SAMPLES
    assert relative_misfit(short, refitted) < LIMITS.close_misfit
    for record in short.records:
        whole = next(one for one in problem.records if one.name == record.name)
        np.testing.assert_array_equal(
            record.measured["displacement"], whole.measured["displacement"][: record.samples]
        )
    examined = run_residual_tests(refitted, short, ("drive.delay", "friction.coulomb", "stiffness.quintic"))
    named = [one.mechanism != "" for one in examined.directions]
    removed = np.where(named, examined.projected.single(), 0.0)
    assert examined.directions[int(np.argmax(removed))].mechanism == "drive.delay"


@pytest.mark.slow
def test_what_is_followed_to_its_end_and_what_is_never_followed_is_left_alone() -> None:
    problem, nominal = hopping()
    noise = np.random.default_rng(0).standard_normal(SAMPLES)
    deaf = tuple(replace(one, measured={"displacement": noise}) for one in problem.records)
    assert fit_followed_parts(replace(problem, records=deaf), nominal) is None
    found = fit_followed_parts(problem, nominal)
    assert found is not None
    assert fit_followed_parts(*found) is None


@pytest.mark.parametrize("hops", [True, False])
def test_one_record_that_hops_is_enough_where_it_holds_most_of_the_error(hops: bool) -> None:
    """However small that is beside the motion of all records."""
    problem, nominal = hopping()
    found = fit_followed_parts(problem, nominal)
    assert found is not None
    short, followed = found
    record = problem.records[0]
    line = followed.sensitivity.linearise(
        record, followed.shared, followed.starts[0], problem.steps_per_period
    )
    assert line is not None
    reading = record.measured["displacement"].copy()
    reading[record.first :] += line.residual[0]
    reading[SAMPLES // 2 :] += 2.0 * float(np.std(reading)) * hops
    records = (*short.records, replace(record, measured={"displacement": reading}))
    more = replace(followed, starts=np.vstack((followed.starts, followed.starts[:1])))
    assert (_share_after(replace(short, records=records), more) > LIMITS.max_share_after) == hops


def test_a_band_limited_drive_is_cut_too_and_its_beginnings_know_what_came_after() -> None:
    problem, nominal = hopping()
    held = tuple(
        replace(one, stimulus=replace(one.stimulus, holds={"drive": "band-limited"}))
        for one in problem.records
    )
    found = fit_followed_parts(replace(problem, records=held), nominal)
    assert found is not None
    for record in found[0].records:
        whole = next(one for one in held if one.name == record.name).stimulus.inputs["drive"]
        known = np.concatenate((record.stimulus.inputs["drive"], record.stimulus.onward["drive"]))
        np.testing.assert_array_equal(known, whole[: len(known)])
        assert len(known) == min(len(whole), record.samples + CONTINUATION_SAMPLES)


@cache
def rocked_over() -> Problem:
    """A record that is rocked ever more until it gets over the ridge, again and again; one that stays in its well."""
    plant = device(**WELLS)
    time_s = PERIOD_S * np.arange(SAMPLES)
    rocking = np.sin(2.0 * np.pi * 7.0 * time_s)
    growing, gentle = (level * rocking for level in (np.linspace(0.1, 7.0, SAMPLES), np.full(SAMPLES, 0.3)))
    records = tuple(record_of(plant, k, drive) for k, drive in enumerate((growing, gentle)))
    return Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )


def test_what_next_to_nothing_decides_is_no_judge() -> None:
    problem = rocked_over()
    truth = fit_hypothesis(problem, device(**WELLS), (), iterations=0)
    assert truth is not None
    short = cut_unpredictable(problem, truth)
    assert count_unpredictable(problem, truth) == 1
    assert [one.samples < SAMPLES for one in short.records] == [True, False]
    assert count_unpredictable(short, truth) == 0
    assert cut_unpredictable(short, truth) is short
    record, kept = problem.records[0], short.records[0].samples
    values = truth.values_of(0)
    nudged = values.copy()
    nudged[[one.name for one in truth.simulation.parameters].index("stiffness")] *= 1.0 + 1e-5
    runs = truth.simulation.predict(
        record.stimulus, np.stack([values, nudged]), np.tile(truth.start(0), (2, 1))
    )
    apart = np.abs(np.diff(runs.outputs["displacement"], axis=0)[0]) / problem.size("displacement")
    assert apart[:kept].max() < 0.05 < 0.5 < apart[kept:].max()


def test_a_diagnosis_begins_before_that_and_says_so() -> None:
    problem, heard = rocked_over(), []
    found = fit_nominal(problem, device(**(WELLS | {"stiffness": (-1.59e3, "1/s^2")})), heard.append)
    assert "the nominal model as far as its motion is predictable" in heard
    assert found.uncut
    assert found.problem.samples < problem.samples
    assert [
        f"{found.problem.samples} of {problem.samples} samples were used" in one for one in found.notes
    ] == [True]
    assert relative_misfit(found.problem, found.nominal) < 0.02


def test_an_error_on_test_records_that_nobody_foresees_is_not_said_to_be_of_something_missing() -> None:
    problem = rocked_over()
    truth = fit_hypothesis(problem, device(**WELLS), (), iterations=0)
    assert truth is not None
    found = Gain("displacement", "mm", 9.0, 3.0, 0.02, 3.0, 2.0, 4.0)
    report = [explain_holdout_residual(found, problem, (record,), truth) for record in problem.records]
    assert ["1 of 1 records" in one.note for one in report if one] == [True, False]
    assert [one.is_gap for one in report if one] == [False, False]


def test_the_last_periods_of_a_record_that_is_cut_are_left_out_where_it_parts_already() -> None:
    problem = rocked_over()
    truth = fit_hypothesis(problem, device(**WELLS), (), iterations=0)
    assert truth is not None
    short = cut_unpredictable(problem, truth)
    period = period_of(problem, short.records[0])

    def parting(record: FitRecord) -> FitRecord:
        reading = record.measured["displacement"].copy()
        reading[-2 * period :] += np.linspace(0.0, 2.0, 2 * period)
        return replace(record, measured={"displacement": reading})

    parted = replace(short, records=tuple(parting(record) for record in short.records))
    first, second = (record.samples for record in short.records)
    assert _before_diverging(problem, short, truth) == [first, second]
    assert _before_diverging(problem, parted, truth) == [first - 2 * period, second]


def test_test_records_that_hop_are_scored_in_pieces_that_the_right_model_follows() -> None:
    problem, _ = hopping()
    wrong = device(**{**WELLS, "stiffness_cubic": (30.6, "1/(mm^2*s^2)")})
    nominal = fit_hypothesis(problem, wrong, (), iterations=0)
    assert nominal is not None
    chaotic = noise_drive(7, level=9.0, samples=SAMPLES)
    tests = (record_of(device(**WELLS), 7, chaotic),)
    pieces, note = cut_unpredictable_tests(problem, nominal, tests)
    assert f"of {len(pieces)} pieces of 4 periods" in note
    assert len(pieces) > 6
    errors = [compute_free_run_error(device(**WELLS), one, "displacement") for one in pieces]
    off = [compute_free_run_error(wrong, one, "displacement") for one in pieces]
    of_right, of_wrong = (float(np.sqrt(np.mean(np.concatenate(one) ** 2))) for one in (errors, off))
    assert of_right < 2.0 * 0.02
    assert of_wrong > 2.0 * of_right


def test_test_records_that_can_be_predicted_stay_whole() -> None:
    problem, nominal = hopping()
    calm = record_of(device(**WELLS), 7, noise_drive(7, level=0.2, samples=SAMPLES))
    assert cut_unpredictable_tests(problem, nominal, (calm,)) == ((calm,), WHOLE)
    held = replace(calm, stimulus=replace(calm.stimulus, holds={"drive": "band-limited"}))
    assert cut_unpredictable_tests(problem, nominal, (held,)) == ((held,), WHOLE)


def test_test_records_take_another_course_where_only_short_segments_are_followed() -> None:
    """A set that follows the fitted records is held to pieces of a test record that it follows for a while alone."""
    problem, _ = hopping()
    calm = tuple(record_of(device(**WELLS), seed, noise_drive(seed, 0.5, samples=SAMPLES)) for seed in (1, 2))
    calmly = replace(problem, records=calm)
    nearly = device(**{**WELLS, "stiffness_cubic": (30.01, "1/(mm^2*s^2)")})
    found = fit_hypothesis(calmly, nearly, (), iterations=0)
    assert found is not None
    wild = (record_of(device(**WELLS), 7, noise_drive(7, level=9.0, samples=SAMPLES)),)
    pieces, note = cut_tests_of_another_course(calmly, found, wild)
    assert f"of {len(pieces)} pieces of 4 periods" in note
    assert cut_tests_of_another_course(calmly, found, calm) == (calm, "")
    elsewhere = device(**{**WELLS, "stiffness": (-3.2e3, "1/s^2")})
    lost = fit_hypothesis(calmly, elsewhere, (), iterations=0)
    assert lost is not None
    assert relative_misfit(calmly, lost) > LIMITS.close_misfit
    assert cut_tests_of_another_course(calmly, lost, wild) == (wild, "")
