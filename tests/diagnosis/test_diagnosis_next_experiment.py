"""The proposed experiment separates what the data could not, better than others of the menu, and runs as written."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis_cases import MODEL, PERIOD_S, SAMPLES, UNITS, device, measured, noise_drive
from scipy.optimize import least_squares

from rtctl.border.simulation import Stimulus
from rtctl.cli import main
from rtctl.diagnosis.experiment_design.candidate_inputs import (
    find_drive_range,
    limit_band,
    list_candidate_inputs,
)
from rtctl.diagnosis.experiment_design.design import Design, ScoredInput, choose_design, find_design
from rtctl.diagnosis.experiment_design.next_experiment import (
    NextExperiment,
    _choose_inputs,
    propose_experiment,
)
from rtctl.diagnosis.experiment_design.t_optimality import (
    Comparison,
    RivalTerms,
    compare_candidates,
    count_common_samples,
)
from rtctl.diagnosis.problem.bounds import clip_to_bounds
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.report.files import scenario_text
from rtctl.diagnosis.thresholds import Thresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import NoiseModel
from rtctl.identification.scales import estimate_scales
from rtctl.measured import open_dataset, read_dataset
from rtctl.output.readable_units import readable
from rtctl.plants.oscillator.diagnosis import OSCILLATOR

LIMITS = Thresholds().experiment
NOISE_MM = 0.1
"""What the readings are judged by; they are computed without it, so that evidence is its expectation."""
NOISE = [NoiseModel(np.empty(0), NOISE_MM**2)]
TRUE = device({"id": "friction.coulomb", "parameters": {"level": {"value": 45.0, "unit": "mm/s^2"}}})
RIVALS = {"friction.coulomb": {"level": 40.0}, "damping.quadratic": {"coefficient": 0.001}}


def record_of(drive: np.ndarray, hold: str) -> FitRecord:
    reading = measured(TRUE, drive, noise=0.0, hold=hold)
    stimulus = Stimulus(
        inputs={"drive": drive}, holds={"drive": hold}, period_s=PERIOD_S,
        initial={"displacement": float(reading[0])}, peak={"displacement": float(np.abs(reading).max())},
    )  # fmt: skip
    return FitRecord(name="r", stimulus=stimulus, measured={"displacement": reading})


def candidate(problem: Problem, identity: str) -> Hypothesis:
    simulation = device().extended((identity,))
    values = np.array([p.value for p in simulation.parameters])
    for k, parameter in enumerate(simulation.parameters):
        if parameter.mechanism == identity:
            values[k] = RIVALS[identity].get(parameter.declared.name, parameter.value)
    found = fit_hypothesis(problem, clip_to_bounds(simulation, values), (identity,))
    assert found is not None
    return found


@cache
def ambiguous() -> tuple[Problem, tuple[Hypothesis, ...], NextExperiment]:
    """Weak friction under band noise of one level, its rivals, and what is proposed."""
    records = (record_of(noise_drive(1), "linear"),)
    problem = Problem(
        subject=OSCILLATOR, records=records, scales=estimate_scales(records), steps_per_period=64.0
    )
    rivals = tuple(candidate(problem, identity) for identity in RIVALS)
    proposed = propose_experiment(rivals, nominal(problem), problem, NOISE, UNITS)
    assert proposed is not None
    return problem, rivals, proposed


def nominal(problem: Problem) -> Hypothesis:
    found = fit_hypothesis(problem, device(), ())
    assert found is not None
    return found


def evidence(records: tuple[FitRecord, ...]) -> float:
    """Squares over the noise by which the rival is worse once both are re-fitted to `records`."""
    problem = Problem(
        subject=OSCILLATOR, records=records, scales=ambiguous()[0].scales, steps_per_period=64.0
    )
    true, rival = (candidate(problem, identity) for identity in RIVALS)
    readings = np.concatenate([r.measured["displacement"][r.first :] for r in records])
    return 2.0 * (rival.cost - true.cost) * float(np.mean(readings**2)) / NOISE_MM**2


def with_one_more(scored: ScoredInput) -> float:
    """Evidence of the data so far and a new record under this input."""
    return evidence((*ambiguous()[0].records, record_of(scored.input.levels, "linear")))


def test_the_separation_is_what_a_rival_that_is_fitted_to_old_and_new_data_leaves() -> None:
    rng = np.random.default_rng(5)
    true, rival, slopes = rng.standard_normal(80), rng.standard_normal(80), rng.standard_normal((4, 80))
    old = rng.standard_normal((3, 200))  # of three of the four: the fourth is the new record's own start
    rows = np.vstack((slopes.T, np.hstack((old.T, np.zeros((200, 1))))))
    wanted = np.append(true - rival, np.zeros(200))
    left = wanted - rows @ np.linalg.lstsq(rows, wanted)[0]
    pair = RivalTerms.of(true, rival, slopes, shared=3)
    assert pair.noncentrality(old @ old.T) == pytest.approx(float(left @ left), rel=1e-9)


def test_records_of_two_inputs_separate_as_the_rival_fitted_to_old_and_all_new_data_leaves() -> None:
    """Each record has a start of its own."""
    rng = np.random.default_rng(6)
    old = rng.standard_normal((3, 200))
    new = [(rng.standard_normal(80), rng.standard_normal(80), rng.standard_normal((4, 80))) for _ in range(2)]
    often = [new[0], new[1], new[1]]
    blocks = [np.hstack((old.T, np.zeros((200, 3))))]
    for k, (_, _, slopes) in enumerate(often):
        own = np.zeros((80, 3))
        own[:, k] = slopes[3]
        blocks.append(np.hstack((slopes[:3].T, own)))
    rows = np.vstack(blocks)
    wanted = np.concatenate([np.zeros(200), *(true - rival for true, rival, _ in often)])
    left = wanted - rows @ np.linalg.lstsq(rows, wanted)[0]
    one, other = (RivalTerms.of(*each, shared=3) for each in new)
    assert one.add(other, 2).noncentrality(old @ old.T) == pytest.approx(float(left @ left), rel=1e-9)


def test_a_parameter_that_a_new_record_does_not_tell_from_its_start_is_known_from_the_data_so_far() -> None:
    """An offset, where the record's own mean is free: rounding makes no number of nothing."""
    rng = np.random.default_rng(7)
    level, wave = np.full(80, 1e6), rng.standard_normal(80)
    slopes = np.stack((level, wave, 3.0 * level))
    pair = RivalTerms.of(rng.standard_normal(80), np.zeros(80), slopes, shared=2)
    assert pair.normal[0, 0] == pytest.approx(0.0, abs=1e-6)
    assert np.isfinite(pair.noncentrality(np.zeros((2, 2))))


