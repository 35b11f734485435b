"""`hysteresis.shape` from the staircases: named where domains switch as one, alone and beside a delay, and extended."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from coarse_cases import dataset, identified, readings, stepped_film
from vo2_model_cases import PERIOD_S, TAU_S, UNITS

from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.problem.cancellation import CancellationToken
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.work_budget import WorkBudget
from rtctl.diagnosis.report.causes import REFITTED_LOOPS
from rtctl.diagnosis.report.pictures import noise_density, pictures
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search import catalogue_search as causes
from rtctl.diagnosis.search.catalogue_search import correct_after_search
from rtctl.diagnosis.search.request import DiagnosisOptions, SearchRequest
from rtctl.diagnosis.search.sentences import LOOPS_NOT_CHECKED, LOOPS_NOT_REFITTED
from rtctl.diagnosis.search.static_loops import hysteresis_refit
from rtctl.diagnosis.search.stepwise import significance_level
from rtctl.diagnosis.thresholds import SearchThresholds, Thresholds
from rtctl.diagnosis.verification import nonparametric_comparison
from rtctl.diagnosis.verification.holdout_gain import judge_search
from rtctl.identification.vo2.heating import simulate_heating
from rtctl.measured.dataset import Dataset
from rtctl.models.vo2 import read_model, write_model
from rtctl.simulations.vo2 import vo2_simulation
from rtctl.wiring_models import mechanism_ids

LATE = 4
"""Samples."""
LAG_S = 0.05e-3
FEW_LEVELS = 17
MORE_LEVELS = 27
"""So many that the gate lets pass what the loops are off by between them."""
ZONE_MA = 8.0
SLOW_SHARE, SLOW_S = 0.02, 25e-3
UNCORRECTED = Thresholds(search=SearchThresholds(worth_correcting=np.inf))
"""Loops stay as they are behind a set that passes."""
FEW = ("actuation.delay", "sensor.lag")
"""Names, so that a search is short."""


def answer(problem, model, report=lambda text: None, ids=None, **options):
    simulation = vo2_simulation(model, UNITS, "model.toml")
    chosen = DiagnosisOptions(threads=1, **options)
    return diagnose(problem, model, simulation, ids or mechanism_ids("vo2"), chosen, report)


def with_limits(problem, **search):
    """The problem with other thresholds of the search."""
    limits = dataclasses.replace(problem.thresholds.search, **search)
    return dataclasses.replace(problem, thresholds=dataclasses.replace(problem.thresholds, search=limits))


def stopped_at(text, problem, model, **options):
    """The answer where the user stops as soon as `text` is reported."""
    cancellation = CancellationToken()

    def report(reported):
        if reported == text:
            cancellation.cancel()

    return answer(problem, model, report, cancellation=cancellation, **options)


def late(problem: Dataset) -> Dataset:
    """The same film whose commands arrive late."""
    records = []
    for one in problem.records:
        current = one.signals["current"]
        early = current if one.use == "identify" else np.r_[current[LATE:], [current[-1]] * LATE]
        records.append(dataclasses.replace(one, signals={**one.signals, "current": early}))
    return dataclasses.replace(problem, records=tuple(records))


@pytest.fixture(scope="module")
def stepped():
    return stepped_film()


@pytest.fixture(scope="module")
def found(stepped):
    return answer(*stepped)


@pytest.mark.slow
def test_domains_that_switch_as_one_are_named_and_learned(found, tmp_path):
    assert found.verdict in ("explained", "partly_explained")
    (cause,) = found.causes
    assert cause.id == hysteresis_refit.ID
    assert "instead of" in cause.statement
    assert cause.parameters["deflection_misfit"].unit == "um"
    assert found.gain is not None
    assert found.gain.ratio_low > 1.0
    write_model(found.model, tmp_path / "model-extended.toml")
    model = read_model(tmp_path / "model-extended.toml")
    given = found.search.hysteresis_refit.coarse["deflection"].given
    assert not np.array_equal(model.deflection_preisach.grid, given.grid)
    assert model.mechanisms == ()


@pytest.mark.slow
def test_loops_of_which_the_staircases_show_little_imitate_what_is_missing(found):
    """Alone they are a cause only by what the identification's own records show of them."""
    verdict = judge_search(found.search, found.problem)
    limited = with_limits(found.problem, small_set_share=1.0)
    doubted = {
        passes: judge_search(found.search._replace(passes=passes), limited) for passes in (True, False)
    }
    assert verdict.names_causes
    assert (doubted[True].claim, doubted[False].claim) == ("adequate", "unexplained")
    assert "lies between their levels" in doubted[True].notes[-1]
    assert "imitate what is missing" in doubted[False].notes[-1]


