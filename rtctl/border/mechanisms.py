"""What a number of a model means: its unit, where it does nothing, where it may lie, how large it matters.

A mechanism is an extension of a nominal model by its physical name. A plant adds what it does to the equation;
identification and diagnosis need no more than what is declared here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple


class Scales(NamedTuple):
    """Sizes of a motion (RMS, in the units of the data; times in s): what a parameter is to be compared with."""

    displacement: float
    velocity: float
    acceleration: float
    drive: float
    rate: float
    """Dominant angular frequency [1/s]."""
    duration: float
    """Of the records [s]."""
    period: float
    """Between samples [s]."""
    excursion: float
    """Of the displacement about each record's mean: in one of two wells it is much less."""
    sensed: float = 1.0
    """Of what is read in place of the displacement: a film's resistance [ohm]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One number of a nominal model or of a mechanism.

    `unit` may name the data's own units: `{z}` for displacement, `{u}` for drive, as in "1/({z}^2*s^2)".
    """

    name: str
    unit: str
    meaning: str
    scale: Callable[[Scales], float]
    """The value at which it matters as much as the rest of the equation."""
    neutral: float | None = 0.0
    """Where its mechanism does nothing; None: a shape, which says how and not how much."""
    default: float | None = None
    """Where a file leaves it out; None: it must be given."""
    low: float = -math.inf
    high: float = math.inf
    reach: float = 1.0
    """Of an amplitude that matters as much as the rest only at many scales: times the usual range of a search."""
    shape_range: tuple[float, float] = (0.1, 10.0)
    """Of a shape: where to look for it, in multiples of its scale."""
    redundant: bool = False
    """Of a shape with a default: a diagnosis leaves it there, or at one of `also`. It only names the unit of others, or
    tells how a record begins, which is not worth a parameter of the BIC."""
    searched: bool = False
    """Of a shape with a default: a search for it does not begin there, but over its range."""
    also: tuple[float, ...] = ()
    """Of a shape with a default: where else a search begins."""
    grid: int = 4
    """Of a shape: how many values a search tries, evenly in the logarithm."""
    per_record: bool = False
    """Each record may have its own, as the phase of something that runs on between records."""
    of_form: str = ""
    """Of a shape: the only form that it is one of; "" of all."""
    kinked: bool = False
    """A fit has many valleys along it, as where dry friction stops a motion: one for each cycle in which it may."""

    @property
    def is_shape(self) -> bool:
        """Whether it says how a mechanism acts and not how much."""
        return self.neutral is None

    def unit_in(self, **data_units: str) -> str:
        """`unit` with the data's own units filled in."""
        return self.unit.format(**{name: f"({unit})" for name, unit in data_units.items()})


def plain_unit(unit: str) -> str:
    """`unit` as a person writes it: `(mm)/(s^2*((V)))` as `mm/(s^2*V)`; nothing of a number that has none."""
    before = ""
    while before != unit:
        before, unit = unit, re.sub(r"\(\(([^()]*)\)\)", r"(\1)", re.sub(r"\((\w+)\)", r"\1", unit))
    return unit.removeprefix("dimensionless")


@dataclass(frozen=True, slots=True, kw_only=True)
class Mechanism:
    """An extension of a nominal model: id of the file formats, physics in a sentence, parameters."""

    id: str
    statement: str
    """One sentence; parameters as `{level}` are filled in with value and unit."""
    parameters: tuple[Parameter, ...]
    forms: Mapping[str, str] = field(default_factory=dict)
    """Amplitude -> sentence where it acts alone: ways to act of which a device has one, looked for one at a time."""
    of_identification: bool = False
    """Corrects what identification made of records in which other effects acted too: beside those, a small one is the
    identification's own error."""
    slow: bool = False
    """Grows with the time since a record began, whose first part says little of it."""

    def __post_init__(self) -> None:
        if all(parameter.is_shape for parameter in self.parameters):
            raise ValueError(f"{self.id}: a mechanism needs a parameter with a neutral value")
        unknown = self.forms.keys() - {amplitude.name for amplitude in self.amplitudes}
        if unknown:
            raise ValueError(f"{self.id}: forms are named after amplitudes, {', '.join(unknown)} is none")

    def form_of(self, amplitude: str) -> str:
        """The form that an amplitude belongs to; "" where all act together."""
        return amplitude if amplitude in self.forms else ""

    def sentence(self, values: Mapping[str, float]) -> str:
        """That of the one form that acts at `values`, else the general one."""
        acting = [name for name in self.forms if values.get(name)]
        return self.forms[acting[0]] if len(acting) == 1 else self.statement

    @property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """Parameters that switch it off when they are all neutral."""
        return tuple(parameter for parameter in self.parameters if not parameter.is_shape)
