"""How a reading and its errors are drawn: in which unit, and a logarithm as the quantity that it is of.

Errors have a unit of their own: those of a reading in mm may be nm. Errors of ln R are relative ones, drawn in percent.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from rtctl.border.arrays import FloatArray
from rtctl.output.readable_units import printed_unit
from rtctl.plots.elements.channels import fitting_unit, spans_decades
from rtctl.plots.elements.style import few_decades

_LOGARITHM = re.compile(r"ln\((\w+)\)$")
PERCENT = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnReading:
    """The axis of a reading."""

    name: str
    unit: str
    """As it is printed."""
    factor: float
    is_logarithm: bool = False
    """Whether the data are the natural logarithm of what is drawn."""
    is_logarithmic: bool = False
    """Whether the axis is logarithmic."""

    def of(self, values: FloatArray) -> FloatArray:
        """Return data values (n,) as they are drawn."""
        with np.errstate(over="ignore"):  # of a model that diverges
            plain: FloatArray = np.exp(values) if self.is_logarithm else values
            return self.factor * plain

    def label(self, axes: Axes) -> None:
        """Label the y axis, and make it logarithmic where it is."""
        axes.set_ylabel(f"{self.name} [{self.unit}]")
        if self.is_logarithmic:
            axes.set_yscale("log")
            few_decades(axes.yaxis)


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnError:
    """The axis of the errors of a reading."""

    unit: str
    factor: float

    @property
    def label(self) -> str:
        """Label of the axis."""
        return f"error [{self.unit}]"

    def of(self, errors: FloatArray) -> FloatArray:
        """Return errors (n,) of the data as they are drawn."""
        with np.errstate(over="ignore"):
            return self.factor * errors


def drawn_reading(output: str, unit: str, *values: FloatArray) -> DrawnReading:
    """Return how an output with `values` [`unit`] is drawn."""
    name, logarithm = output.removeprefix("log_").replace("_", " "), _LOGARITHM.match(unit)
    if logarithm is not None:
        plain = np.exp(np.concatenate(values))
        scaled = fitting_unit(logarithm[1], plain)
        return DrawnReading(
            name=name, unit=printed_unit(scaled.unit), factor=scaled.factor, is_logarithm=True,
            is_logarithmic=spans_decades(plain),
        )  # fmt: skip
    scaled = fitting_unit(unit, *values)
    return DrawnReading(name=name, unit=printed_unit(scaled.unit), factor=scaled.factor)


def drawn_error(unit: str, *errors: FloatArray) -> DrawnError:
    """Return how errors (n,) [`unit`] of an output are drawn."""
    if _LOGARITHM.match(unit):
        return DrawnError(unit="%", factor=PERCENT)
    scaled = fitting_unit(unit, *errors)
    return DrawnError(unit=printed_unit(scaled.unit), factor=scaled.factor)
