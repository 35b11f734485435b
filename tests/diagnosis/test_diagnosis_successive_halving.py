"""A fit with a further mechanism is no worse than without it, however far off its first step was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, device, friction_case, measured, noise_drive
from vo2_model_cases import PERIOD_S as VO2_PERIOD_S
from vo2_model_cases import predict, simulation, telegraph

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.nominal_fit.whole_record_start import fit_from_starts
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.screening.split import split_records
from rtctl.diagnosis.search.challengers import refit_challengers
from rtctl.diagnosis.search.proposals.candidates import propose_candidates
from rtctl.diagnosis.search.state import SearchSettings, SearchState
from rtctl.diagnosis.search.stepwise import find_lower_nominal
from rtctl.diagnosis.search.successive_halving import (
    Candidate,
    fit_in_rounds,
    halve_successively,
    is_in_contention,
    select_by_free_shapes,
    select_other_forms,
    select_promising,
)
from rtctl.diagnosis.thresholds import SearchThresholds, Thresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.measured import read_dataset
from rtctl.plants.vo2.log_resistance import LOG_RESISTANCE

DRIFT = "thermal.ambient_drift"
LIMITS = SearchThresholds()
MODE = {
    "id": "mode.second",
    "parameters": {
        "mass_ratio": {"value": 0.02, "unit": "dimensionless"},
        "frequency": {"value": 45.0, "unit": "Hz"},
        "damping_ratio": {"value": 0.05, "unit": "dimensionless"},
    },
}


@pytest.fixture(scope="module")
def fitted_case(tmp_path_factory: pytest.TempPathFactory) -> tuple[Problem, Hypothesis]:
    folder: Path = tmp_path_factory.mktemp("race")
    records, _, _ = split_records(read_dataset(friction_case(folder)), subject_of("oscillator"))
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    nominal = fit_from_starts(problem, device(), ())
    assert nominal is not None
    return problem, nominal


def candidate(nominal: Hypothesis, coefficient: float) -> Candidate:
    """With a cubic spring of so many [1/(mm^2 s^2)] at the start."""
    neutral = nominal.simulation.extended(("stiffness.cubic",))
    values = np.array([parameter.value for parameter in neutral.parameters])
    values[-1] = coefficient
    return Candidate(
        mechanisms=("stiffness.cubic",), simulation=neutral.with_values(values), starts=nominal.starts,
        fixed_parameters=frozenset(), neutral=neutral, parent=nominal,
    )  # fmt: skip


def lower_nominal(problem: Problem, nominal: Hypothesis, first: Hypothesis) -> Hypothesis | None:
    """Of a search whose best single cause is `first`."""
    tested = run_residual_tests(nominal, problem, ())
    settings = SearchSettings(ids=(), level=0.01, budget=WorkBudget.of(np.inf))
    state = SearchState(
        settings=settings, given=problem, problem=problem, nominal=tested, best=tested, smaller=tested,
        parents=(tested,), fits=(first,), size=1,
    )  # fmt: skip
    return find_lower_nominal(state)


def test_a_step_to_another_branch_is_taken_again_shorter(fitted_case: tuple[Problem, Hypothesis]) -> None:
    problem, nominal = fitted_case
    (near,) = halve_successively(problem, [candidate(nominal, 0.0)], lambda text: None)
    (astray,) = halve_successively(problem, [candidate(nominal, 1e7)], lambda text: None)
    assert near.cost <= nominal.cost
    assert astray.cost == pytest.approx(near.cost, rel=1e-3)


def test_a_promise_is_the_cost_that_a_linear_step_leads_to(fitted_case: tuple[Problem, Hypothesis]) -> None:
    problem, nominal = fitted_case
    whole = fit_hypothesis(problem, candidate(nominal, 0.0).simulation, ("stiffness.cubic",), nominal.starts)
    begun = fit_hypothesis(
        problem, candidate(nominal, 0.3).simulation, ("stiffness.cubic",), nominal.starts, 0
    )
    assert whole is not None
    assert begun is not None
    assert whole.predicted_cost == pytest.approx(whole.cost, rel=1e-3)
    assert begun.predicted_cost < begun.cost - 0.9 * (begun.cost - whole.cost)


def test_a_rival_that_a_step_takes_to_the_front_goes_on_to_its_end(
    fitted_case: tuple[Problem, Hypothesis],
) -> None:
    _, nominal = fitted_case

    def goes_on(cost: float, promised: float) -> bool:
        return is_in_contention(replace(nominal, cost=cost, predicted_cost=promised), 1.0, LIMITS)

    assert goes_on(1.4, 1.3)
    assert not goes_on(1.6, 1.1)
    assert goes_on(1.6, 0.9)
    assert not goes_on(4.0, 0.9)


def test_a_lag_of_the_drive_is_found_on_a_bench_that_was_off_before() -> None:
    """What had been there before a record is no number of the device: one of two is taken, and no third is fitted."""
    made = device().extended(("drive.lag",))
    own = {"drive.lag.time_constant": 3e-3, "drive.lag.settled": 0.0}
    late = made.with_values(np.array([own.get(one.name, one.value) for one in made.parameters]))
    records = []
    for seed in (1, 2):
        drive = 20.0 + noise_drive(seed)
        stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
        reading = {"displacement": measured(late, drive)}
        records.append(FitRecord(name=f"r{seed}", stimulus=stimulus, measured=reading, first=1))
    problem = Problem(
        subject=subject_of("oscillator"), records=tuple(records), scales=estimate_scales(tuple(records)),
        steps_per_period=64.0,
    )  # fmt: skip
    nominal = fit_hypothesis(problem, device(), ())
    assert nominal is not None
    found = halve_successively(
        problem,
        propose_candidates(run_residual_tests(nominal, problem, ("drive.lag",)), LIMITS),
        lambda text: None,
    )[0]
    values = {one.name: one.value for one in found.simulation.parameters}
    assert values["drive.lag.time_constant"] == pytest.approx(3e-3, rel=0.02)
    assert values["drive.lag.settled"] == 0.0
    assert "drive.lag.settled" in found.fixed_parameters
    assert run_residual_tests(found, problem, ()).p_value > 0.01


def test_those_that_promise_more_than_the_leaders_go_on_too(fitted_case: tuple[Problem, Hypothesis]) -> None:
    """However little they have gained so far; a few of them, each by its most promising start."""
    _, nominal = fitted_case
    promises = {"a": (0.8,), "b": (0.95,), "c": (0.7, 0.6), "d": (0.5,)}
    begun = {
        (frozenset({name}), ""): [replace(nominal, mechanisms=(name,), predicted_cost=one) for one in those]
        for name, those in promises.items()
    }
    going = select_promising(begun, 0.9, LIMITS)
    assert [(one.mechanisms, one.predicted_cost) for one in going.values()] == [(("d",), 0.5), (("c",), 0.6)]
    assert len(going) == LIMITS.promising
    assert not select_promising(begun, 0.4, LIMITS)


def test_a_set_is_in_the_field_once_however_many_of_its_starts_went_on(
    fitted_case: tuple[Problem, Hypothesis], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The cheapest start leads the set, and the most promising one is another."""
    problem, nominal = fitted_case
    no_second_round = Thresholds(search=replace(LIMITS, second_round=0))
    entered: list[float] = []

    def counted(problem: Problem, one: Hypothesis) -> Hypothesis:
        entered.append(one.cost)
        return one

    monkeypatch.setattr("rtctl.diagnosis.search.successive_halving._fit_further", counted)
    starts = [candidate(nominal, size) for size in (0.0, 0.3)]
    problem = replace(problem, thresholds=no_second_round)
    field = fit_in_rounds(problem, starts, lambda text: None, WorkBudget.of(99.0))
    assert len(entered) == 1
    assert len(field) == 1