@pytest.mark.slow
def test_the_page_shows_where_relays_switch(found):
    assert "loops" in [picture.section for picture in pictures(found)]


@pytest.mark.slow
def test_a_delay_beside_them_is_named_and_they_are_put_right(stepped):
    """What the staircases show of the loops is a small part of what a delay of four samples leaves."""
    problem, model = stepped
    found = answer(late(problem), model)
    assert [cause.id for cause in found.causes] == ["actuation.delay"]
    assert found.search.hysteresis_refit is not None
    assert any("static loops of the model are coarse" in one for one in found.warnings)


@pytest.mark.slow
def test_one_may_stop_before_the_loops_are_learned(stepped):
    found = stopped_at("the static loops, learned anew: resistance", *stepped, seconds=1.0)
    assert found.stopped
    assert LOOPS_NOT_CHECKED in found.warnings
    assert hysteresis_refit.ID not in [cause.id for cause in found.causes]


@pytest.mark.slow
def test_loops_that_are_no_help_on_test_records_are_not_learned(found, stepped):
    at_nominal = found.search._replace(chosen=found.search.nominal, hysteresis_refit=None, leave_one_out=())
    problem = dataclasses.replace(found.problem, executor=None)
    refitter = hysteresis_refit.LoopRefitter(
        coarse=found.search.hysteresis_refit.coarse, problem=with_limits(problem, least_holdout_gain=100.0),
        tests=found.tests, ids=mechanism_ids("vo2"), level=0.01,
    )  # fmt: skip
    assert refitter.refit_behind(at_nominal) is at_nominal


@pytest.fixture(scope="module")
def few_levels():
    problem = dataset(share=0.0, steps=FEW_LEVELS)
    return late(problem), identified(problem)


@pytest.mark.slow
def test_loops_between_the_levels_of_few_are_put_right_behind_a_delay(few_levels):
    found = answer(*few_levels, ids=FEW)
    assert found.verdict == "explained"
    assert [cause.id for cause in found.causes] == ["actuation.delay"]
    assert REFITTED_LOOPS in found.warnings
    before, after = found.search.hysteresis_refit.before, found.search.chosen.hypothesis
    assert after.cost < 0.5 * before.cost
    given = few_levels[1].deflection_preisach
    assert not np.array_equal(found.model.deflection_preisach.grid, given.grid)


def weakening(problem: Dataset, share: float) -> Dataset:
    """The same film behind an amplifier that has lost a share of its gain at the end of a record."""
    records = []
    for one in problem.records:
        current = one.signals["current"]
        lost = 0.0 if one.use == "identify" else share * np.arange(len(current)) / len(current)
        records.append(dataclasses.replace(one, signals={**one.signals, "current": current * (1.0 + lost)}))
    return dataclasses.replace(problem, records=tuple(records))


def test_causes_that_leave_about_as_much_are_compared_behind_loops_of_their_own():
    """What the loops are off by is most of what both leave, a drift of the gain and one of the room."""
    given, drifts = dataset(share=0.0, steps=FEW_LEVELS), ("input.gain_drift", "thermal.ambient_drift")
    model, problem = identified(given), weakening(given, 0.01)
    first = answer(problem, model, ids=drifts)
    clean = dataclasses.replace(first.problem, executor=None)
    (rooms,) = (one.hypothesis for one in first.search.rankings[0] if one.hypothesis.mechanisms == drifts[1:])
    refitter = hysteresis_refit.LoopRefitter(
        coarse=first.problem.subject.find_identified_parts(model, problem), problem=clean,
        tests=first.tests, ids=drifts, level=significance_level(clean, 0.05),
    )  # fmt: skip
    wrong = first.search._replace(chosen=run_residual_tests(rooms, clean, drifts), hysteresis_refit=None)
    behind = refitter.refit_behind(wrong)
    assert behind.chosen.hypothesis.mechanisms == drifts[:1]
    assert behind.chosen.hypothesis.cost < 0.5 * first.search.rankings[0][0].hypothesis.cost


