"""A search whose work budget runs out begins no further fit, reports the best set so far, and says why it ended."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
from diagnosis_cases import FRICTION, PERIOD_S, device, friction_case, measured, noise_drive

from rtctl.border.simulation import Stimulus
from rtctl.border.work import metered
from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.problem.work_budget import WallClockGuard, WorkBudget
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.proposals.candidates import propose_candidates
from rtctl.diagnosis.search.request import DiagnosisOptions
from rtctl.diagnosis.search.successive_halving import Candidate, halve_successively
from rtctl.diagnosis.thresholds import BudgetThresholds, Thresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.identification.threads import open_thread_pool
from rtctl.measured import open_dataset, read_dataset
from rtctl.models.oscillator import read_oscillator_model
from rtctl.session.validation.model_validation import simulation_for

VALUES = np.array([one.value for one in device().parameters])


def test_a_budget_is_spent_when_so_much_work_was_counted() -> None:
    ticks = count()
    budget = WorkBudget.of(3.0, lambda: float(next(ticks)))  # begins at 0
    assert [budget.spent for _ in range(4)] == [False, False, True, True]


def test_a_further_comparison_exceeds_it_by_a_bounded_amount() -> None:
    now = [0.0]
    amounts = BudgetThresholds(overrun=15.0, least_comparison=3.0)
    budget = WorkBudget.of(70.0, lambda: now[0], thresholds=amounts)
    assert budget.further(15.0).steps == 15.0
    now[0] = 77.0
    assert budget.further(15.0).steps == 70.0 + 15.0 - 77.0
    now[0] = 95.0
    assert budget.further(15.0).steps == 3.0


def test_without_a_meter_nothing_is_ever_spent() -> None:
    budget = WorkBudget.of(1.0)
    device().predict(
        Stimulus(inputs={"drive": noise_drive(1)}, holds={"drive": "linear"}, period_s=PERIOD_S), VALUES
    )
    assert budget.left == 1.0


def test_the_wall_clock_guard_ends_a_budget_that_has_work_left() -> None:
    budget = WorkBudget.of(np.inf, lambda: 0.0, WallClockGuard(seconds=0.0, started_s=time.monotonic() - 1.0))
    assert budget.spent
    assert budget.cut_by_clock
    assert budget.further(10.0).spent


def test_simulations_count_the_same_work_in_one_thread_and_in_several() -> None:
    """Lanes x samples x steps: twice the lanes or the refinement are twice the work, whichever thread simulates."""
    stimulus = Stimulus(inputs={"drive": noise_drive(1)}, holds={"drive": "linear"}, period_s=PERIOD_S)

    def work(lanes: int, threads_used: int) -> float:
        with metered() as meter, open_thread_pool(threads_used) as executor:
            runs = [np.tile(VALUES, (lanes, 1)) for _ in range(4)]
            list((executor.map if executor else map)(lambda values: device().predict(stimulus, values), runs))
        return meter.steps

    assert work(1, 1) > len(noise_drive(1))
    assert work(2, 1) == 2.0 * work(1, 1) == 2.0 * work(1, 2)


def test_a_fit_ends_where_it_is_once_it_is_spent() -> None:
    stimulus = Stimulus(inputs={"drive": noise_drive(1)}, holds={"drive": "linear"}, period_s=PERIOD_S)
    readings = {"displacement": measured(device(), noise_drive(1))}
    record = FitRecord(name="r", stimulus=stimulus, measured=readings)
    problem = Problem(subject=subject_of("oscillator"), records=(record,), scales=estimate_scales((record,)))
    values = np.array([1.05 * one.value for one in device().parameters])
    start = device().with_values(values)
    asked = count()
    left = [
        fit_hypothesis(problem.until(WorkBudget.of(most, lambda: float(next(asked)))), start, ())
        for most in (0.0, 2.0, 99.0)
    ]
    costs = [one.cost for one in left if one is not None]
    assert costs[0] == fit_hypothesis(problem, start, (), iterations=0).cost  # type: ignore[union-attr]
    assert costs[0] > costs[1] > costs[2]


def test_the_first_round_leaves_work_to_end_the_fit_of_the_best_set() -> None:
    drive = noise_drive(1, 6.0)
    readings = {"displacement": measured(device(FRICTION), drive)}
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
    record = FitRecord(name="r", stimulus=stimulus, measured=readings)
    limits = replace(Thresholds().search, first_iterations=1)  # nothing is fitted to its end by that
    problem = Problem(
        subject=subject_of("oscillator"), records=(record,), scales=estimate_scales((record,)),
        thresholds=replace(Thresholds(), search=limits),
    )  # fmt: skip
    nominal = fit_hypothesis(problem, device(), ())
    assert nominal is not None
    ids = (
        "friction.coulomb",
        "damping.quadratic",
        "damping.nonlinear",
        "drive.delay",
        "drive.lag",
        "stiffness.drift",
    )
    candidates = propose_candidates(run_residual_tests(nominal, problem, ids), limits)

    def start(one: Candidate) -> None:
        fit_hypothesis(problem, one.simulation, one.mechanisms, one.starts, 1, one.fixed_parameters)

    with metered() as meter:
        for one in candidates:
            start(one)
        first_round = meter.steps
        ended = halve_successively(problem, candidates, lambda text: None)
        best = halve_successively(problem, candidates, lambda text: None, WorkBudget.of(1.5 * first_round))
    assert ended[0].mechanisms == best[0].mechanisms == ("friction.coulomb",)
    assert best[0].cost < 1.05 * ended[0].cost


def test_without_work_nothing_is_fitted_no_cause_is_claimed_and_the_answer_says_so(tmp_path: Path) -> None:
    manifest = friction_case(tmp_path)
    heard: list[str] = []
    model = tmp_path / "model.toml"
    found = diagnose(
        read_dataset(manifest), read_oscillator_model(model), simulation_for(model, open_dataset(manifest)),
        ("friction.coulomb", "stiffness.cubic"), DiagnosisOptions(work=0.0, threads=1), heard.append,
    )  # fmt: skip
    assert heard == ["the nominal model", "the next experiment, and what the answer is worth"]
    assert (found.verdict, found.causes) == ("unexplained", ())
    assert found.search.out_of_time
    assert "used up its budget of 0 million simulated steps" in found.warnings[-1]
    assert found.json["out_of_time"] is True


def test_an_answer_that_the_guard_cut_says_that_it_depends_on_the_machine(tmp_path: Path) -> None:
    manifest, model = friction_case(tmp_path), tmp_path / "model.toml"
    cut = diagnose(
        read_dataset(manifest), read_oscillator_model(model), simulation_for(model, open_dataset(manifest)),
        ("friction.coulomb", "stiffness.cubic"), DiagnosisOptions(seconds=0.0, threads=1),
    )  # fmt: skip
    assert cut.json["cut_by_clock"] is True
    assert "depends on the speed of the machine" in cut.warnings[-1]


def test_two_answers_are_the_same_bytes_with_one_thread_and_with_two(tmp_path: Path) -> None:
    manifest, model = friction_case(tmp_path), tmp_path / "model.toml"
    answers = [
        json.dumps(
            diagnose(
                read_dataset(manifest), read_oscillator_model(model), simulation_for(model, open_dataset(manifest)),
                ("friction.coulomb", "stiffness.cubic"), DiagnosisOptions(work=work, threads=used),
            ).json,
            default=float,
        )
        for work in (3e6, 1e12)
        for used in (1, 2)
    ]  # fmt: skip
    assert answers[0] == answers[1]
    assert answers[2] == answers[3]
    assert answers[0] != answers[2]
