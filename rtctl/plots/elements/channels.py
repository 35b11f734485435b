"""Drawing of a device's channel: its label, a unit that fits its values, and whether its axis is logarithmic."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from rtctl.border.arrays import FloatArray
from rtctl.border.records import Channel
from rtctl.output.readable_units import Scaled, printed_unit, readable_unit
from rtctl.plots.elements.style import few_decades

SPAN = 2.0
"""Ratio of largest and least reading of a resistance from which its axis is logarithmic."""
LARGEST = 99.9
"""Percentile of the absolute values that chooses the unit of an axis: a spike does not."""
OUTER = (1.0, 99.0)
"""Percentiles of a resistance whose ratio says whether it spans decades: the readings of a broken wire do not."""


class Shown(NamedTuple):
    """One channel on an axis."""

    label: str
    """Label `name [unit]`."""
    unit: str
    """Unit `[unit]`."""
    values: FloatArray
    is_logarithmic: bool
    """Whether its axis is logarithmic: resistances span decades."""


def label_of(channel: Channel) -> str:
    """Return a label such as `coil current [mA]`."""
    return f"{channel.name.replace('_', ' ')} [{printed_unit(channel.unit)}]"


def shown(channel: Channel, values: FloatArray) -> Shown:
    """Return `values` [the channel's unit] as they are drawn."""
    return shown_signal(channel.name, channel.unit, values)


def shown_signal(name: str, unit: str, values: FloatArray) -> Shown:
    """Return `values` [`unit`] as they are drawn: resistances in the unit that fits them, all others in their own."""
    is_resistance = unit == "ohm"
    scaled = fitting_unit(unit, values) if is_resistance else Scaled(1.0, unit)
    text = printed_unit(scaled.unit)
    return Shown(
        label=f"{name.replace('_', ' ')} [{text}]", unit=f"[{text}]", values=scaled.factor * values,
        is_logarithmic=is_resistance and spans_decades(values),
    )  # fmt: skip


def fitting_unit(unit: str, *values: FloatArray) -> Scaled:
    """Return the unit in which `values` [`unit`], drawn on one axis, are read best; spikes do not choose it."""
    finite = [np.abs(one[np.isfinite(one)]) for one in values]
    every = np.concatenate(finite) if finite else np.empty(0)
    if spans_decades(every):
        return readable_unit(float(np.median(every)), unit)
    return readable_unit(float(np.percentile(every, LARGEST)) if len(every) else 0.0, unit)


def spans_decades(values: FloatArray) -> bool:
    """Return whether positive values spread so far that a logarithmic axis shows more of them."""
    finite = values[np.isfinite(values)]
    if not len(finite) or not finite.min() > 0.0:
        return False
    low, high = np.percentile(finite, OUTER).tolist()
    return bool(high > SPAN * low)


def scale_axis(axes: Axes, which: str, channel: Shown) -> None:
    """Make the axis logarithmic where the channel is, with ticks that read 10, 20, 50, 100."""
    if not channel.is_logarithmic:
        return
    if which == "y":
        axes.set_yscale("log")
    else:
        axes.set_xscale("log")
    few_decades(axes.yaxis if which == "y" else axes.xaxis)
