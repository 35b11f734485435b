"""Drawing of a device's channel: its label, a readable unit, and whether its axis is logarithmic."""

from __future__ import annotations

from typing import NamedTuple

from matplotlib.axes import Axes

from rtctl.border.arrays import FloatArray
from rtctl.border.records import Channel
from rtctl.plots.elements.style import kilo

_WRITTEN = {"um": "µm", "ohm": "Ω", "deg": "°"}


class Shown(NamedTuple):
    """One channel on an axis."""

    label: str
    """Label `name [unit]`."""
    unit: str
    """Unit `[unit]`."""
    values: FloatArray
    is_kilo: bool
    """Whether it is logarithmic in thousands: resistances span decades."""


def written(unit: str) -> str:
    """Return a unit as it is printed."""
    return _WRITTEN.get(unit, unit)


def label_of(channel: Channel) -> str:
    """Return a label such as `coil current [mA]`."""
    return f"{channel.name.replace('_', ' ')} [{written(channel.unit)}]"


def shown(channel: Channel, values: FloatArray) -> Shown:
    """Return `values` [the channel's unit] as they are drawn."""
    if channel.unit == "ohm":
        return Shown(f"{channel.name.replace('_', ' ')} [kΩ]", "[kΩ]", values / 1e3, True)
    return Shown(label_of(channel), f"[{written(channel.unit)}]", values, False)


def scale_axis(axes: Axes, which: str, channel: Shown) -> None:
    """Make the axis logarithmic where the channel is."""
    if channel.is_kilo:
        kilo(axes, which)
