"""Declarations of model parameters: unit, neutral value, bounds, and the size at which they matter.

A mechanism is an extension of a nominal model by its physical name. A plant adds its effect on the equation;
identification and diagnosis need only what is declared here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray


class Scales(NamedTuple):
    """Sizes of a motion (RMS, in the units of the data; times in s), with which parameters are compared."""

    displacement: float
    velocity: float
    acceleration: float
    drive: float
    rate: float
    """Dominant angular frequency [1/s]."""
    duration: float
    """Duration of the records [s]."""
    period: float
    """Sample period [s]."""
    excursion: float
    """RMS displacement about each record's mean: in one of two wells it is much less than `displacement`."""
    sensed: float = 1.0
    """RMS of the signal that is read in place of the displacement: a film's resistance [ohm]."""
    reading: float = 1.0
    """RMS of the response that was measured: displacement, velocity or acceleration, in its own unit."""
    response_s: float = 0.0
    """Time constant [s] of the nominal model, where it has one by which times are compared; else 0."""
    largest_drive: float = 1.0
    """Largest magnitude of the drive: nothing is cut off beyond it."""
    largest_reading: float = 1.0
    """The same of the response that was measured, in its own unit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One number of a nominal model or of a mechanism.

    `unit` may name the data's own units: `{z}` for displacement, `{u}` for drive, `{y}` for the response that is read,
    as in "1/({z}^2*s^2)".
    """

    name: str
    unit: str
    meaning: str
    scale: Callable[[Scales], float]
    """The value at which it matters as much as the rest of the equation."""
    neutral: float | None = 0.0
    """Value at which its mechanism has no effect; None for a shape, which sets the form and not the size."""
    default: float | None = None
    """Value where a file leaves it out; None: it must be given."""
    default_unit: str = ""
    """Unit of `default` where that is no number in `unit`: 1 rad is a default of data that are angles, and of no
    others. "" for the parameter's own."""
    low: float = -math.inf
    high: float = math.inf
    reach: float = 1.0
    """Factor on the usual search range, for an amplitude that matters only at many scales."""
    shape_range: tuple[float, float] = (0.1, 10.0)
    """Search range of a shape, in multiples of its scale."""
    redundant: bool = False
    """Whether a diagnosis leaves a shape at its default (without one, at its scale) or at one of `also`.

    Such a shape only sets the unit of others, or describes a record's start, and is not worth a parameter of the BIC.
    """
    searched: bool = False
    """Whether the search for a shape with a default covers its range instead of starting at the default."""
    also: tuple[float, ...] = ()
    """Further values of a shape from which a search starts."""
    grid: int = 4
    """Number of values of a shape that a search tries, evenly in the logarithm."""
    quantiles: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """Of a shape that is a place of the motion: quantiles of the displacement at which a search tries it, by form, ""
    for all. It stays between the outermost ones: a place that the motion does not pass shows in no record, or is an
    offset."""
    per_record: bool = False
    """Whether each record may have its own value, as the phase of a process that continues between records."""
    simplest: float | None = None
    """Value of a shape, its default, at which the law is a simpler one.

    A search tries that law by itself, and a fitted value has to be worth its parameter.
    """
    smooth: bool = False
    """Whether a law at the `simplest` value of this shape has a derivative by it.

    A fit finds its way from there, so the search tries no other value.
    """
    of_form: str = ""
    """The only form of a mechanism that has this shape; "" for all."""
    opposite: str = ""
    """Mechanism that is the same law as this parameter below 0: a search leaves that side to it, an answer names both.
    """
    imitates: tuple[str, ...] = ()
    """Mechanisms whose effect at rest resembles that of this parameter of a nominal model. An answer that needs the
    parameter compares it with them."""
    least_periods: float = 0.0
    """Periods of a frequency that the shortest record has to hold: with a phase of its own in each record, a slower
    tone takes up whatever is slow."""
    fastest: Callable[[Scales], float] | None = None
    """Size of a nominal parameter beyond which a fit does not go, as samples show nothing of it: a pole that has
    settled long before the next sample."""
    kinked: bool = False
    """Whether the cost has many minima along it, as where dry friction stops a motion: one for each possible cycle."""

    @property
    def searched_low(self) -> float:
        """Return the least value that a search looks for."""
        return max(self.low, 0.0) if self.opposite else self.low

    @property
    def is_shape(self) -> bool:
        """Whether it sets the form of a mechanism and not its size."""
        return self.neutral is None

    def stays_at(self, value: float) -> bool:
        """Return whether a fit leaves a shape at `value`: the simplest one, by which the law has no derivative."""
        return value == self.simplest and not self.smooth

    def unit_in(self, **data_units: str) -> str:
        """Return `unit` with the data's own units filled in, in no more brackets than it needs."""
        return without_brackets(self.unit.format(**{name: f"({unit})" for name, unit in data_units.items()}))


STEADY = 0.0
"""Settling time of a drift that goes on and on."""
SHORTEST_SETTLING = 0.1
"""Settling time of a drift, in durations of the records, below which it is a constant."""
FIRST_RATE = 1.0 / SHORTEST_SETTLING
"""Times as far as usual is the first rate of a drift searched: one that settles early is fast at first."""


