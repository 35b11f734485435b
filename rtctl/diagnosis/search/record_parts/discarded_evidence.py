"""Initial parts that show nothing wrong, of records whose ends the model does not follow: is the evidence there?

Records are cut where free runs take another course, since between two wells or at a jump a model with any error does
so sooner or later. The right model follows such a motion all the same from the state that it has at any moment. Where
the model misses short segments of what was cut off, each from its own initial state, by more than it misses those that
were kept, something acts there, such as a stop that only the largest motion reaches. Then whole records are judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.diagnosis.nominal_fit.misfit.segment_misfit import misfits_of_segments
from rtctl.diagnosis.nominal_fit.nominal_fit import NominalFit
from rtctl.diagnosis.nominal_fit.predictability import period_of
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.residual_tests import run_residual_tests
from rtctl.diagnosis.search.stepwise import significance_level


def restore_evidence(first: NominalFit, ids: Sequence[str], false_claim_rate: float) -> NominalFit:
    """Return the fit of whole records where their initial parts hide what is wrong; itself otherwise.

    Args:
        first: The re-fitted nominal model.
        ids: Mechanisms that are searched.
        false_claim_rate: How often a cause may be claimed where there is none.
    """
    if not first.parted or first.whole is None:
        return first
    tested = run_residual_tests(first.nominal, first.problem, ids)
    if not tested.p_value > significance_level(first.problem, false_claim_rate):
        return first
    problem, nominal = first.whole
    if not misses_more_beyond(first, problem):
        return first
    return first._replace(problem=problem, nominal=nominal, notes=first.notes[:-1], parted=False)


def misses_more_beyond(first: NominalFit, whole: Problem) -> bool:
    """Return whether the model of the initial parts misses short segments of the rest of `whole` by more."""
    kept = {record.name: record.samples for record in first.problem.records}
    ends = [(record, kept.get(record.name, record.first)) for record in whole.records]
    beyond = tuple(
        record.cut(max(record.first, reach - 3 * period_of(whole, record) // 2), record.samples)
        for record, reach in ends
        if reach < record.samples
    )
    if not beyond:
        return False
    there, here = (
        misfits_of_segments(replace(whole, records=records), first.nominal, whole)
        for records in (beyond, first.problem.records)
    )
    if not (len(there) and len(here)):
        return False
    usual = float(np.sqrt(np.mean(here**2)))
    return float(np.sqrt(np.mean(there**2))) > whole.thresholds.nominal_fit.missed_beyond * usual