def lagging(problem: Dataset, lag_s: float) -> Dataset:
    """The same film read by a meter that lags."""
    records, kept, mean = [], np.exp(-PERIOD_S / lag_s), lag_s / PERIOD_S * -np.expm1(-PERIOD_S / lag_s)
    for one in problem.records:
        true, read = one.signals["resistance"], one.signals["resistance"].copy()
        for k in range(1, len(read)):
            read[k] = kept * read[k - 1] + (mean - kept) * true[k - 1] + (1.0 - mean) * true[k]
        records.append(dataclasses.replace(one, signals={**one.signals, "resistance": read}))
    return dataclasses.replace(problem, records=tuple(records))


def test_a_second_cause_is_found_behind_loops_that_were_refitted_behind_the_first(few_levels):
    problem, model = few_levels
    first = answer(lagging(problem, LAG_S), model, ids=FEW[:1])
    clean = dataclasses.replace(first.problem, executor=None)
    refitter = hysteresis_refit.LoopRefitter(
        coarse=first.problem.subject.find_identified_parts(model, problem),
        problem=with_limits(clean, least_holdout_gain=1.0),
        tests=first.tests, ids=FEW, level=significance_level(clean, 0.05),
    )  # fmt: skip
    behind = refitter.refit_behind(first.search)
    assert behind.chosen.hypothesis.mechanisms == ("actuation.delay",)
    assert not behind.passes
    both = refitter.add_causes(behind)
    assert both.chosen.hypothesis.mechanisms == ("actuation.delay", "sensor.lag")
    assert both.chosen.hypothesis.cost < 0.7 * behind.chosen.hypothesis.cost
    found = {one.name: one.value for one in both.chosen.hypothesis.simulation.parameters}
    assert found["sensor.lag.time_constant"] == pytest.approx(LAG_S, rel=0.2)


@pytest.mark.slow
def test_a_small_cause_beside_them_is_none_where_other_loops_explain_it(few_levels):
    """It would matter beside loops that are learned behind it, whose errors are smaller than what it is taken for."""
    problem, model = few_levels
    found = answer(problem, model, ids=FEW)
    delayed, clean = found.search.hysteresis_refit.before, dataclasses.replace(found.problem, executor=None)
    more = delayed.simulation.extended(("thermal.ambient_drift",))
    both = fit_hypothesis(clean, more, (*delayed.mechanisms, "thermal.ambient_drift"), delayed.starts)
    assert both is not None
    assert both.cost < 0.995 * delayed.cost
    search = found.search._replace(
        chosen=run_residual_tests(both, clean, FEW), passes=False, hysteresis_refit=None, leave_one_out=()
    )
    refitter = hysteresis_refit.LoopRefitter(
        coarse=found.problem.subject.find_identified_parts(model, problem),
        problem=with_limits(clean, negligible_cost=0.0),
        tests=found.tests, ids=FEW, level=significance_level(clean, 0.05),
    )  # fmt: skip
    after = refitter.refit_behind(search)
    assert after.passes
    assert after.chosen.hypothesis.mechanisms == ("actuation.delay",)


def heated_slowly(problem: Dataset) -> Dataset:
    """The same film of which a part of the heating comes later than a step of the staircase lasts."""
    records = []
    for number, one in enumerate(problem.records):
        current = one.signals["current"]
        fast, slow = (simulate_heating(current, PERIOD_S, tau) for tau in (TAU_S, SLOW_S))
        heat = np.sqrt((1.0 - SLOW_SHARE) * fast**2 + SLOW_SHARE * slow**2)
        records.append(
            dataclasses.replace(one, signals={"current": current, **readings(heat, 0.3, seed=number)})
        )
    return dataclasses.replace(problem, records=tuple(records))


@pytest.mark.slow
def test_a_cause_that_is_in_the_staircase_too_is_found_behind_loops_that_are_refitted_beside_it():
    """Loops that were identified with it have it in them: it fits badly with these, and loops without it fit well."""
    problem = heated_slowly(dataset(share=0.3))
    found = answer(
        problem, identified(problem), ids=("thermal.second_time_constant", "thermal.phase_heating")
    )
    assert found.causes[0].id == "thermal.second_time_constant"
    assert found.search.hysteresis_refit is not None
    fitted = found.causes[0].parameters
    assert fitted["share"].value == pytest.approx(SLOW_SHARE, rel=0.3)
    assert fitted["time_constant"].value == pytest.approx(SLOW_S, rel=0.4)


