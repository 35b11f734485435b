"""Before a search stalls, two causes more are tried at once beside the smaller set."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, cause, device, measured, noise_drive

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, project_plainly, run_residual_tests
from rtctl.diagnosis.search.proposals.candidates import propose_pairs
from rtctl.diagnosis.search.state import SearchSettings, SearchState, StopReason
from rtctl.diagnosis.search.stepwise import stop_without_progress
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales

IDS = ("damping.power", "timing.skew", "stiffness.cubic", "drive.offset")


RIVALS = (
    "stiffness.quadratic", "sensor.drift", "stiffness.cubic", "stiffness.quintic", "stop.one_sided", "stop.two_sided",
    "stiffness.clearance", "hysteresis.bouc_wen", "friction.presliding", "mode.second", "drive.harmonics",
    "damping.asymmetric", "damping.quadratic", "drive.lag", "stiffness.parametric",
)  # fmt: skip
POWER = cause("damping.power", level=(2e3, "mm/s^2"), exponent=(0.3, "1"), speed=(300.0, "mm/s"))
SKEW = cause("timing.skew", late=(1e-3, "s"))
OFFSET = (cause("drive.offset", offset=(2.0, "V")),)


@pytest.fixture(scope="module", params=[(), ("drive.offset",)], ids=["two causes", "three causes"])
def state(request: pytest.FixtureRequest) -> SearchState:
    """Of a search that has tried a cubic spring beside the nominal model, or beside an offset of the drive."""
    records = []
    for seed in (1, 2):
        drive = noise_drive(seed)
        reading = measured(device(POWER, SKEW, *(OFFSET if request.param else ())), drive)
        stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
        record = FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}, first=1)
        records.append(record)
    found = tuple(records)
    problem = Problem(
        subject=subject_of("oscillator"), records=found, scales=estimate_scales(found), steps_per_period=64.0
    )

    def tested(*mechanisms: str) -> TestedHypothesis:
        fit = fit_hypothesis(problem, device().extended(mechanisms), mechanisms)
        assert fit is not None
        return run_residual_tests(fit, problem, IDS)

    nominal, smaller = tested(), tested(*request.param)
    best = tested(*request.param, "stiffness.cubic")
    settings = SearchSettings(ids=IDS, level=0.002, budget=WorkBudget.of(math.inf))
    return SearchState(
        settings=settings, given=problem, problem=problem, nominal=nominal, best=best, smaller=smaller,
        parents=(best,), size=1 + len(request.param), fits=(best.hypothesis,),
    )  # fmt: skip


def test_they_are_accepted_where_they_pass(state: SearchState) -> None:
    assert state.best.hypothesis.cost > 0.9 * state.smaller.hypothesis.cost
    ended = stop_without_progress(state)
    assert ended.stop is StopReason.PASSED
    assert ended.result is not None
    found = set(ended.result.chosen.hypothesis.mechanisms)
    assert found == {"damping.power", "timing.skew", *state.smaller.hypothesis.mechanisms}


def test_without_work_the_search_stalls(state: SearchState) -> None:
    settings = SearchSettings(ids=IDS, level=0.002, budget=WorkBudget.of(0.0))
    ended = stop_without_progress(replace(state, settings=settings))
    assert ended.stop is StopReason.STALLED
    assert ended.best is state.smaller


def test_pairs_with_what_is_slow_noise_to_a_filter_are_proposed_by_plain_squares() -> None:
    """A zero that creeps beside a quadratic spring: to a filter that whitens it is noise, and pairs without it lead."""
    samples, records = 1500, []
    plant = device(cause("stiffness.quadratic", coefficient=(1e3, "1/(mm*s^2)")))
    for seed in (1, 2):
        drive = noise_drive(seed, samples=samples)
        reading = measured(plant, drive, noise=1e-3) + 0.2 * np.sqrt(np.arange(samples) / samples)
        stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
        records.append(FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}))
    found = tuple(records)
    problem = Problem(
        subject=subject_of("oscillator"), records=found, scales=estimate_scales(found), steps_per_period=64.0
    )
    nominal = fit_hypothesis(problem, device(), ())
    assert nominal is not None
    whitened = run_residual_tests(nominal, problem, RIVALS)
    plain = project_plainly(whitened, problem, RIVALS)
    wanted = {"stiffness.quadratic", "sensor.drift"}
    first, later = (
        [set(pair.mechanisms) for pair in propose_pairs(one, problem.thresholds.search)].index(wanted)
        for one in (plain, whitened)
    )
    assert first == 0
    assert later > 3
    assert plain.tests == whitened.tests