def test_every_input_of_the_menu_stays_within_the_largest_drive_seen() -> None:
    problem, _, _ = ambiguous()
    low, high = find_drive_range(problem)
    largest = float(np.abs(problem.records[0].stimulus.inputs["drive"]).max())
    assert (low, high) == pytest.approx((-largest, largest))
    entries, longest = (
        list_candidate_inputs(problem, UNITS),
        min(LIMITS.max_samples, LIMITS.length_ratio * SAMPLES),
    )
    assert len(entries) == 63
    assert len({entry.statement for entry in entries}) == 63
    for entry in entries:
        assert low - 1e-9 <= entry.levels.min() < entry.levels.max() <= high + 1e-9
        assert 0.2 * longest < len(entry.levels) * entry.period_s / PERIOD_S <= 1.1 * longest


def test_slower_records_leave_the_motion_enough_samples_and_say_how_they_are_sampled() -> None:
    problem, _, _ = ambiguous()
    slower = [entry for entry in list_candidate_inputs(problem, UNITS) if entry.period_s > 1.5 * PERIOD_S]
    assert {round(entry.period_s / PERIOD_S) for entry in slower} == {2}
    assert all(f"a sample each {2 * PERIOD_S:g} s" in entry.statement for entry in slower)
    assert all(entry.scenario["excitation"][0]["period"] == "4000 us" for entry in slower)
    fast = problem.scales._replace(rate=2.0 * np.pi / (5.0 * PERIOD_S))  # 5 samples a period, slower 2.5
    assert not [
        e for e in list_candidate_inputs(replace(problem, scales=fast), UNITS) if e.period_s > 1.5 * PERIOD_S
    ]


