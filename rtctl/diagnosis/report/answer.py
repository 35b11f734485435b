"""The answer of a diagnosis: verdict, causes with evidence, where the gap lives; the content of `diagnosis.json`."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rtctl.border.mechanisms import plain_unit
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.problem.statement import state_mechanism
from rtctl.diagnosis.report.joint_statements import joint_statements
from rtctl.diagnosis.residual.parameter_estimates import estimates_of
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.result import Cause
from rtctl.diagnosis.search.hysteresis_refit import ID as HYSTERESIS_SHAPE
from rtctl.diagnosis.search.model_selection import RankedHypothesis
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.verification.wald_test import WrongValue
from rtctl.identification.vo2.coarse_loops import UNITS, describe_improvement

MOST_CERTAIN = 0.999
"""No probability is higher: the catalogue is not the world."""
IDENTIFICATION_ERROR = 0.1
"""Of the removable error: what a correction of the identified model may remove beside other causes and be none."""

HYSTERESIS_STATEMENT = (
    "The static loops are modelled too coarsely, relays switch together: of the staircases, cells placed where they do "
    "leave {}. Learned anew from the staircases and the fitted records."
)


def causes_of(search: SearchResult, noise_cost: float, estimated: TestedHypothesis) -> list[Cause]:
    """Most certain first; values by the fit `estimated` of what was chosen."""
    chosen = search.chosen
    probabilities = _probabilities(search)
    together = joint_statements(estimated.hypothesis.simulation)
    found = [
        Cause(
            id=mechanism.id,
            statement=" ".join([state_mechanism(mechanism, estimates), *together.get(mechanism.id, [])]),
            kind="mechanism",
            probability=probabilities.get(mechanism.id, 0.0),
            parameters=estimates,
            share_removed=_share(search, mechanism.id, noise_cost),
            indistinguishable_from=_equivalents(search, mechanism.id),
        )
        for mechanism in chosen.hypothesis.simulation.mechanisms
        if mechanism.id in chosen.hypothesis.mechanisms
        and mechanism.id not in search.nominal.hypothesis.mechanisms
        for estimates in (estimates_of(estimated, mechanism.id),)
    ]
    qualifies = {"drive.offset"} if together else set()  # says how the friction depends on direction
    return sorted(found, key=lambda cause: (-cause.probability, cause.id in qualifies, -cause.share_removed))


def loops_cause(found: SearchResult, noise_cost: float) -> Cause | None:
    """The loops as a cause; None where they were not learned anew, or only put right."""
    if found.hysteresis_refit is None or not found.hysteresis_refit.is_cause:
        return None
    removable = found.nominal.hypothesis.cost - noise_cost
    removed = found.hysteresis_refit.before.cost - found.chosen.hypothesis.cost
    parameters = {}
    for output, one in found.hysteresis_refit.coarse.items():
        value, low, high = one.misfit
        parameters[f"{output}_misfit"] = Estimate(value, low, high, UNITS[output])
    return Cause(
        id=HYSTERESIS_SHAPE, statement=HYSTERESIS_STATEMENT.format(describe_improvement(found.hysteresis_refit.coarse)),
        kind="mechanism", probability=MOST_CERTAIN,
        parameters=parameters,
        share_removed=float(np.clip(removed / removable, 0.0, 1.0)) if removable > 0.0 else 0.0,
        indistinguishable_from=(),
    )  # fmt: skip


def apart_from_identification(
    causes: Sequence[Cause], simulations: Sequence[Simulation]
) -> tuple[list[Cause], tuple[str, ...]]:
    """`causes`, and the ids of those taken out: small ones that may be an error of identification under the others.

    The model was identified from records in which the others acted already, so it has to be corrected once they are
    in it. That is no effect of the device. `simulations`: of the causes, and of what the data do not tell from them.
    """
    own = {one.id for simulation in simulations for one in simulation.mechanisms if one.of_identification}
    small = [
        cause
        for cause in causes
        if cause.share_removed < IDENTIFICATION_ERROR and own & {cause.id, *cause.indistinguishable_from}
    ]
    if len(small) == len(causes):
        return list(causes), ()
    return [cause for cause in causes if cause not in small], tuple(cause.id for cause in small)


def wrong_value_cause(wrong: WrongValue) -> Cause:
    """The cause `parameter.<name>`: the structure is right, a value is off."""
    estimate = estimates_of(wrong.revised, "")[wrong.name]
    given = next(one for one in wrong.given.hypothesis.simulation.parameters if one.name == wrong.name)
    unit = plain_unit(given.unit)
    return Cause(
        id=f"parameter.{wrong.name}",
        statement=f"The structure is right, a value is off: {wrong.name} is {estimate.value:.4g} {unit}, "
        f"and the model has {given.value:.4g} {unit}.",
        kind="parameter",
        probability=min(MOST_CERTAIN, wrong.probability),
        parameters={wrong.name: estimate},
        share_removed=wrong.share_removed,
        indistinguishable_from=tuple(f"parameter.{name}" for name in wrong.equivalent),
    )


def _probabilities(search: SearchResult) -> dict[str, float]:
    """Of each id, from the BIC weights of all sets of the chosen size; never certain.

    Where the chosen one was preferred for what it leaves within stretches, sets of a lower BIC count as much.
    """
    ranking: Sequence[RankedHypothesis] = search.rankings[-1] if search.rankings else ()
    if not ranking:
        return {}
    size = len(search.chosen.hypothesis.mechanisms)
    ranking = next((one for one in search.rankings if len(one[0].hypothesis.mechanisms) == size), ranking)
    mine = frozenset(search.chosen.hypothesis.mechanisms)
    first = next((one.bic for one in ranking if frozenset(one.hypothesis.mechanisms) == mine), ranking[0].bic)
    weights = [math.exp(-0.5 * min(max(one.bic - first, 0.0), 1400.0)) for one in ranking]
    total = sum(weights)
    found: dict[str, float] = {}
    for one, weight in zip(ranking, weights, strict=True):
        for identity in one.hypothesis.mechanisms:
            found[identity] = found.get(identity, 0.0) + weight / total
    return {identity: min(MOST_CERTAIN, probability) for identity, probability in found.items()}


def _share(search: SearchResult, identity: str, noise_cost: float) -> float:
    """Of the removable error (above the noise), what is lost again without this cause."""
    chosen = search.chosen.hypothesis
    rest = frozenset(chosen.mechanisms) - {identity}
    without = search.nominal.hypothesis.cost
    for one in search.leave_one_out:
        if frozenset(one.mechanisms) == rest:
            without = one.cost
    removable = search.nominal.hypothesis.cost - noise_cost
    if not removable > 0.0:
        return 0.0
    return float(np.clip((without - chosen.cost) / removable, 0.0, 1.0))


def _equivalents(search: SearchResult, identity: str) -> tuple[str, ...]:
    """Ids that stand in for this one in sets that explain the data as well."""
    mine = frozenset(search.chosen.hypothesis.mechanisms)
    found = []
    for other in search.equivalent:
        theirs = frozenset(other.mechanisms)
        if identity not in theirs and len(theirs - mine) == 1 and len(mine - theirs) == 1:
            found += list(theirs - mine)
    return tuple(dict.fromkeys(found))
