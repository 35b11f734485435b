"""A model as ordinary differential equations: dx/dt = rates(t, x, u), y = read(t, x, u), each in its own unit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from rtctl.border.arrays import FloatArray

Law = Callable[[float, FloatArray, FloatArray], FloatArray]
"""Function of time [s], states (states,) and inputs (inputs,)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """An input, a state or an output."""

    name: str
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dynamics:
    """A model's equations."""

    kind: str
    inputs: tuple[Channel, ...]
    states: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    initial: FloatArray
    """States (states,) at the start of a record."""
    rates: Law
    """Time derivatives (states,), in the states' units per second."""
    read: Law
    """Outputs (outputs,)."""