def test_a_hold_is_told_from_a_delay_by_records_that_are_sampled_more_slowly() -> None:
    """A hold of levels is half a period late, whatever the period; a delay stays."""
    problem, _, _ = ambiguous()
    found = []
    for identity, size in (("input.hold", 1.0), ("drive.delay", 0.5 * PERIOD_S)):
        made = device().extended((identity,))
        values = np.array([p.value for p in made.parameters])
        values[[p.mechanism == identity for p in made.parameters].index(True)] = size
        one = fit_hypothesis(problem, made.with_values(values), (identity,), iterations=0)
        assert one is not None
        found.append(one)
    loud = [NoiseModel(np.empty(0), (10.0 * NOISE_MM) ** 2)]
    proposed = propose_experiment(found, nominal(problem), problem, loud, UNITS)
    assert proposed is not None
    assert proposed.best.input.period_s == pytest.approx(2.0 * PERIOD_S)
    as_fast = [one.separation for one in proposed.menu if one.input.period_s < 1.5 * PERIOD_S]
    assert proposed.best.separation > 3.0 * max(as_fast)


def test_a_band_limited_drive_begins_and_ends_at_rest_and_has_nothing_near_half_the_sample_rate() -> None:
    levels = np.where(np.random.default_rng(0).integers(0, 2, 2000) > 0, 1.0, -1.0)
    smooth = limit_band(levels, 20.0)
    power = np.abs(np.fft.rfft(smooth)) ** 2
    assert power[700:].sum() < 1e-3 * power[300:500].sum()
    assert power[:400].sum() > 0.8 * (np.abs(np.fft.rfft(levels)) ** 2)[:400].sum()
    assert abs(smooth[0]) + abs(smooth[-1]) < 0.02


def test_a_square_wave_has_the_frequency_that_it_is_said_to_have() -> None:
    problem, _, _ = ambiguous()
    waves = [
        entry
        for entry in list_candidate_inputs(problem, UNITS)
        if entry.statement.startswith("square wave of ")
    ]
    assert len(waves) == 27
    for wave in waves:
        report = float(wave.statement.removeprefix("square wave of ").split(" Hz")[0])
        turns = np.flatnonzero(np.diff(wave.levels) != 0.0)
        assert np.diff(turns) * wave.period_s == pytest.approx(0.5 / report, rel=1e-3)


def test_the_proposed_input_decides_where_the_data_did_not_and_better_than_a_random_one() -> None:
    problem, _, proposed = ambiguous()
    assert proposed.separates == tuple(RIVALS)
    so_far, chosen = evidence(problem.records), with_one_more(proposed.best)
    others = [with_one_more(one) for one in proposed.menu[1::4]]
    assert so_far < 9.0
    assert chosen > 25.0
    assert chosen > 1.5 * float(np.mean(others))
    assert chosen > 0.8 * max(others)
    promised = proposed.best.separation**2  # of the worse of both directions, linear in the rival
    assert 0.8 * promised < chosen - so_far < 2.0 * promised


def test_inputs_that_would_drive_the_device_too_far_are_not_proposed() -> None:
    problem, rivals, proposed = ambiguous()
    limits = replace(LIMITS, max_reach_ratio=1.0)
    careful_problem = replace(problem, thresholds=replace(problem.thresholds, experiment=limits))
    careful = propose_experiment(rivals, nominal(problem), careful_problem, NOISE, UNITS)
    assert careful is not None
    gone = {one.input.statement for one in proposed.menu} - {one.input.statement for one in careful.menu}
    limit = max(float(np.abs(r.measured["displacement"]).max()) for r in problem.records)
    for one in proposed.menu:
        if one.input.period_s > 1.5 * PERIOD_S:
            continue  # `measured` is of records at the period of the data
        reach = float(np.abs(measured(rivals[0].simulation, one.input.levels, noise=0.0, hold="zero")).max())
        assert one.input.statement in gone if reach > 1.02 * limit else True
    assert len(gone) > 2


