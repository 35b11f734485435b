"""An offset that the re-fit of an identified model needs, told as a cause: `parameter.<name>`.

A model that was identified on its device has no offset of the current. One that a re-fit makes large, and without which
most of the error returns, is a change of the device since then, and not a correction of the identification. Other
changes of the heating at rest imitate it (a dead zone, a heater whose resistance grows): each is fitted in its place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.parameter_shift import Shift
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.residual.noise_floor import noise_cost_of
from rtctl.diagnosis.residual.parameter_estimates import estimates_of
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.result import Cause, Diagnosis
from rtctl.diagnosis.search.request import SearchRequest
from rtctl.diagnosis.verification.whole_record_fits import Fits, HoldoutData, extend_model

KNOWN = "known"
"""Shape of a mechanism: share of its steady effect that the loops held already where they were identified."""
START = 0.3
"""Share of its scale at which such a mechanism starts."""
STATEMENT = "The {} has an offset of {:.4g} {} that it did not have where the model was identified."
ALTERNATIVES = " A change of the heating by {} would look much the same in these data."


class _Alternative(NamedTuple):
    """What else changes the heating at rest, fitted in place of an offset."""

    id: str
    fit: Hypothesis


def explain_by_shifted_offset(
    answer: Diagnosis,
    request: SearchRequest,
    given: Simulation,
    holdout: HoldoutData,
    shifts: Sequence[Shift],
) -> tuple[Diagnosis, tuple[str, ...]]:
    """Return the answer with the offset that it needs among its causes, and the names of the offsets that were told.

    Args:
        answer: The answer that the search gives.
        request: Records of the diagnosis.
        given: The model of the file.
        holdout: Test records.
        shifts: Values of the file that the re-fit changed by far.
    """
    told: tuple[str, ...] = ()
    if answer.verdict == "unexplained" or not request.problem.subject.allowed_share:
        return answer, told
    declared = {one.name: one.declared for one in given.parameters}
    for shift in shifts:
        if not declared[shift.name].imitates:
            continue
        without = _fit_without(answer, shift)
        if (
            without is None
            or _returning_share(answer, without) < request.options.thresholds.report.offset_removed_share
        ):
            continue
        told = (*told, shift.name)
        same = _same_laws(answer, given, shift, request.ids)
        cause = _offset_cause(answer, shift, _returning_share(answer, without), same)
        if answer.causes:
            causes = sorted((*answer.causes, cause), key=lambda one: -one.share_removed)
            answer = replace(answer, causes=tuple(causes))
        else:
            answer = _explained_by(answer, request, holdout, cause, without)
    return answer, told


def _fit_without(answer: Diagnosis, shift: Shift) -> TestedHypothesis | None:
    """Fit what the answer claims with one offset as in the file; None where that diverges."""
    hypothesis, noise = answer.fits.after.hypothesis, answer.fits.after.noise
    refitted = _refit(answer, hypothesis.simulation, {shift.name: shift.before}, hypothesis.starts)
    return None if refitted is None else run_residual_tests(refitted, answer.problem, (), noise)


def _refit(
    answer: Diagnosis, simulation: Simulation, held: Mapping[str, float], starts: FloatArray | None = None
) -> Hypothesis | None:
    """Fit a simulation to the records, some parameters held at values; None where that diverges."""
    values = np.array([held.get(one.name, one.value) for one in simulation.parameters])
    mechanisms = [one.id for one in simulation.mechanisms]
    fixed = answer.fits.after.hypothesis.fixed_parameters | set(held)
    return fit_hypothesis(
        answer.problem, simulation.with_values(values), mechanisms, starts, fixed_parameters=fixed
    )


def _returning_share(answer: Diagnosis, without: TestedHypothesis) -> float:
    """Return the fraction of the squared error beyond the noise that returns without the offset."""
    revised = answer.fits.after
    removable = without.hypothesis.cost - noise_cost_of(revised)
    returning = without.hypothesis.cost - revised.hypothesis.cost
    return float(np.clip(returning / removable, 0.0, 1.0)) if removable > 0.0 else 0.0


def _same_laws(answer: Diagnosis, given: Simulation, shift: Shift, ids: Sequence[str]) -> tuple[str, ...]:
    """Return the mechanisms that could be in the place of the offset: one law with it, or near in cost."""
    offset = next(one.declared for one in given.parameters if one.name == shift.name)
    refit = answer.search.hysteresis_refit  # loops that were learned behind the offset fit nothing else
    compared = refit.before if refit else answer.fits.after.hypothesis
    least = compared.cost * answer.problem.thresholds.report.offset_cost_ratio
    alternatives = [
        _alternative(answer, compared.simulation, given, one, shift) for one in offset.imitates if one in ids
    ]
    near = sorted(
        (one for one in alternatives if one and one.fit.cost <= least), key=lambda one: one.fit.cost
    )
    law = (offset.opposite,) if shift.after < 0.0 and offset.opposite in ids else ()
    return (*law, *(one.id for one in near))


def _alternative(
    answer: Diagnosis, simulation: Simulation, given: Simulation, identity: str, shift: Shift
) -> _Alternative | None:
    """Fit a mechanism that began after the identification in place of the offset and the gain of the same signal."""
    if identity in [one.id for one in simulation.mechanisms]:
        return None
    gain = shift.name.replace("_offset", "_gain")
    held = {shift.name: shift.before, gain: 1.0, f"{identity}.{KNOWN}": 0.0}
    extended = simulation.extended((identity,))
    of_file = {one.name: one.value for one in given.parameters}  # the offset moved the others too
    values = np.array([of_file.get(one.name, one.value) for one in extended.parameters])
    for k, one in enumerate(extended.parameters):
        if one.mechanism == identity and not one.declared.is_shape:
            values[k] = START * one.declared.scale(answer.problem.scales)
    fitted = _refit(answer, extended.with_values(values), held)
    return None if fitted is None else _Alternative(identity, fitted)


def _offset_cause(answer: Diagnosis, shift: Shift, share: float, same: tuple[str, ...]) -> Cause:
    """Return the offset as a cause."""
    estimate = estimates_of(answer.fits.after, "")[shift.name]
    signal = shift.name.removesuffix("_offset")
    statement = STATEMENT.format(signal, estimate.value, shift.unit)
    statement += ALTERNATIVES.format(" or ".join(same)) if same else ""
    return Cause(
        id=f"parameter.{shift.name}",
        statement=statement,
        kind="parameter",
        probability=answer.problem.thresholds.report.max_probability
        if answer.verdict != "partly_explained"
        else None,
        parameters={shift.name: estimate},
        share_removed=share,
        indistinguishable_from=same,
    )


def _explained_by(
    answer: Diagnosis, request: SearchRequest, holdout: HoldoutData, cause: Cause, without: TestedHypothesis
) -> Diagnosis:
    """Return an adequate answer as explained by one offset: gain, extended model and the loop with it."""
    fits = Fits(without, answer.fits.after)
    extended, rehearse = (
        extend_model(answer.problem, request.model, fits.after),
        answer.problem.subject.rehearse,
    )
    loop = rehearse(request.model, extended, request.dataset.records) if rehearse else None
    return replace(
        answer, verdict="explained", causes=(cause,), fits=fits, loop=loop, model=extended,
        gain=holdout.gain_of(fits, answer.problem.subject.output),
    )  # fmt: skip
