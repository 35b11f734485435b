"""What an extended model is worth to the loop: self-sensing of measured test records with it and without it.

The loop tracks as well as it senses. Current and resistance of a test record go through the loop's estimator, once with
today's model and once with the extended one, and both estimates are compared with the deflection that was measured.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.subject import Rehearsal
from rtctl.estimators import observer_of
from rtctl.measured.dataset import Record
from rtctl.models.vo2 import Vo2Model

SCENARIO = "self-sensing of the test records, mean absolute error"


def rehearse_sensing(before: Vo2Model, after: Vo2Model, records: Sequence[Record]) -> Rehearsal | None:
    """Compare the estimates of the loop's observer with the measured deflection of test records.

    Args:
        before: Today's model.
        after: The extended model.
        records: Records of the dataset; those with use "test" that have a deflection are taken.

    Returns:
        The mean absolute errors [um]; None where no such record has a deflection, or today's model gives no estimate.
    """
    tests = [one for one in records if one.use == "test" and one.has("deflection") and one.samples > 1]
    if not tests:
        return None
    with np.errstate(all="ignore"):
        today, extended = (_mean_error(model, tests) for model in (before, after))
    return Rehearsal(SCENARIO, today, extended, "um") if np.isfinite(today) else None


def _mean_error(model: Vo2Model, tests: Sequence[Record]) -> float:
    """Return the mean absolute error over all records [um]; infinite where one sample has none."""
    errors = np.concatenate([np.abs(sense_record(model, one)) for one in tests])
    return float(np.mean(errors)) if np.isfinite(errors).all() else float("inf")


def sense_record(model: Vo2Model, record: Record) -> FloatArray:
    """Return estimated minus measured deflection [um] of the scored samples, NaN where the observer gives no number.

    A reading is taken before the current of its own row acts, so it answers the current of the row before; or that of
    its own row, where the model says so.
    """
    estimator, late = observer_of(model), 0 if model.reads_after else 1
    current = np.asarray(record.signals["current"]).tolist()
    resistance = np.asarray(record.signals["resistance"]).tolist()
    values = [estimator.start((current[0],), (resistance[0],)).value]
    for k in range(1, len(current)):
        values.append(estimator.step((current[k - late],), (resistance[k],), record.period_s).value)
    error: FloatArray = np.array(values) - record.signals["deflection"]
    return error[record.ignore_first :]
