"""What a kind of plant gives to the watch: its model in free run on recorded commands, and its answers to changes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from rtctl.border.arrays import FloatArray


class Rows(NamedTuple):
    """Rows of a recording, as the loop had them."""

    samples: FloatArray
    """Number of each sample (n,)."""
    levels: FloatArray
    """Level of the first command that was in force before each reading (n,) [its unit]."""
    elapsed_s: FloatArray
    """Time since the row before (n,) [s]."""
    sensed: FloatArray
    """Reading of the first channel (n,) [its unit]."""
    reference: FloatArray
    """Reading of the reference instrument (n,) [its unit]; NaN: none."""
    estimate: FloatArray
    """Estimate that the loop acted on (n,) [the reference's unit]."""


class Predicted(NamedTuple):
    """A stretch of rows, seen by the model in free run."""

    residual: FloatArray
    """Reading beyond that of the model (n,), in a measure in which its error is about the same everywhere."""
    reading: FloatArray
    """The model's reading (n,), in the same measure."""
    output: FloatArray
    """The model's output (n,) [the reference's unit]."""
    motion: FloatArray
    """Coordinates of the model (n, m), each in units of its range: equal motions have equal errors of the model."""
    answers: FloatArray
    """Answers of the reading to a unit of each direction (n, directions)."""
    output_answers: FloatArray
    """The same of the output (n, directions)."""


class Direction(NamedTuple):
    """A way in which a device may change."""

    id: str
    unit: str


class Named(NamedTuple):
    """An explanation of a stretch of rows by one cause."""

    id: str
    """Id of the mechanism, as in the catalogue; `sensor.gain` and `estimator.locked` besides."""
    statement: str
    """A sentence with the size and its unit."""
    size: float
    unit: str
    cost: float
    """What is left of the rows' residuals over what is left before the change: 1 is as good as before."""
    shape: float = math.nan
    """A further number of a cause that has one, in SI units: the time constant of a second part of the heat."""


MemoryBefore = Callable[[int], tuple[int, Any] | None]
"""See `Belief.memory_before`."""


class Belief(Protocol):
    """A model in free run on a recording."""

    directions: tuple[Direction, ...]
    reading_error: float
    """RMS error of the model's reading on motion that it was not fitted to, in the measure of `residual`."""
    output_error: float
    """The same of its output [the reference's unit]."""
    output_unit: str
    output_width: float
    """Range of the output [the reference's unit]."""

    def start(self, level: float) -> None:
        """Start at rest at an applied level [the command's unit]."""
        ...

    def predict(self, rows: Rows) -> Predicted:
        """Advance over rows."""
        ...

    def explain(self, rows: Rows, onset: int, before: tuple[float, float]) -> list[Named]:
        """Fit each cause that could have begun, the best one first, after no change at all.

        Args:
            rows: rows before and after the change.
            onset: where in them it began.
            before: mean square of the residuals of reading and output before the change; NaN: no reference.
        """
        ...

    def take(self, named: Named, sample: int) -> None:
        """Take a cause as true from a sample on, so that the next change is explained beside it."""
        ...

    def memory_before(self, sample: int) -> tuple[int, Any] | None:
        """Return what the plant has been through up to a sample, of the newest windows, and the sample after that.

        None where that is not known, or the plant remembers nothing.
        """
        ...
