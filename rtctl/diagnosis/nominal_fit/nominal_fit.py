"""The nominal model re-fitted to whole records, or to those parts of them by which it can be judged."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from rtctl.border.errors import RunError
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.misfit.foreign_model import note_foreign_model
from rtctl.diagnosis.nominal_fit.predictability import (
    cut_unpredictable,
    fit_as_far_as_followed,
    fit_followed_parts,
)
from rtctl.diagnosis.nominal_fit.segmentation import cut_strokes, drifts
from rtctl.diagnosis.nominal_fit.step_refinement import refine_nominal
from rtctl.diagnosis.nominal_fit.whole_record_start import fit_from_starts
from rtctl.diagnosis.problem.cancellation import CancelledError
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem

LONG_MEMORY = (
    "the nominal model drifts away and never forgets its initial state: causes were judged within {} short segments, "
    "each from its own initial state; the errors on test records are of free runs over whole records all the same"
)
PARTS = (
    "after some time the free runs of the nominal model {} the records: causes were judged by {} of {} samples, the "
    "{} up to there"
)
UNPREDICTABLE = (
    "beyond some time the free run is unpredictable: a parameter change below 0.1 % changes the motion. {1} of {0} "
    "samples were used, the {2} up to there"
)
DIVERGES = "the model diverges on these records: correct its parameters, or let rtctl identify find them"
STOPPED = (
    "stopped by the user while the nominal model was re-fitted: nothing is known yet, nothing was written"
)


class NominalFit(NamedTuple):
    """The re-fitted nominal model, and the problem in which causes are looked for."""

    problem: Problem
    """Whole records, or parts of them."""
    nominal: Hypothesis
    whole: tuple[Problem, Hypothesis] | None
    """Whole records and the nominal model fitted to them; None where it diverges on one from every start."""
    notes: tuple[str, ...]
    parted: bool = False
    """Whether the parts are initial ones, up to where the nominal model takes another course."""
    in_strokes: bool = False
    """Whether the parts are short segments of records that drift."""

    @property
    def uncut(self) -> bool:
        """Return whether causes are looked for in whole records."""
        return self.whole is not None and self.whole[0].records is self.problem.records


def fit_nominal(problem: Problem, simulation: Simulation, report: Callable[[str], None]) -> NominalFit:
    """Fit the nominal model, and choose the parts of the records that it can be judged by.

    Args:
        problem: Screened records.
        simulation: The model of the file.
        report: Called with what is under way.

    Raises:
        RunError: The model diverges and follows next to nothing, or the user stopped.
    """

    def announce(text: str) -> None:
        report(text)
        problem.cancellation.raise_if_cancelled()

    try:
        return _fit(problem, simulation, announce)
    except CancelledError:
        raise RunError(STOPPED) from None


def _fit(problem: Problem, simulation: Simulation, announce: Callable[[str], None]) -> NominalFit:
    """Fit whole records, then those parts of them that the fit asks for."""
    mechanisms = tuple(mechanism.id for mechanism in simulation.mechanisms)
    announce("the nominal model")
    nominal = fit_from_starts(problem, simulation, mechanisms)
    if nominal is None:
        announce("the nominal model as far as it follows the records")
        parts, nominal = _fit_before_divergence(problem, simulation, mechanisms)
        if parts.samples < problem.samples:
            return _parts_before_divergence(problem, parts, nominal)
        problem = parts
    problem, nominal, notes = _fit_predictable(problem, nominal, simulation, announce)
    whole = problem, nominal = refine_nominal(problem, nominal)
    notes = (*note_foreign_model(problem, nominal.sensitivity.outputs, nominal.cost), *notes)
    if drifts(problem, nominal):
        announce("the nominal model within short segments")
        strokes = cut_strokes(problem, nominal)
        within = fit_from_starts(strokes, simulation, mechanisms)
        if within is None:
            raise RunError(DIVERGES)
        note = LONG_MEMORY.format(len(strokes.records))
        return NominalFit(strokes, within, whole, (*notes, note), in_strokes=True)
    followed = fit_followed_parts(problem, nominal)
    if followed is None:
        return NominalFit(problem, nominal, whole, notes)
    announce("the nominal model as far as it follows the records")
    parts, nominal = refine_nominal(*followed)
    note = PARTS.format("leave", parts.samples, problem.samples, _initial_parts(parts))
    return NominalFit(parts, nominal, whole, (*notes, note), parted=True)


def _initial_parts(parts: Problem) -> str:
    """Return of how many records parts are left."""
    count = len(parts.records)
    return "initial part of the record" if count == 1 else f"initial parts of {count} records"


def _parts_before_divergence(problem: Problem, parts: Problem, nominal: Hypothesis) -> NominalFit:
    """Return the fit of a model that diverges on whole records."""
    note = PARTS.format("run away from", parts.samples, problem.samples, _initial_parts(parts))
    parts, nominal = refine_nominal(parts, nominal)
    foreign = note_foreign_model(parts, nominal.sensitivity.outputs, nominal.cost)
    return NominalFit(parts, nominal, None, (*foreign, note))


def _fit_predictable(
    problem: Problem, nominal: Hypothesis, simulation: Simulation, announce: Callable[[str], None]
) -> tuple[Problem, Hypothesis, tuple[str, ...]]:
    """Fit the predictable parts of the records again, where some are not; with the note that says so."""
    predictable = cut_unpredictable(problem, nominal)
    if predictable is problem:
        return problem, nominal, ()
    announce("the nominal model as far as its motion is predictable")
    refitted = fit_from_starts(predictable, simulation, nominal.mechanisms)
    if refitted is None:
        return problem, nominal, ()
    note = UNPREDICTABLE.format(problem.samples, predictable.samples, _initial_parts(predictable))
    return predictable, refitted, (note,)


def _fit_before_divergence(
    problem: Problem, simulation: Simulation, mechanisms: tuple[str, ...]
) -> tuple[Problem, Hypothesis]:
    """Fit the initial parts of records before the model diverges, as a softening spring that is a little off does."""
    followed = fit_as_far_as_followed(problem, simulation, mechanisms) if simulation.state else None
    if followed is None:
        raise RunError(DIVERGES)
    return followed