def beyond(problem: Dataset, zone_mA: float) -> Dataset:
    """The same film behind a current of which so much does not heat."""
    records = []
    for one in problem.records:
        records.append(
            dataclasses.replace(one, signals={**one.signals, "current": one.signals["current"] + zone_mA})
        )
    return dataclasses.replace(problem, records=tuple(records))


@pytest.mark.slow
def test_loops_are_learned_behind_the_gains_that_they_were_identified_with():
    """Else the current's makes up for loops that are off, and what heats is off for ever after."""
    problem = beyond(dataset(share=0.0, steps=FEW_LEVELS), ZONE_MA)
    found = answer(problem, identified(problem), ids=("actuation.deadband", "sensor.lag"))
    assert [cause.id for cause in found.causes] == ["actuation.deadband"]
    assert found.search.hysteresis_refit is not None
    report = {one.name: one.value for one in found.search.chosen.hypothesis.simulation.parameters}
    assert report["actuation.deadband.zone"] == pytest.approx(ZONE_MA, rel=1e-3)
    assert report["current_gain"] == pytest.approx(1.0, abs=5e-4)
    assert report["current_offset"] == pytest.approx(0.0, abs=5e-4)


@pytest.mark.slow
def test_loops_that_are_off_by_no_more_than_a_model_may_be_are_put_right_too():
    problem = dataset(share=0.0, steps=MORE_LEVELS)
    case = late(problem), identified(problem)
    found = answer(*case, ids=FEW)
    as_they_are = answer(*case, ids=FEW, thresholds=UNCORRECTED)
    for one in (found, as_they_are):
        assert one.verdict == "explained"
        assert [cause.id for cause in one.causes] == ["actuation.delay"]
        assert one.search.passes
    assert REFITTED_LOOPS in found.warnings
    assert as_they_are.search.hysteresis_refit is None
    assert found.gain.after < 0.6 * as_they_are.gain.after


@pytest.mark.slow
def test_what_passes_is_put_right_for_any_certain_gain_unless_others_pass_too():
    problem = dataset(share=0.0, steps=MORE_LEVELS)
    case = late(problem), identified(problem)
    found = answer(*case, ids=FEW, thresholds=UNCORRECTED)
    clean = dataclasses.replace(found.problem, executor=None, thresholds=Thresholds())
    request = SearchRequest(
        with_limits(clean, least_holdout_gain=5.0),  # more than loops gain, less than the delay does
        found.search.nominal.hypothesis, case[1], case[0], found.tests,
        FEW, DiagnosisOptions(), WorkBudget.of(60.0), lambda text: None,
    )  # fmt: skip
    assert correct_after_search(request, found.search).hysteresis_refit is not None
    several = found.search._replace(equivalent=(found.search.chosen.hypothesis,))
    assert correct_after_search(request, several) is several
    left = found.search._replace(passes=False)
    loops = found.problem.subject.find_identified_parts(case[1], case[0])
    assert request.loop_refitter(loops).refit_behind(left) is left


@pytest.mark.slow
def test_loops_do_not_hide_that_a_law_of_no_name_explains_more(few_levels, monkeypatch):
    for module in (causes, nonparametric_comparison):
        monkeypatch.setattr(module, "find_better_alternative", lambda *anything: "A law.")
    found = answer(*few_levels, ids=FEW)
    assert found.verdict == "unexplained"
    assert found.search.hysteresis_refit is None
    assert any("A law." in warning for warning in found.warnings)


@pytest.mark.slow
def test_one_may_stop_before_the_loops_are_put_right(few_levels):
    found = stopped_at("the static loops, learned anew: resistance", *few_levels, ids=FEW[:1])
    assert found.stopped
    assert LOOPS_NOT_REFITTED in found.warnings
    assert [cause.id for cause in found.causes] == ["actuation.delay"]


@pytest.mark.slow
def test_the_noise_that_is_drawn_is_that_of_the_deflection(found):
    period_s = 1e-3
    frequency, density = noise_density(found, period_s)
    assert frequency[-1] == pytest.approx(0.5 / period_s)
    assert np.sqrt(np.mean(density**2) * frequency[-1]) == pytest.approx(found.noise_rms, rel=0.02)
