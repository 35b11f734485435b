"""The extended model that a loop gets: with the corrections of its signals only where the test records ask for them.

A fit of the causes has corrections of the signals beside them, gain and offset of each. They take up what the sessions
differ by, but also where the identified static hysteresis is a little off, which is another amount elsewhere. In the
loop the second kind does harm: the current is moved by more than the width of a film's domains.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rtctl.diagnosis.problem.subject import Rehearsal, Subject
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.search.holdout_error import Gain
from rtctl.diagnosis.search.request import SearchRequest
from rtctl.diagnosis.verification.whole_record_fits import Fits, HoldoutData, extend_model
from rtctl.measured.dataset import Record

Rehearse = Callable[[Any, Any, Sequence[Record]], Rehearsal | None]


class LoopModel(NamedTuple):
    """An extended model, and what it is worth to the loop."""

    model: Any
    rehearsal: Rehearsal | None
    """None: no record shows it, or the plant has no such loop."""
    fit: TestedHypothesis
    """The fit that the model is, without its corrections where the model leaves them out."""

    def gain_of(self, fits: Fits, holdout: HoldoutData, output: str) -> Gain | None:
        """Return the errors of `output` on test records without causes and with this model; None without records."""
        return holdout.gain_of(fits._replace(after=self.fit), output)


def model_for_loop(
    request: SearchRequest, after: TestedHypothesis, *, rehearsed: bool = True, is_cause: bool = False
) -> LoopModel:
    """Return the model of the file with the values and mechanisms of a fit.

    Args:
        request: Model, dataset and kind of plant.
        after: The fit.
        rehearsed: Whether the loop is rehearsed; else the model is as the fit has it.
        is_cause: Whether a correction is a cause that is told, and stays whatever the rehearsal says.
    """
    problem, today, rehearse = request.problem, request.model, request.problem.subject.rehearse
    made = extend_model(problem, today, after)
    if rehearse is None or not rehearsed:
        return LoopModel(made, None, after)
    if is_cause:
        return LoopModel(made, rehearse(today, made, request.dataset.records), after)
    bare = _without_corrections(problem.subject, after)
    plain = extend_model(problem, today, bare)
    rehearsal, is_plain = compare_in_loop(rehearse, today, made, plain, request.dataset.records)
    return LoopModel(plain, rehearsal, bare) if is_plain else LoopModel(made, rehearsal, after)


def compare_in_loop(
    rehearse: Rehearse, today: Any, made: Any, plain: Any, records: Sequence[Record]
) -> tuple[Rehearsal | None, bool]:
    """Return the better rehearsal, and whether it is that without corrections, which a tie goes to.

    Args:
        rehearse: Rehearses the loop with today's model and another one.
        today: Model of the file.
        made: The extended model, as a fit has it.
        plain: The same without corrections of its signals.
        records: All records; the rehearsal takes the test records among them.
    """
    with_all = rehearse(today, made, records)
    if with_all is None or plain == made:
        return with_all, False
    without = rehearse(today, plain, records)
    if without is None or without.after > with_all.after:
        return with_all, False
    return without._replace(with_corrections=with_all.after), True


def _without_corrections(subject: Subject, after: TestedHypothesis) -> TestedHypothesis:
    """Return a fit with the corrections of its signals as an identified model has them."""
    simulation, neutral = after.hypothesis.simulation, subject.session_corrections
    values = np.array([neutral.get(one.name, one.value) for one in simulation.parameters])
    return after._replace(hypothesis=replace(after.hypothesis, simulation=simulation.with_values(values)))