def test_a_rival_that_each_record_has_its_own_numbers_of_is_separated_too() -> None:
    """A hum has a phase in every record; in the next one it is taken to be as large as in the first."""
    problem, (true, _), _ = ambiguous()
    humming = device().extended(("sensor.hum",))
    hum = fit_hypothesis(
        problem, humming, ("sensor.hum",), fixed_parameters=frozenset({"sensor.hum.frequency"})
    )
    assert hum is not None
    proposed = propose_experiment([hum, true], nominal(problem), problem, NOISE, UNITS)
    assert proposed is not None
    assert proposed.separates == ("sensor.hum", next(iter(RIVALS)))
    assert proposed.best.separation > 3.0


def with_noise(times: float, thresholds: Thresholds | None = None) -> NextExperiment:
    problem, rivals, _ = ambiguous()
    problem = replace(problem, thresholds=thresholds or problem.thresholds)
    proposed = propose_experiment(
        rivals, nominal(problem), problem, [NoiseModel(np.empty(0), (times * NOISE_MM) ** 2)], UNITS
    )
    assert proposed is not None
    return proposed


@pytest.mark.slow
def test_what_one_record_does_not_decide_is_measured_as_often_as_it_takes() -> None:
    """The separation that is told is that of so many records."""
    problem, _, once = ambiguous()
    assert with_noise(0.5).times == 1
    louder = 1.3 * once.separation / LIMITS.deciding_separation
    noisy = with_noise(louder)
    assert noisy.best.separation < LIMITS.deciding_separation <= noisy.separation
    assert 2 <= noisy.times <= LIMITS.max_records
    assert f", {noisy.times} times: " in noisy.statement
    records = [
        record_of(scored.input.levels, "linear") for scored, times in noisy.plan.records for _ in range(times)
    ]
    brought = (evidence((*problem.records, *records)) - evidence(problem.records)) / louder**2
    assert (
        0.8 * noisy.separation**2 < brought < 4.0 * noisy.separation**2
    )  # told is the least, linear in the rival
    assert len(noisy.scenario["excitation"]) == noisy.times
    far_too_noisy = with_noise(8.0 * once.separation / LIMITS.deciding_separation)
    assert "What is missing: longer records, less noise" in far_too_noisy.statement
    assert "Measure this next" not in far_too_noisy.statement
    assert "driven for" not in far_too_noisy.statement


def test_what_decides_with_fewer_records_goes_before_what_one_record_says_more_by() -> None:
    """Of each plan: its inputs, by one record and whether no prediction parts, how many records; what they bring."""
    entry: Any = None
    steep, steady = ScoredInput(entry, 5.0), ScoredInput(entry, 4.0)
    parting = ScoredInput(entry, 7.0, whole=False)
    slow, fast, early = (
        Design(((scored, times),), apart)
        for scored, times, apart in ((steep, 9, 8.0), (steady, 4, 8.0), (parting, 2, 9.0))
    )
    assert choose_design([early, slow, fast], LIMITS) == fast
    assert choose_design([early, Design(((steep, 16),), 7.9)], LIMITS) == early
    assert (
        choose_design([Design(((parting, 16),), 7.9), Design(((steep, 16),), 2.0)], LIMITS).separation == 2.0
    )
    assert (
        choose_design([Design(((parting, 16),), 7.9), Design(((steep, 1),), 0.01)], LIMITS).separation == 7.9
    )
    assert (
        choose_design([Design(((steep, 16),), 5.5), Design(((steady, 16),), 7.0)], LIMITS).separation == 7.0
    )
    assert (
        choose_design([Design(((steep, 1),), 9.0), Design(((steady, 1),), 30.0)], LIMITS).separation == 30.0
    )
    mixed = Design(((steep, 1), (steady, 3)), 12.0)
    assert choose_design([mixed, fast], LIMITS) == fast  # the simpler of two as short
    assert choose_design([Design(((steep, 1), (steady, 2)), 8.1), fast], LIMITS).times == 3


