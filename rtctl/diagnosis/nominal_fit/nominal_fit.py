"""Where a diagnosis begins: the nominal model re-fitted to whole records, or to what of them it can be judged by."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from rtctl.border.errors import RunError
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.nominal_fit.foreign_model import foreign
from rtctl.diagnosis.nominal_fit.multiple_shooting_start import finely, fitted_nominal
from rtctl.diagnosis.nominal_fit.predictability import as_far_as_followed, beginnings, foreseeable
from rtctl.diagnosis.nominal_fit.segmentation import cut_up, remembers
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem

LONG_MEMORY = (
    "the nominal model drifts away and never forgets its start: causes were judged within {} short stretches, each "
    "from a state of its own; the errors on test records are of free runs over whole records all the same"
)
PARTS = (
    "the free runs of the nominal model {} the records{}: causes were judged by {} of {} samples, the beginnings of {} "
    "records up to there; the errors on test records are of whole free runs all the same"
)
UNFORESEEABLE = (
    "from some moment on, as where one of two motions only just wins, less than a thousandth of a parameter decides "
    "what the nominal model does: of {} samples {} were used, the beginnings of {} records up to there; the errors on "
    "test records are of whole free runs all the same"
)
DIVERGES = "the model diverges on these records: correct its parameters, or let rtctl identify find them"


class NominalFit(NamedTuple):
    """What the causes are looked for in."""

    problem: Problem
    nominal: Hypothesis
    whole: tuple[Problem, Hypothesis] | None
    """Whole records and the nominal model fitted to them; None: on one of them it diverges from every start."""
    said: list[str]
    parted: bool = False
    """Whether it is the beginnings of whole records, up to where the nominal model parts from them."""

    @property
    def uncut(self) -> bool:
        """Whether causes are looked for in whole records."""
        return self.whole is not None and self.whole[0].records is self.problem.records


def fit_nominal(problem: Problem, simulation: Simulation, report: Callable[[str], None]) -> NominalFit:
    """Fit the nominal model. Raises RunError where it diverges and follows next to nothing, CancelledError."""
    mechanisms = tuple(mechanism.id for mechanism in simulation.mechanisms)
    report("the nominal model")
    problem.cancellation.raise_if_cancelled()
    nominal = fitted_nominal(problem, simulation, mechanisms)
    if nominal is None:
        report("the nominal model as far as it follows the records")
        problem.cancellation.raise_if_cancelled()
        short, nominal = _without_running_away(problem, simulation, mechanisms)
        if short.samples < problem.samples:
            left = PARTS.format("run away from", "", short.samples, problem.samples, len(short.records))
            short, nominal = finely(short, nominal)
            said = foreign(short, nominal.sensitivity.outputs, nominal.cost)
            return NominalFit(short, nominal, None, [*said, left])
        problem = short
    beyond: list[str] = []
    if (sure := foreseeable(problem, nominal)) is not problem:
        report("the nominal model as far as what it does is foreseeable")
        problem.cancellation.raise_if_cancelled()
        again = fitted_nominal(sure, simulation, mechanisms)
        if again is not None:
            beyond = [UNFORESEEABLE.format(problem.samples, sure.samples, len(sure.records))]
            problem, nominal = sure, again
    whole = problem, nominal = finely(problem, nominal)
    said = [*foreign(problem, nominal.sensitivity.outputs, nominal.cost), *beyond]
    if remembers(problem, nominal):
        report("the nominal model within short stretches")
        problem.cancellation.raise_if_cancelled()
        short = cut_up(problem, nominal)
        within = fitted_nominal(short, simulation, mechanisms)
        if within is None:
            raise RunError(DIVERGES)
        return NominalFit(short, within, whole, [*said, LONG_MEMORY.format(len(short.records))])
    if (followed := beginnings(problem, nominal)) is not None:
        report("the nominal model as far as it follows the records")
        problem.cancellation.raise_if_cancelled()
        short, nominal = finely(*followed)
        where = ("part from", ", as between two motions")
        said.append(PARTS.format(*where, short.samples, problem.samples, len(short.records)))
        return NominalFit(short, nominal, whole, said, parted=True)
    return NominalFit(problem, nominal, whole, said)


def _without_running_away(
    problem: Problem, simulation: Simulation, mechanisms: tuple[str, ...]
) -> tuple[Problem, Hypothesis]:
    """A softening spring that is a little off runs away where the device stays: fitted to what comes before."""
    followed = as_far_as_followed(problem, simulation, mechanisms) if simulation.state else None
    if followed is None:
        raise RunError(DIVERGES)
    return followed
