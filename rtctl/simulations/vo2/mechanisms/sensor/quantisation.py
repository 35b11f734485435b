"""`sensor.quantisation`: of a reading the nearest level is read, of levels that are a step apart."""

import math

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.simulations.vo2.mechanism import Read, Values, Vo2Mechanism, coefficient, shape


def rounded(read: Read, p: Values) -> Read:
    """Round both readings as converters do."""
    return read._replace(
        resistance=_nearest(read.resistance, p["resistance"], p["resistance_level"]),
        deflection=_nearest(read.deflection, p["deflection"], p["deflection_level"]),
    )


def _nearest(reading: FloatArray, step: float, level: float) -> FloatArray:
    """Return the nearest level to each reading (n,); no step, no levels."""
    return level + step * np.rint((reading - level) / step) if step else reading


MECHANISM = Vo2Mechanism(
    id="sensor.quantisation",
    statement="The readings have steps, of {resistance} and {deflection}.",
    forms={
        "resistance": "The resistance readings have a step of {resistance}.",
        "deflection": "The deflection readings have a step of {deflection}.",
    },
    parameters=(
        coefficient(
            "resistance", "ohm", "from one level of the resistance to the next", lambda s: s.sensed, default=0.0,
            low=0.0,
        ),
        coefficient(
            "deflection", "um", "from one level of the deflection to the next", lambda s: s.excursion, default=0.0,
            low=0.0,
        ),
        shape(
            "resistance_level", "ohm", "one of the levels of the resistance", lambda s: s.sensed, default=0.0,
            low=-math.inf, of_form="resistance",
        ),
        shape(
            "deflection_level", "um", "one of the levels of the deflection", lambda s: s.excursion, default=0.0,
            low=-math.inf, of_form="deflection",
        ),
    ),
    instrument=rounded,
    stage=6,
    by_levels=True,
)  # fmt: skip