def test_inputs_of_which_one_tells_what_the_other_needs_known_are_proposed_together() -> None:
    """One tells the damping, the other the lag beside it: neither decides alone, however often."""
    entry: Any = None
    unsure = np.eye(2) * 1e-6
    lag_and_damping = RivalTerms(9.0, np.array([3.0, 0.0]), np.array([[1.0, 0.0], [0.0, 0.0]]))
    damping = RivalTerms(0.0, np.zeros(2), np.array([[1e4, 0.0], [0.0, 0.0]]))

    def played(pair: RivalTerms) -> Comparison:
        return Comparison({(0, 1): pair, (1, 0): pair}, True)

    def least(brought: Comparison) -> float:
        return brought.separation(0, 1, [unsure, unsure])

    possible = [
        (ScoredInput(entry, max(least(played(pair)), LIMITS.alike_separation)), played(pair))
        for pair in (lag_and_damping, damping)
    ]
    alone = [find_design([one], least, LIMITS) for one in possible]
    assert all(plan.separation < LIMITS.deciding_separation for plan in alone)
    both = find_design(possible, least, LIMITS)
    assert both.separation >= LIMITS.deciding_separation
    assert [scored for scored, _ in both.records] == [one[0] for one in possible]
    assert both.times == 9


@cache
def lagging(*identities: str) -> NextExperiment:
    """What is proposed for a linear device with so much of each."""
    problem, _, _ = ambiguous()
    found = []
    for identity in identities:
        made = device().extended((identity,))
        sizes = {"drive.lag": 0.02, "sensor.lag": 0.02, "friction.coulomb": 40.0}
        own = [
            sizes[identity] if p.mechanism and not p.declared.is_shape else p.value for p in made.parameters
        ]
        one = fit_hypothesis(problem, made.with_values(np.array(own)), (identity,), iterations=0)
        assert one is not None
        found.append(one)
    proposed = propose_experiment(found, nominal(problem), problem, NOISE, UNITS)
    assert proposed is not None
    return proposed


def test_candidates_that_answer_every_input_alike_are_said_to() -> None:
    """A lag before or behind a linear device is one law."""
    proposed = lagging("drive.lag", "sensor.lag")
    assert (proposed.times, proposed.separation < LIMITS.alike_separation) == (1, True)
    assert proposed.statement.startswith("No input of the menu separates drive.lag from sensor.lag")


def test_a_pair_that_no_input_separates_does_not_hide_the_others() -> None:
    proposed = lagging("drive.lag", "sensor.lag", "friction.coulomb")
    assert proposed.separation > LIMITS.deciding_separation
    assert "separates drive.lag or sensor.lag from friction.coulomb by" in proposed.statement
    assert proposed.statement.endswith("No input of the menu separates drive.lag from sensor.lag.")
    assert proposed.json["alike"] == [["drive.lag", "sensor.lag"]]
    assert set(proposed.separates) == {"drive.lag", "sensor.lag", "friction.coulomb"}