def test_a_nominal_model_that_was_stuck_goes_where_the_best_cause_led(
    fitted_case: tuple[Problem, Hypothesis],
) -> None:
    """Only if it begins there below where it had ended, and ends far below."""
    problem, nominal = fitted_case
    (first,) = halve_successively(problem, [candidate(nominal, 0.0)], lambda text: None)
    assert lower_nominal(problem, nominal, first) is None
    detuned = [0.8 * one.value if one.name == "stiffness" else one.value for one in device().parameters]
    stuck = fit_hypothesis(problem, device().with_values(np.array(detuned)), (), nominal.starts, 0)
    assert stuck is not None
    lower = lower_nominal(problem, stuck, first)
    assert lower is not None
    assert lower.mechanisms == ()
    assert lower.cost == pytest.approx(nominal.cost, rel=1e-3)


def test_a_shorter_step_ends_between_the_parent_and_the_first(
    fitted_case: tuple[Problem, Hypothesis],
) -> None:
    _, nominal = fitted_case
    whole = candidate(nominal, 200.0)
    part = whole.shortened(0.1)
    assert part.simulation.parameters[-1].value == pytest.approx(20.0)
    np.testing.assert_allclose(part.starts, nominal.starts)
    assert whole.shortened(1.0).simulation.parameters == whole.simulation.parameters


