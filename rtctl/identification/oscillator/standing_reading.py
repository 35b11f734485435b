"""A displacement that stands far from zero beside its motion: a sensor's stand-off, or a well that the device rests in.

A laser or a gap sensor reads its distance, not the motion about rest. Without a place for that, only a well far from
zero holds such a reading, and everything else is wrong with it. Which of the two it is the data tell: both are fitted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from rtctl.border.model_file import MechanismTable, ModelFile, Value
from rtctl.identification.fit_record import FitRecord
from rtctl.output.readable_units import readable

ID, DISPLACEMENT = "sensor.offset", "displacement"
SENSOR_ZERO = f"{ID}.offset"
"""Parameter that says what the sensor reads at zero."""
FAR = 1.0
"""Mean reading over the span of the whole motion, from which on it stands far from zero."""
BETTER = 0.9
"""Share of the well's residual below which that of the sensor's zero is taken."""
TAKEN = (
    "the displacement stands at {value}, {ratio:.2g} times the span of its motion: that is taken as the zero of the "
    "sensor ({id} in the model), which leaves {left:.3g} % of the motion, and not as a well that the device rests in, "
    "which {other}. A manifest with offset in [signals.displacement] would take it off the readings"
)

EITHER = (
    "the displacement stands at {value}, {ratio:.2g} times the span of its motion: the model has a well there. A "
    "sensor whose zero is elsewhere fits about as well ({left:.3g} % of the motion left; the well leaves {other:.3g} "
    "%): if the device has no wells, write offset into [signals.displacement] and identify again, and the spring is "
    "that about rest"
)


def find_standing_reading(records: Sequence[FitRecord]) -> tuple[float, float] | None:
    """Return the mean displacement and its ratio to the span of the motion; None where it is not far from zero."""
    readings = [one.measured[DISPLACEMENT][one.first :] for one in records if DISPLACEMENT in one.measured]
    if not readings or len(readings) < len(records):
        return None
    whole = np.concatenate(readings)
    mean, span = float(whole.mean()), float(np.ptp(whole))
    return (mean, abs(mean) / span) if abs(mean) > FAR * span > 0.0 else None


def with_sensor_offset(start: ModelFile, offset: float, unit: str) -> ModelFile:
    """Return a start model whose sensor reads `offset` [unit] too much."""
    table = MechanismTable(id=ID, parameters={"offset": Value(value=offset, unit=unit)})
    model = start.model.model_copy(update={"mechanisms": (*start.model.mechanisms, table)})
    return start.model_copy(update={"model": model})


def describe_either(found: tuple[float, float], unit: str, left: float, other: float) -> str:
    """Return the note on a reading in a well that a sensor's zero explains as well; "": it does not."""
    if not BETTER * left < other:
        return ""
    return EITHER.format(
        value=readable(found[0], unit), ratio=found[1], left=100.0 * left, other=100.0 * other
    )


def describe_taken(found: tuple[float, float], unit: str, left: float, other: float) -> str:
    """Return the note on a reading that was taken as the sensor's zero; shares are of the motion (RMS).

    `other` is infinite where no well can be fitted.
    """
    well = f"leaves {100.0 * other:.3g} %" if other < math.inf else "diverges from every start"
    return TAKEN.format(value=readable(found[0], unit), ratio=found[1], id=ID, left=100.0 * left, other=well)