def test_a_rival_begins_where_it_comes_nearest_and_not_where_slopes_at_rest_would_have_it() -> None:
    """A lag of the drive begins as the drive does, one of the sensor as the motion: they part where springs harden."""
    made = device(stiffness_cubic=(2e5, "1/(mm^2*s^2)"))
    problem, found = ambiguous()[0], []
    for identity in ("drive.lag", "sensor.lag"):
        one = made.extended((identity,))
        own = np.array([0.003 if p.declared.name == "time_constant" else p.value for p in one.parameters])
        found.append(fit_hypothesis(problem, one.with_values(own), (identity,), iterations=0))
    true, rival = found
    bare = fit_hypothesis(problem, made, (), iterations=0)
    assert true is not None
    assert rival is not None
    assert bare is not None
    stimulus = Stimulus(inputs={"drive": np.full(900, 9.0)}, holds={"drive": "linear"}, period_s=PERIOD_S)
    stimulus.inputs["drive"][450:] = -9.0
    new = FitRecord(name="next", stimulus=stimulus, measured={"displacement": np.zeros(900)})

    def seen(one: Hypothesis, start: np.ndarray) -> np.ndarray:
        run = one.simulation.predict(stimulus, one.values_of(0), start[None], problem.steps_per_period)
        return run.outputs["displacement"][0] / NOISE_MM

    nearest = least_squares(
        lambda start: seen(true, np.zeros(2)) - seen(rival, start), np.zeros(2), x_scale=(0.1, 10.0)
    )
    at_rest, settled = (
        compare_candidates(new, (true, rival), bare, problem, NOISE, settled=one) for one in (False, True)
    )
    assert at_rest is not None
    assert settled is not None
    assert settled.whole
    assert settled.pairs[0, 1].squares == pytest.approx(2.0 * nearest.cost, rel=0.02)
    assert abs(at_rest.pairs[0, 1].squares - 2.0 * nearest.cost) > 0.3 * nearest.cost


def test_a_pair_that_only_slopes_at_rest_separate_does_not_hide_the_others() -> None:
    def apart(of_the_first_two: float) -> Comparison:
        nothing = np.zeros(1), np.zeros((1, 1))
        squares = {(0, 1): of_the_first_two**2, (0, 2): 400.0, (1, 2): 400.0}
        pairs = {pair: RivalTerms(one, *nothing) for pair, one in squares.items()}
        return Comparison(pairs | {(j, i): one for (i, j), one in pairs.items()}, True)

    entries = list_candidate_inputs(ambiguous()[0], UNITS)[:5]
    known = [np.eye(1)] * 3
    found = _choose_inputs(
        [(entry, apart(0.5 * LIMITS.alike_separation * (k + 1))) for k, entry in enumerate(entries)],
        known,
        lambda _: apart(0.0),
        LIMITS,
    )
    assert found.alike == [(0, 1)]
    assert found.counted == [(0, 2), (1, 2)]
    assert (found.plan.times, found.plan.separation) == (1, 20.0)


def test_the_statement_decides_by_the_given_thresholds() -> None:
    proposed = ambiguous()[2]
    strict = proposed._replace(limits=replace(LIMITS, deciding_separation=proposed.separation + 1.0))
    blind = proposed._replace(limits=replace(LIMITS, alike_separation=proposed.separation + 1.0))
    assert (proposed.decides, strict.decides) == (True, False)
    assert "What is missing: longer records, less noise" in strict.statement
    assert (proposed.in_vain, blind.in_vain) == (False, True)


def test_the_menu_is_made_of_the_given_levels() -> None:
    problem, _, _ = ambiguous()
    limits = replace(LIMITS, drive_levels=(1.0,), square_wave_frequencies=(1.0,))
    fewer = replace(problem, thresholds=replace(problem.thresholds, experiment=limits))
    statements = [entry.statement for entry in list_candidate_inputs(fewer, UNITS)]
    assert (
        sum("square wave" in statement for statement in statements) == 2
    )  # as sampled so far, and more slowly
    assert all("at 100%" in statement for statement in statements)


