"""A change of what a signal is at rest, the input or a reading, since the model was identified on its device.

An identified model needs no corrections of its signals. Where a re-fit needs those of one, and nearly all of the error
returns without them, the device has changed, or the model is that of another one. What changed is the simplest that
does the same: an offset, a gain, or a mechanism that acts at rest (a dead zone, a heater whose resistance grows, a
current that leaks into the reading). Each is fitted alone, in place of all corrections of the signal.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import plain_unit
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.statement import state_mechanism
from rtctl.diagnosis.residual.noise_floor import noise_cost_of
from rtctl.diagnosis.residual.parameter_estimates import estimates_of
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.result import Cause, Diagnosis
from rtctl.diagnosis.search.holdout_error import certainly_falls
from rtctl.diagnosis.search.request import SearchRequest
from rtctl.diagnosis.search.stepwise import significance_level
from rtctl.diagnosis.verification.loop_model import model_for_loop
from rtctl.diagnosis.verification.whole_record_fits import Fits, HoldoutData

KNOWN = "known"
"""Shape of a mechanism: share of its steady effect that the loops held already where they were identified."""
START = 0.3
"""Share of its scale at which such a mechanism starts."""
AS_CORRECTIONS = (
    "the extended model has {} as corrections of the signal; its loops were identified again beside these"
)
UNDECIDED = (
    "each of {} alone could stand for what has changed in the signal since the model was identified, but {}: none is "
    "named"
)
TOO_MANY = "something else is missing too, and these data do not decide between them"
NOT_LOWER = "the error on the test records does not fall with certainty"
SINCE = "The {} is {:.4g} {}, and was {:.4g} {} where the model was identified."


class _Change(NamedTuple):
    """One change of a signal at rest, fitted in place of all corrections of the signal."""

    id: str
    """Mechanism, or `parameter.<name>`."""
    fit: Hypothesis


def explain_by_changed_signals(
    answer: Diagnosis, request: SearchRequest, given: Simulation, holdout: HoldoutData
) -> Diagnosis:
    """Return the answer with a change of each signal at rest among its causes, where it needs one.

    Args:
        answer: The answer that the search gives.
        request: Records of the diagnosis.
        given: The model of the file.
        holdout: Test records.
    """
    for signal in dict.fromkeys(one.declared.imitates for one in given.parameters if one.declared.imitates):
        corrections = {
            one.name: one.value
            for one in given.parameters
            if one.declared.imitates == signal and not one.fixed
        }
        if corrections and not answer.stopped:
            answer = _explain(answer, request, given, holdout, corrections)
    return answer


def _explain(
    answer: Diagnosis, request: SearchRequest, given: Simulation, holdout: HoldoutData,
    corrections: Mapping[str, float],
) -> Diagnosis:  # fmt: skip
    """Return the answer with a change of the signal of these corrections (the file's values) among its causes."""
    refit = answer.search.hysteresis_refit  # loops that were learned behind a change fit nothing else
    compared = refit.before if refit else answer.fits.after.hypothesis
    thresholds = answer.problem.thresholds.report
    least = thresholds.changed_signal_misfit**2 * _promised_cost(answer.problem)
    if not _exceeds(answer, compared, corrections, least):
        return answer
    without = _fit(answer, compared.simulation, given, corrections)
    share = _returning_share(answer, compared, without)
    if without is None or without.cost < least or share < thresholds.changed_signal_share:
        return answer
    changes = _list_changes(answer, request.ids, given, compared.simulation, corrections)
    return _told(answer, request, given, holdout, without, changes, share) if changes else answer


def _exceeds(answer: Diagnosis, compared: Hypothesis, corrections: Mapping[str, float], least: float) -> bool:
    """Return whether the corrections may matter: a fit without them costs no more than the same values without them."""
    values = np.array([corrections.get(one.name, one.value) for one in compared.simulation.parameters])
    plain = fit_hypothesis(
        answer.problem, compared.simulation.with_values(values), compared.mechanisms, compared.starts, 0,
        compared.fixed_parameters,
    )  # fmt: skip
    return plain is None or plain.cost >= least


def _told(
    answer: Diagnosis, request: SearchRequest, given: Simulation, holdout: HoldoutData, without: Hypothesis,
    changes: Sequence[_Change], share: float,
) -> Diagnosis:  # fmt: skip
    """Return the answer with the best change among its causes; the model has it, unless its loops fit corrections.

    A change by no more than its own uncertainty is none, and the answer stays as it is.
    """
    problem, noise = answer.problem, answer.fits.after.noise
    judged = answer
    if answer.verdict == "unexplained":
        judged = _judged_anew(answer, request, changes[0].fit)
    # which one fits a part best is decided by what else is missing: the simplest leads
    if judged.verdict == "partly_explained":
        changes = sorted(changes, key=lambda one: not one.id.startswith("parameter."))
    before, after = (run_residual_tests(one, problem, (), noise) for one in (without, changes[0].fit))
    if not differs_from_file(changes[0].id, given, after):  # the fit without corrections has ended elsewhere
        return answer
    cause = _cause(answer, given, changes, after, share)
    is_new_part = judged.verdict == "partly_explained" and not answer.causes
    if is_new_part and (doubt := _doubt_part(changes, Fits(before, after), holdout, problem)):
        names = ", ".join((cause.id, *cause.indistinguishable_from))
        return replace(answer, warnings=(*answer.warnings, UNDECIDED.format(names, doubt)))
    answer = judged
    if answer.search.hysteresis_refit:
        after, is_value = answer.fits.after, cause.kind == "parameter"
        notes = () if is_value else (AS_CORRECTIONS.format(cause.id),)
        answer = replace(answer, warnings=(*answer.warnings, *notes))
    fits = Fits(answer.fits.before if answer.causes else before, after)
    extended = model_for_loop(request, after, is_cause=cause.kind == "parameter")
    is_part = answer.verdict == "partly_explained"
    return replace(
        answer,
        verdict="partly_explained" if is_part else "explained",
        causes=tuple(
            sorted(
                (*answer.causes, cause._replace(probability=None) if is_part else cause),
                key=lambda one: -one.share_removed,
            )
        ),
        fits=fits,
        model=extended.model,
        gain=extended.gain_of(fits, holdout, problem.subject.output),
        loop=extended.rehearsal,
    )


def _doubt_part(changes: Sequence[_Change], fits: Fits, holdout: HoldoutData, problem: Problem) -> str:
    """Return why the best change is not named as a part of the explanation; "": it is.

    As for any part (`choose_largest_part`): on test records an error certainly falls, and few others do the same.
    """
    if len(changes) - 1 > problem.thresholds.search.most_part_rivals:
        return TOO_MANY
    gains = [gain for name in holdout.outputs if (gain := holdout.gain_of(fits, name)) is not None]
    return "" if not gains or certainly_falls(gains) else NOT_LOWER


def _judged_anew(answer: Diagnosis, request: SearchRequest, fit: Hypothesis) -> Diagnosis:
    """Return an unexplained answer as partly explained, or as explained if the change passes the residual tests."""
    tested = run_residual_tests(fit, answer.problem, request.ids)
    if not tested.p_value > significance_level(answer.problem, request.options.false_claim_rate):
        return replace(answer, verdict="partly_explained")
    search = answer.search._replace(chosen=tested, passes=True)
    return replace(
        answer, verdict="explained", search=search, shape=None, next_experiment=None,
        warnings=tuple(filter(None, [answer.doubt])),
    )  # fmt: skip


def _fit(
    answer: Diagnosis, simulation: Simulation, given: Simulation, held: Mapping[str, float]
) -> Hypothesis | None:
    """Fit a simulation from the file's values, some parameters held; None where that diverges."""
    start = {**{one.name: one.value for one in given.parameters}, **held}
    values = np.array([start.get(one.name, one.value) for one in simulation.parameters])
    mechanisms = [one.id for one in simulation.mechanisms]
    fixed = answer.fits.after.hypothesis.fixed_parameters | set(held)
    return fit_hypothesis(answer.problem, simulation.with_values(values), mechanisms, fixed_parameters=fixed)


def _promised_cost(problem: Problem) -> float:
    """Return the cost of the misfit that the model's identification promises."""
    shares = sum(square / problem.size(name) ** 2 for name, square in problem.allowed.items())
    return 0.5 * problem.samples * shares


def _returning_share(answer: Diagnosis, compared: Hypothesis, without: Hypothesis | None) -> float:
    """Return the fraction of the squared error beyond the noise that returns without corrections of the signal."""
    if without is None:
        return 0.0
    removable = without.cost - noise_cost_of(answer.fits.after)
    return float(np.clip((without.cost - compared.cost) / removable, 0.0, 1.0)) if removable > 0.0 else 0.0


def _list_changes(
    answer: Diagnosis,
    ids: Sequence[str],
    given: Simulation,
    simulation: Simulation,
    corrections: Mapping[str, float],
) -> list[_Change]:
    """Return what explains the records in place of all corrections, the best fit first, others that are near after it.

    Each correction alone, and each mechanism that it imitates, from after the identification.
    """
    found: list[tuple[str, Hypothesis | None]] = []
    for name in corrections:
        held = {other: value for other, value in corrections.items() if other != name}
        found.append((f"parameter.{name}", _fit(answer, simulation, given, held)))
    acting = {one.id for one in simulation.mechanisms}
    imitated = [one.declared.imitates for one in given.parameters if one.name in corrections]
    for identity in dict.fromkeys(name for names in imitated for name in names):
        if identity in ids and identity not in acting:
            found.append((identity, _fit_mechanism(answer, simulation, given, identity, corrections)))
    changes = [_Change(name, fit) for name, fit in found if fit is not None]
    changes.sort(key=lambda one: one.fit.cost)
    most = (
        changes[0].fit.cost * answer.problem.thresholds.report.changed_signal_cost_ratio if changes else 0.0
    )
    return [one for one in changes if one.fit.cost <= most]


def _fit_mechanism(
    answer: Diagnosis,
    simulation: Simulation,
    given: Simulation,
    identity: str,
    corrections: Mapping[str, float],
) -> Hypothesis | None:
    """Fit a mechanism of which the loops hold nothing, in place of all corrections of the signal."""
    extended = simulation.extended((identity,))
    values: FloatArray = np.array([one.value for one in extended.parameters])
    for k, one in enumerate(extended.parameters):
        if one.mechanism == identity and not one.declared.is_shape:
            values[k] = START * one.declared.scale(answer.problem.scales)
    held = {**corrections, f"{identity}.{KNOWN}": 0.0}
    return _fit(answer, extended.with_values(values), given, held)


def differs_from_file(identity: str, given: Simulation, tested: TestedHypothesis) -> bool:
    """Return whether a change is one by its interval: the value of the file, or no effect, is outside of it."""
    name = identity.removeprefix("parameter.")
    if name != identity:
        estimate = estimates_of(tested, "")[name]
        before = next(one.value for one in given.parameters if one.name == name)
        return not estimate.low <= before <= estimate.high
    estimates = estimates_of(tested, identity)
    mechanism = next(one for one in tested.hypothesis.simulation.mechanisms if one.id == identity)
    own = [(estimates[one.name], one.neutral) for one in mechanism.amplitudes if one.name in estimates]
    return any(neutral is not None and not one.low <= neutral <= one.high for one, neutral in own)


def _cause(
    answer: Diagnosis, given: Simulation, changes: Sequence[_Change], tested: TestedHypothesis, share: float
) -> Cause:
    """Return the change that fits best as a cause, beside those that are near."""
    best = changes[0]
    weights = np.array([1.0 / max(one.fit.cost, 1e-300) for one in changes])
    names = [name for one in changes for name in (one.id, *_same_law(one, given))]
    likeliest = min(answer.problem.thresholds.report.max_probability, float(weights[0] / weights.sum()))
    is_value = best.id.startswith("parameter.")
    estimates = estimates_of(tested, "" if is_value else best.id)
    if is_value:
        name = best.id.removeprefix("parameter.")
        estimates = {name: estimates[name]}
        statement = _state_value(name, given, tested)
    else:
        mechanism = next(one for one in best.fit.simulation.mechanisms if one.id == best.id)
        statement = state_mechanism(mechanism, estimates)
    return Cause(
        id=best.id,
        statement=statement,
        kind="parameter" if is_value else "mechanism",
        probability=likeliest,
        parameters=estimates,
        share_removed=share,
        indistinguishable_from=tuple(name for name in names if name != best.id),
        same_law=_same_law(best, given),
    )


def _same_law(change: _Change, given: Simulation) -> tuple[str, ...]:
    """Return the mechanism that is one law with a correction below zero: a dead zone that every current exceeds."""
    name = change.id.removeprefix("parameter.")
    declared = next((one.declared for one in given.parameters if one.name == name), None)
    value = next((one.value for one in change.fit.simulation.parameters if one.name == name), 0.0)
    return (declared.opposite,) if declared is not None and declared.opposite and value < 0.0 else ()


def _state_value(name: str, given: Simulation, tested: TestedHypothesis) -> str:
    """Say which correction the signal needs."""
    estimate = estimates_of(tested, "")[name]
    before = next(one.value for one in given.parameters if one.name == name)
    unit = plain_unit(estimate.unit)
    text = SINCE.format(
        name.replace("_", " of the ", 0).replace("_", " "), estimate.value, unit, before, unit
    )
    return text.replace(" ,", ",").replace("  ", " ")
