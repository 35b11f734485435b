"""The extended model that a loop gets: with the corrections of its signals only where the test records ask for them.

A fit of the causes has corrections of the signals beside them, gain and offset of each. They take up what the sessions
differ by, but also where the identified static hysteresis is a little off, which is another amount elsewhere. In the
loop the second kind does harm: the current is moved by more than the width of a film's domains.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from rtctl.diagnosis.problem.subject import Rehearsal, Subject
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.search.request import SearchRequest
from rtctl.diagnosis.verification.whole_record_fits import extend_model
from rtctl.measured.dataset import Record


class LoopModel(NamedTuple):
    """An extended model, and what it is worth to the loop."""

    model: Any
    rehearsal: Rehearsal | None
    """None: no record shows it, or the plant has no such loop."""


def model_for_loop(request: SearchRequest, after: TestedHypothesis, *, rehearsed: bool = True) -> LoopModel:
    """Return the model of the file with the values and mechanisms of a fit.

    Args:
        request: Model, dataset and kind of plant.
        after: The fit.
        rehearsed: Whether the loop is rehearsed; else the model is as the fit has it.
    """
    made = extend_model(request.problem, request.model, after)
    if not rehearsed:
        return LoopModel(made, None)
    return leave_out_corrections(request.problem.subject, request.model, made, request.dataset.records)


def leave_out_corrections(subject: Subject, today: Any, made: Any, records: Sequence[Record]) -> LoopModel:
    """Return the model without corrections of its signals where the loop senses as well, or better, without them.

    Args:
        subject: Kind of plant.
        today: Model of the file.
        made: The extended model, as a fit has it.
        records: All records; the rehearsal takes the test records among them.
    """
    with_all = subject.rehearse(today, made, records) if subject.rehearse else None
    if subject.rehearse is None or subject.uncorrected is None or with_all is None:
        return LoopModel(made, with_all)
    bare = subject.uncorrected(made)
    without = subject.rehearse(today, bare, records)
    if bare == made or without is None or without.after > with_all.after:
        return LoopModel(made, with_all)
    return LoopModel(bare, without._replace(with_corrections=with_all.after))