def test_what_follows_where_predictions_part_does_not_count() -> None:
    """Between two motions any difference decides which: it is large and says nothing of the causes."""
    t = np.linspace(0.0, 20.0, 401)
    one, other = np.sin(t), np.where(t < 10.0, 1.02, -1.0) * np.sin(t)
    size, period = np.array([one.std()]), 20
    most = Thresholds().nominal_fit.diverged_rms
    assert most == 0.5
    assert count_common_samples(np.stack((one, other, one))[:, None], size, period, most) == 200
    assert (
        count_common_samples(np.stack((one, one, other))[:, None], size, period, most) == 200
    )  # the last: the nominal model's
    assert count_common_samples(np.stack((one, one, np.full(401, np.nan)))[:, None], size, period, most) == 0
    for same in (1.02 * one, 0.3 * size + one):
        assert count_common_samples(np.stack((one, same, one))[:, None], size, period, most) == len(t)
    loud = np.stack((20.0 * one, 22.0 * one, 20.0 * one))
    assert count_common_samples(loud[:, None], size, period, most) == len(
        t
    )  # of a louder motion a tenth is a difference, no other motion


def test_an_input_that_predictions_part_under_is_proposed_only_where_no_other_decides() -> None:
    proposed = ambiguous()[2]
    assert all(one.whole for one in proposed.menu)
    sensitive = Thresholds(nominal_fit=replace(Thresholds().nominal_fit, diverged_rms=0.05))
    quiet, noisy = with_noise(0.25, sensitive), with_noise(0.5, sensitive)
    assert not quiet.menu[0].whole
    assert quiet.best.whole
    assert LIMITS.deciding_separation <= quiet.separation < quiet.menu[0].separation
    assert not noisy.best.whole


def test_one_candidate_needs_no_experiment() -> None:
    problem, rivals, _ = ambiguous()
    assert propose_experiment(rivals[:1], nominal(problem), problem, NOISE, UNITS) is None


def of_two_inputs() -> NextExperiment:
    once = ambiguous()[2]
    steady, wave = (
        next(one for one in once.menu if one.input.statement.startswith(kind)) for kind in ("slow", "square")
    )
    return once._replace(plan=Design(((steady, 1), (wave, 2)), 9.0))


def test_several_inputs_are_told_with_the_records_of_each() -> None:
    proposed = of_two_inputs()
    (steady, _), (wave, _) = proposed.plan.records
    inputs = f"1 x {steady.input.statement}; 2 x {wave.input.statement}"
    assert proposed.statement.startswith(f"Measure this next, 3 records: {inputs}. Together they separate ")
    assert (proposed.json["input"], proposed.json["times"]) == (inputs, 3)
    assert [one["times"] for one in proposed.json["records"]] == [1, 2]
    seconds = (
        len(steady.input.levels) * steady.input.period_s + 2 * len(wave.input.levels) * wave.input.period_s
    )
    assert proposed.json["duration_s"] == proposed.duration_s == pytest.approx(seconds)
    assert proposed.statement.endswith(f", and the device is driven for {readable(seconds, 's', 3)} in all.")


@pytest.mark.parametrize("several", [False, True])
def test_acquire_plays_exactly_the_inputs_that_were_scored(tmp_path: Path, several: bool) -> None:
    proposed = of_two_inputs() if several else with_noise(1.2)
    assert proposed.times > 1
    (tmp_path / "next-experiment.toml").write_text(scenario_text(proposed))
    (tmp_path / "model-extended.toml").write_text(MODEL)
    command = ["acquire", str(tmp_path / "next-experiment.toml"), "--out", str(tmp_path / "data"), "--quiet"]
    assert main(command) == 0
    dataset = read_dataset(tmp_path / "data" / "dataset.toml")
    assert open_dataset(tmp_path / "data" / "dataset.toml").units == {"drive": "V", "displacement": "mm"}
    assert len(dataset.records) == proposed.times
    driven = sum(len(one.signals["drive"]) for one in dataset.records) * PERIOD_S
    assert driven == pytest.approx(proposed.duration_s, rel=0.05)
    levels = [scored.input.levels for scored, times in proposed.plan.records for _ in range(times)]
    for record, scored in zip(dataset.records, levels, strict=True):
        played = record.signals["drive"]
        first = next(k for k in range(4) if np.allclose(played[k : k + 50], scored[:50], atol=1e-4))
        assert played[first : first + len(scored)] == pytest.approx(scored[: len(played) - first], abs=1e-4)
