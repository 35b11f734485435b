"""The causes of an answer with their evidence: probability, share of the error, and what could replace them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from rtctl.border.mechanisms import plain_unit
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.statement import state_mechanism
from rtctl.diagnosis.report.joint_statements import joint_statements
from rtctl.diagnosis.report.same_laws import add_same_laws
from rtctl.diagnosis.report.shares import sequential_shares, shares_that_return
from rtctl.diagnosis.residual.parameter_estimates import estimates_of
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.result import Cause
from rtctl.diagnosis.search.model_selection import RankedHypothesis
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.static_loops.hysteresis_refit import ID as HYSTERESIS_SHAPE
from rtctl.diagnosis.search.static_loops.hysteresis_refit import share_in_staircases
from rtctl.diagnosis.thresholds import ReportThresholds
from rtctl.diagnosis.verification.verify import Verified
from rtctl.diagnosis.verification.wald_test import WrongValue

HYSTERESIS_STATEMENT = (
    "Relays switch together, so the static loops are too coarse. Cells placed at the switching points reduce the "
    "misfit on the staircases to {}. The loops were identified again from the staircases and the fitted records."
)
REFITTED_LOOPS = (
    "the static loops of the extended model were identified again from the staircases and the fitted records, which "
    "reduces the error on the test records: this is no cause, since the staircases did not measure between their levels"
)
COARSE_LOOPS = (
    "the staircases show that the static loops of the model are too coarse. They were identified again for the "
    "extended model, which removes {:.1%} of the squared error: an error of the identification, and no cause"
)
CORRECTED = (
    "{} is in the extended model but is no cause: the model was identified while the causes acted, and once they are "
    "modelled its loops need that small correction"
)


class NamedCauses(NamedTuple):
    """The causes that are reported, and notes on what is in the extended model and no cause."""

    causes: tuple[Cause, ...] = ()
    notes: tuple[str, ...] = ()


def name_causes(
    search: SearchResult,
    verified: Verified,
    problem: Problem,
    same_laws: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> NamedCauses:
    """Return the causes of the chosen set with their evidence, without mere corrections of the identified model.

    Args:
        search: What was found.
        verified: The verdict, which may name no cause, and the fit of whole records that gives the values.
        problem: Records that were fitted.
        same_laws: Mechanisms that are the same law as another one, by that one.
    """
    if not verified.verdict.names_causes:
        return NamedCauses()
    thresholds, estimated, notes = problem.thresholds.report, verified.fits.after, []
    causes = [
        cause._replace(
            indistinguishable_from=add_same_laws(cause.indistinguishable_from, cause.id, same_laws),
            same_law=tuple(same_laws.get(cause.id, ())),
        )
        for cause in mechanism_causes(search, estimated, thresholds)
    ]
    shape = hysteresis_cause(search, problem)
    if shape is not None and (not causes or shape.share_removed >= thresholds.identification_error_share):
        causes.append(shape)
    elif search.hysteresis_refit:
        notes.append(REFITTED_LOOPS if shape is None else COARSE_LOOPS.format(shape.share_removed))
    simulations = [one.simulation for one in (estimated.hypothesis, *search.equivalent)]
    causes, corrections = separate_corrections(causes, simulations, thresholds, shares_that_return(search))
    if verified.verdict.claim == "partly_explained":
        causes = [cause._replace(probability=None) for cause in causes]
    if corrections:
        notes.append(CORRECTED.format(" and ".join(corrections)))
    return NamedCauses(tuple(causes), tuple(notes))


def mechanism_causes(
    search: SearchResult, estimated: TestedHypothesis, thresholds: ReportThresholds
) -> list[Cause]:
    """Return the mechanisms that the chosen set adds, most probable first; values are those of `estimated`."""
    added = set(search.chosen.hypothesis.mechanisms) - set(search.nominal.hypothesis.mechanisms)
    probabilities = _probabilities(search, thresholds.max_probability)
    shares = sequential_shares(search)
    joint = joint_statements(estimated.hypothesis.simulation)
    causes = []
    for mechanism in search.chosen.hypothesis.simulation.mechanisms:
        if mechanism.id not in added:
            continue
        estimates = estimates_of(estimated, mechanism.id)
        cause = Cause(
            id=mechanism.id,
            statement=" ".join([state_mechanism(mechanism, estimates), *joint.get(mechanism.id, [])]),
            kind="mechanism",
            probability=probabilities.get(mechanism.id, 0.0),
            parameters=estimates,
            share_removed=shares.get(mechanism.id, 0.0),
            indistinguishable_from=_equivalents_of(search, mechanism.id),
        )
        causes.append(cause)
    qualifiers = {"drive.offset"} if joint else set()  # says how the friction depends on direction
    corrections = {one.id for one in search.chosen.hypothesis.simulation.mechanisms if one.of_identification}
    return sorted(
        causes,
        key=lambda one: (
            one.id in corrections,
            one.id in qualifiers,
            -(one.probability or 0.0),
            -one.share_removed,
        ),
    )


def hysteresis_cause(search: SearchResult, problem: Problem) -> Cause | None:
    """Return the static hysteresis as a cause; None where it was not refitted, or only corrected."""
    refit, describe = search.hysteresis_refit, problem.subject.describe_coarse_parts
    if describe is None or refit is None or not refit.is_cause:
        return None
    parameters = {}
    for output, one in refit.coarse.items():
        value, low, high = one.misfit
        parameters[f"{output}_misfit"] = Estimate(value, low, high, problem.subject.coarse_part_units[output])
    return Cause(
        id=HYSTERESIS_SHAPE,
        statement=HYSTERESIS_STATEMENT.format(describe(refit.coarse)),
        kind="mechanism",
        probability=None,  # no set of causes was weighed against it
        parameters=parameters,
        share_removed=share_in_staircases(search, problem),
        indistinguishable_from=(),
    )


def separate_corrections(
    causes: Sequence[Cause],
    simulations: Sequence[Simulation],
    thresholds: ReportThresholds,
    returning: Mapping[str, float] = MappingProxyType({}),
) -> tuple[list[Cause], tuple[str, ...]]:
    """Return the causes without small corrections of the identified model, and the ids of those corrections.

    The model was identified from records in which the other causes acted already, so it has to be corrected once they
    are modelled. That is no effect of the device. Where all causes are small corrections, they are kept.

    Args:
        causes: Causes of the chosen set.
        simulations: Models of the chosen set, and of those that the data do not tell from it.
        thresholds: Thresholds of the report.
        returning: Share of the squared error that returns without a cause, by id; else the share that it removes.
    """
    own = {one.id for simulation in simulations for one in simulation.mechanisms if one.of_identification}
    least = thresholds.identification_error_share
    small = [
        cause
        for cause in causes
        if returning.get(cause.id, cause.share_removed) < least
        and own & {cause.id, *cause.indistinguishable_from}
    ]
    if len(small) == len(causes):
        return list(causes), ()
    return [cause for cause in causes if cause not in small], tuple(cause.id for cause in small)


def wrong_value_cause(wrong: WrongValue, thresholds: ReportThresholds) -> Cause:
    """Return the cause `parameter.<name>`: the structure is right, a value is wrong."""
    estimate = estimates_of(wrong.revised, "")[wrong.name]
    given = next(one for one in wrong.given.hypothesis.simulation.parameters if one.name == wrong.name)
    unit = plain_unit(given.unit)
    return Cause(
        id=f"parameter.{wrong.name}",
        statement=f"The structure is right, a value is off: {wrong.name} is {estimate.value:.4g} {unit}, "
        f"and the model has {given.value:.4g} {unit}.",
        kind="parameter",
        probability=min(thresholds.max_probability, wrong.probability),
        parameters={wrong.name: estimate},
        share_removed=wrong.share_removed,
        indistinguishable_from=tuple(f"parameter.{name}" for name in wrong.equivalent),
    )


def _probabilities(search: SearchResult, largest: float) -> dict[str, float]:
    """Return the probability of each id, from the BIC weights of all sets of the chosen size; at most `largest`.

    Where the chosen set was preferred for its cost within segments, sets of a lower BIC count as much as it does.
    """
    ranking: Sequence[RankedHypothesis] = search.rankings[-1] if search.rankings else ()
    if not ranking:
        return {}
    size = len(search.chosen.hypothesis.mechanisms)
    ranking = next((one for one in search.rankings if len(one[0].hypothesis.mechanisms) == size), ranking)
    chosen = frozenset(search.chosen.hypothesis.mechanisms)
    own_bic = (one.bic for one in ranking if frozenset(one.hypothesis.mechanisms) == chosen)
    least = next(own_bic, ranking[0].bic)
    # exp(-700) is the smallest weight that is not rounded to zero
    weights = [math.exp(-0.5 * min(max(one.bic - least, 0.0), 1400.0)) for one in ranking]
    total = sum(weights)
    probabilities: dict[str, float] = {}
    for one, weight in zip(ranking, weights, strict=True):
        for identity in one.hypothesis.mechanisms:
            probabilities[identity] = probabilities.get(identity, 0.0) + weight / total
    return {identity: min(largest, probability) for identity, probability in probabilities.items()}


def _equivalents_of(search: SearchResult, identity: str) -> tuple[str, ...]:
    """Return the ids that replace one cause in sets that explain the data as well."""
    chosen = frozenset(search.chosen.hypothesis.mechanisms)
    replacements: list[str] = []
    for other in search.equivalent:
        theirs = frozenset(other.mechanisms)
        if identity not in theirs and len(theirs - chosen) == 1 and len(chosen - theirs) == 1:
            replacements += theirs - chosen
    return tuple(dict.fromkeys(replacements))