def settling_time() -> Parameter:
    """Declare the time constant with which a drift settles; a steady one is tried by itself."""
    return Parameter(
        name="settling_time", unit="s", meaning="time constant with which the drift settles; 0: it does not",
        scale=lambda s: s.duration, neutral=None, default=STEADY, simplest=STEADY, low=0.0,
        shape_range=(SHORTEST_SETTLING, 1.0), grid=2,
    )  # fmt: skip


def drift_of(time_s: FloatArray, settling_s: float) -> FloatArray:
    """Return a drift over its first rate [s] at times of any shape [s]: d (1 - exp(-t / d)), t where it is steady."""
    if settling_s == STEADY:
        return time_s
    settled: FloatArray = -settling_s * np.expm1(-time_s / settling_s)
    return settled


def plain_unit(unit: str) -> str:
    """Simplify a unit, `(mm)/(s^2*((V)))` to `mm/(s^2*V)`; the empty text for a number without unit."""
    return without_brackets(unit).removeprefix("dimensionless")


def without_brackets(unit: str) -> str:
    """Return a unit without brackets that change nothing, around single names or the whole; `ln(ohm)` stays."""
    before = ""
    while before != unit:
        before, unit = unit, re.sub(r"\(\(([^()]*)\)\)", r"(\1)", re.sub(r"(?<!\w)\((\w+)\)", r"\1", unit))
    while unit.startswith("(") and _closing(unit) + 1 == len(unit):
        unit = unit[1:-1]
    return unit


def _closing(unit: str) -> int:
    """Return the place of the bracket that closes the first one; -1: there is none."""
    depths = accumulate((one == "(") - (one == ")") for one in unit)
    return next((k for k, depth in enumerate(depths) if depth == 0), -1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mechanism:
    """An extension of a nominal model: id of the file formats, physics in a sentence, parameters."""

    id: str
    statement: str
    """One sentence; parameters as `{level}` are filled in with value and unit."""
    parameters: tuple[Parameter, ...]
    forms: Mapping[str, str] = field(default_factory=dict)
    """Sentence by amplitude, for a mechanism with several forms of which a device has one; they are tried in turn.

    Also by a shape with a simplest value: the sentence where it has another one.
    """
    supplements: Mapping[str, str] = field(default_factory=dict)
    """Sentence by a shape with a simplest value that is added where it has another one."""
    generalises: Mapping[str, Callable[[Mapping[str, float]], Mapping[str, float]]] = field(
        default_factory=dict
    )
    """Id of a simpler mechanism, which this one is at certain values of its shapes -> the simpler one's parameters
    from those of this one. The simpler one is told unless the data need this one, and both together are never tried."""
    aside: Callable[[Mapping[str, tuple[float, str]]], str] = lambda values: ""
    """Returns a sentence on what nature does the same at these (value, unit) by name; "" at most values."""
    of_identification: bool = False
    """Whether it corrects an identification whose records contained other effects too.

    Beside those a small correction is the identification's own error.
    """
    slow: bool = False
    """Whether it grows with the time since a record's start, so that the first part hardly shows it."""
    by_levels: bool = False
    """Whether a diagnosis recognises it by the levels of the readings: no fit follows a step."""
    about_another_zero: Callable[[Mapping[str, float]], tuple[str, ...]] = lambda values: ()
    """Ids of mechanisms that are the same law about another zero of the displacement, by the model's parameters.

    Nothing tells them from it where no displacement was measured.
    """

    def __post_init__(self) -> None:
        if all(parameter.is_shape for parameter in self.parameters):
            raise ValueError(f"{self.id}: a mechanism needs a parameter with a neutral value")
        names = {one.name for one in self.parameters if not one.is_shape or one.simplest is not None}
        unknown = self.forms.keys() - names
        if unknown:
            raise ValueError(f"{self.id}: forms are named after amplitudes, {', '.join(unknown)} is none")

    def form_of(self, amplitude: str) -> str:
        """Return the form that an amplitude belongs to; "" where all act together."""
        return amplitude if amplitude in self.forms else ""

    def form_at(self, form: str, shapes: Mapping[str, float]) -> str:
        """Return the form at these shapes: `form`, or that of a shape that is not at its simplest value."""
        return form or next(
            (
                one.name
                for one in self.parameters
                if one.name in self.forms and shapes.get(one.name, one.simplest) != one.simplest
            ),
            "",
        )

    def is_related_to(self, other: Mechanism) -> bool:
        """Return whether one of the two laws is a case of the other, or both have one case in common."""
        common = self.generalises.keys() & other.generalises.keys()
        return other.id in self.generalises or self.id in other.generalises or bool(common)

    def sentence(self, values: Mapping[str, float]) -> str:
        """Return the sentence of the one form that acts at `values`, else the general one, and what is added to it."""
        acting = [name for name in self.forms if values.get(name)]
        first = self.forms[acting[0]] if len(acting) == 1 else self.statement
        return " ".join((first, *(said for name, said in self.supplements.items() if values.get(name))))

    @property
    def acts_before_the_equation(self) -> bool:
        """Whether it changes an input before that reaches the equation of motion."""
        return False

    @property
    def suits_data(self) -> bool:
        """Whether every default is one in the units of the data that it was bound to."""
        return all(not one.default_unit or one.default is not None for one in self.parameters)

    @property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """Parameters that switch the mechanism off when they are all neutral."""
        return tuple(parameter for parameter in self.parameters if not parameter.is_shape)