def test_what_could_stand_in_for_one_that_found_its_way_is_tried_from_there() -> None:
    late = {"id": "drive.lag", "parameters": {"time_constant": {"value": 4e-3, "unit": "s"}}}
    drive = noise_drive(1)
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
    records = (
        FitRecord(name="r", stimulus=stimulus, measured={"displacement": measured(device(late), drive)}),
    )
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    nominal = fit_from_starts(problem, device(), ())
    assert nominal is not None
    delayed = nominal.simulation.extended(("drive.delay",))
    values = np.array([parameter.value for parameter in delayed.parameters])
    values[-1] = 4e-3
    found = fit_hypothesis(problem, delayed.with_values(values), ("drive.delay",), nominal.starts)
    assert found is not None
    assert found.cost < 0.1 * nominal.cost
    stuck, ids = replace(nominal, mechanisms=("drive.lag",)), ("drive.delay", "drive.lag", "stiffness.cubic")
    settings = SearchSettings(ids=ids, level=0.01, budget=WorkBudget.of(60e8))
    field = refit_challengers(problem, [run_residual_tests(nominal, problem, ids)], [found, stuck], settings)
    assert field[0].mechanisms == ("drive.lag",)
    assert field[0].cost < found.cost


@pytest.mark.slow
def test_what_only_grows_with_time_is_looked_for_in_whole_records() -> None:
    """A room that warms by 2 % of the heat within a record, beside a heater that is far from the model's."""
    true = simulation(heater__tcr={"tcr": 0.012}, thermal__ambient_drift={"rate": 0.03})
    draw, records = np.random.default_rng(1), []
    for seed in range(2):
        along = Stimulus(
            inputs={"current": telegraph(30_000, seed)}, holds={"current": "zero"}, period_s=VO2_PERIOD_S
        )
        resistance, deflection = predict(true, along)
        readings = {
            LOG_RESISTANCE: np.log(resistance) + 0.002 * draw.normal(size=along.samples),
            "deflection": deflection + 0.05 * draw.normal(size=along.samples),
        }
        records.append(FitRecord(name=f"r{seed}", stimulus=along, measured=readings))
    problem = Problem(
        subject=subject_of("vo2"), records=tuple(records), scales=estimate_scales(records, "deflection", "current"),
        steps_per_period=8.0,
    )  # fmt: skip
    nominal = fit_hypothesis(problem, simulation(), ())
    assert nominal is not None
    assert problem.glance is not problem
    ids = (
        "heater.tcr",
        "thermal.nonlinear_loss",
        "sensor.self_heating",
        "thermal.second_time_constant",
        DRIFT,
    )
    field = halve_successively(
        problem, propose_candidates(run_residual_tests(nominal, problem, ids), LIMITS), lambda text: None
    )
    assert (DRIFT,) in [one.mechanisms for one in field]


def test_another_form_of_a_set_that_goes_to_the_end_goes_with_it(
    fitted_case: tuple[Problem, Hypothesis],
) -> None:
    """A driven second mode beside a delay (three times the cost, its damping still at the default) against a mass."""
    _, nominal = fitted_case

    def one(mechanisms: str, cost: float) -> Hypothesis:
        return replace(nominal, mechanisms=tuple(mechanisms.split()), cost=cost)

    first, second = one("mode.second drive.delay", 1.0), one("mode.second sensor.lag", 1.1)
    driven, hopeless = one("mode.second drive.delay", 3.0), one("sensor.lag mode.second", 40.0)
    field = [first, second, one("damping.quadratic", 1.2), driven, hopeless]
    found = select_other_forms(field, [first, second], LIMITS)
    assert [each is driven for each in found] == [True]


def test_a_set_whose_shape_is_still_at_its_default_is_judged_with_it_free() -> None:
    """A carried mode of 5 % damping, fitted with the default of 1 %, is behind a law of damping that fits less."""
    plant = device(MODE)
    drives = [noise_drive(seed) for seed in range(2)]
    records = tuple(
        FitRecord(
            name="r",
            stimulus=Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S),
            measured={"displacement": measured(plant, drive)},
        )
        for drive in drives
    )
    problem = Problem(
        subject=subject_of("oscillator"),
        records=records,
        scales=estimate_scales(records),
        steps_per_period=64.0,
    )
    names, ratio = ("mode.second",), "mode.second.damping_ratio"
    default = [0.01 if one.name == ratio else one.value for one in plant.parameters]
    held = fit_hypothesis(
        problem, plant.with_values(np.array(default)), names, fixed_parameters=frozenset({ratio})
    )
    assert held is not None
    ahead = replace(
        held, mechanisms=("damping.quadratic",), cost=0.98 * held.cost, predicted_cost=0.98 * held.cost
    )
    budget = WorkBudget.of(np.inf)
    assert select_by_free_shapes(problem, [ahead, held], [ahead], budget) == [held]
    nearer = replace(ahead, predicted_cost=0.1 * held.cost)
    assert select_by_free_shapes(problem, [nearer, held], [nearer], budget) == []
    free = replace(held, fixed_parameters=frozenset())
    assert select_by_free_shapes(problem, [ahead, free], [ahead], budget) == []
