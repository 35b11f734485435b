"""A law of no name that leaves less than the named causes takes their names away; one that leaves more does not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from diagnosis_cases import FRICTION, device, measured, noise_drive
from vo2_model_cases import PERIOD_S, predict, simulation, telegraph

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation, Stimulus
from rtctl.diagnosis.nominal_fit.misfit.allowed_misfit import allow_misfit
from rtctl.diagnosis.problem.cancellation import CancellationToken
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subject import FittedModel, FittedRecords
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.nonparametric import (
    compute_memory_p_value,
    find_better_alternative,
    find_memory_alternative,
)
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.proposals.candidates import propose_candidates
from rtctl.diagnosis.search.successive_halving import halve_successively
from rtctl.diagnosis.verification.holdout_gain import judge_search
from rtctl.diagnosis.verification.nonparametric_comparison import compare_nonparametric
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.simulations.vo2 import Vo2Simulation

DEADBAND = "actuation.deadband"


def cooling_slowly() -> Vo2Simulation:
    made = simulation().extended(("nonparametric.heat_balance",))
    own = [1.0 if one.declared.name == "cooling" else one.value for one in made.parameters]
    return made.with_values(np.array(own))


def named_by(
    problem: Problem, simulation: Simulation, identity: str
) -> tuple[Problem, Hypothesis, Hypothesis]:
    """The data, the model re-fitted to them, and the same with a cause that removes a fifth at least."""
    nominal = fit_hypothesis(problem, simulation, ())
    assert nominal is not None
    named = halve_successively(
        problem,
        propose_candidates(run_residual_tests(nominal, problem, (identity,)), problem.thresholds.search),
        lambda text: None,
    )[0]
    assert named.mechanisms == (identity,)
    assert named.cost < 0.8 * nominal.cost
    return problem, nominal, named


@cache
def searched(device: str) -> tuple[Problem, Hypothesis, Hypothesis]:
    """Two records of a device, its model re-fitted to them, and the same with a dead band."""
    made = cooling_slowly() if device == "cools slowly" else simulation(actuation__deadband={"zone": 2.0})
    subject, records = subject_of("vo2"), []
    for seed in (1, 2):
        stimulus = Stimulus(
            inputs={"current": telegraph(1200, seed)}, holds={"current": "zero"}, period_s=PERIOD_S
        )
        resistance, deflection = predict(made, stimulus)
        deflection = deflection + np.random.default_rng(seed).normal(scale=0.05, size=deflection.size)
        measured = {"resistance": resistance, "deflection": deflection}
        records.append(FitRecord(name=f"r{seed}", stimulus=stimulus, measured=measured, first=0))
    comparable, readings = subject.to_comparable(simulation(), tuple(records))
    compared = tuple(replace(record, measured=readings(record.measured)) for record in records)
    problem = allow_misfit(
        Problem(
            subject=subject, records=compared, scales=estimate_scales(compared, subject.output, subject.drive),
            steps_per_period=subject.steps_per_period,
        ),
        {},
    )  # fmt: skip
    return named_by(problem, comparable, DEADBAND)


@pytest.mark.parametrize(
    ("device", "said"),
    [
        ("cools slowly", "The time constant depends on direction (1"),
        pytest.param("dead band", "", marks=pytest.mark.slow),
    ],
)
def test_a_cause_stands_only_if_no_law_without_a_name_leaves_less(device: str, said: str) -> None:
    found = find_better_alternative(*searched(device), WorkBudget.of())
    assert found.startswith(said) if said else not found


@cache
def braked(hidden: str) -> tuple[Problem, Hypothesis, Hypothesis]:
    """Two records of an oscillator with dry friction or with a damping by the root of speed, and both fits to them."""
    made = unnamed("nonparametric.dissipation", half=200.0) if hidden == "root" else device(FRICTION)
    return named_by(of(made), device(), "friction.coulomb")


def unnamed(identity: str, **values: float) -> Simulation:
    """The device with a law of no name."""
    made = device().extended((identity,))
    return made.with_values(np.array([values.get(one.declared.name, one.value) for one in made.parameters]))


def of(made: Simulation) -> Problem:
    """Two records of it."""
    records = []
    for seed in (1, 2):
        drive = noise_drive(seed)
        stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=2e-3)
        records.append(
            FitRecord(
                name=f"r{seed}", stimulus=stimulus, measured={"displacement": measured(made, drive)}, first=1
            )
        )
    return Problem(
        subject=subject_of("oscillator"), records=tuple(records), scales=estimate_scales(tuple(records)),
        steps_per_period=64.0,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "said"),
    [("root", "The damping force grows with another power"), ("dry", "")],
)
def test_nor_is_a_damping_of_another_power_called_dry_friction(hidden: str, said: str) -> None:
    found = find_better_alternative(*braked(hidden), WorkBudget.of())
    assert found.startswith(said) if said else not found


@pytest.mark.slow
def test_nor_is_a_stop_called_a_spring_that_hardens_and_the_law_that_leaves_least_is_told() -> None:
    place = 1.2 * float(np.std(of(device()).records[0].measured["displacement"]))
    problem, nominal, named = named_by(
        of(unnamed("nonparametric.stop", above=8e3, below=8e3, place=place)), device(), "stiffness.cubic"
    )
    assert find_better_alternative(problem, nominal, named, WorkBudget.of()).startswith(
        "The restoring force has a kink"
    )


RELAXING = {"level": 900.0, "order": 0.5, "time": 8e-3}


@pytest.mark.parametrize(
    ("hidden", "said"),
    [
        pytest.param(
            "many", "A part of the stiffness relaxes with many time constants", marks=pytest.mark.slow
        ),
        pytest.param("one", "", marks=pytest.mark.slow),
    ],
)
def test_nor_are_many_relaxations_called_one_that_leaves_little_beyond_the_noise(
    hidden: str, said: str
) -> None:
    """What one leaves is less than a fifth of the noise: the cost as a whole would not tell."""
    single = {
        "id": "stiffness.viscoelastic",
        "parameters": {
            "stiffness": {"value": 2e3, "unit": "1/s^2"},
            "time_constant": {"value": 8e-3, "unit": "s"},
        },
    }
    made = unnamed("nonparametric.relaxations", **RELAXING) if hidden == "many" else device(single)
    problem, nominal, named = named_by(of(made), device(), "stiffness.viscoelastic")
    found = find_better_alternative(problem, nominal, named, WorkBudget.of())
    assert found.startswith(said) if said else not found


def late_by(radians: float, share: float) -> Problem:
    """Two records of the device with a force that follows it late, as much of its stiffness as `share`."""
    rate = float(np.sqrt(1.6e4))
    time = radians / rate / 48.0
    return of(unnamed("nonparametric.feedback", late=share * 1.6e4, time=time))


@pytest.mark.slow
def test_causes_that_pass_are_asked_for_forces_along_the_past_of_the_motion() -> None:
    """Of a force that is 9 radians late a second mode leaves what no other question sees."""
    problem = late_by(9.0, 0.03)
    nominal = fit_hypothesis(problem, device(), ())
    assert nominal is not None
    suspect = problem.thresholds.search.memory_p
    assert compute_memory_p_value(run_residual_tests(nominal, problem, ()), problem) < suspect
    assert find_memory_alternative(
        problem, nominal, run_residual_tests(nominal, problem, ()), WorkBudget.of()
    ).startswith("A force follows")
    friction, nominal, named = braked("dry")
    report: list[str] = []
    assert compute_memory_p_value(run_residual_tests(named, friction, ()), friction) > suspect
    assert not find_memory_alternative(
        friction, nominal, run_residual_tests(named, friction, ()), WorkBudget.of(), report.append
    )
    assert not report, "no law was fitted where nothing is suspected"


def test_a_motion_of_one_frequency_has_no_force_along_its_past_to_ask_for() -> None:
    """Of a ring-down a force that is late is a spring and a damper: none of them is visible beside these."""
    problem, _, named = braked("dry")
    past = problem.subject.memory_forces
    assert past is not None

    def invisible(model: FittedModel, records: FittedRecords, index: int) -> FloatArray:
        return np.zeros((len(past.forces), 1, problem.records[index].samples - problem.records[index].first))

    hidden = replace(problem.subject, memory_forces=past._replace(force_sensitivities=invisible))
    tested = run_residual_tests(named, problem, ())
    assert compute_memory_p_value(tested, replace(problem, subject=hidden)) == 1.0


@pytest.mark.slow
def test_the_user_may_stop_that_comparison_and_hears_what_was_not_done() -> None:
    problem, nominal, named = braked("root")
    search = SearchResult(
        run_residual_tests(nominal, problem, ()), run_residual_tests(named, problem, ()), False, (), ()
    )
    stopping = replace(problem, cancellation=CancellationToken())
    stopping.cancellation.cancel()
    claimed = judge_search(search, problem)
    stopped = compare_nonparametric(claimed, search, stopping, WorkBudget.of(), lambda text: None)
    assert (stopped.claim, stopped.stopped) == ("partly_explained", True)
    assert "may explain the data better than friction.coulomb" in stopped.notes[-1]
    compared = compare_nonparametric(claimed, search, problem, WorkBudget.of(), lambda text: None)
    assert (compared.claim, compared.stopped) == ("unexplained", False)
    assert "a nonparametric alternative leaves a smaller residual" in compared.notes[-1]
