"""What a loop knows of a device whose model is a user's equations: rates and outputs, nothing that integrates them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.records import DeviceProfile


class LawSources(NamedTuple):
    """Sources of Python functions `law(x, u, p, out) -> 0` with x (n,), u (inputs,), p (parameters,), all SI, at t = 0.

    The functions that they call (`exp`, `power`, ..., as in `rtctl.arithmetic.elementary`) are the caller's.
    """

    rates: str
    """Fills `out` (n,) with rates; 0 where a state is at a limit that its rate points beyond."""
    outputs: str
    """Fills `out` (outputs,), each in its unit."""
    guards: str
    """Fills `out` (events,) with what the events watch."""
    resets: str
    """Fills `out` (events * n,) with the states after each event, where it sets them."""
    own: Mapping[str, Any]
    """Compiled functions of the user by the names under which the sources call them."""


class ModelOutput(NamedTuple):
    """An output of the model."""

    name: str
    unit: str
    reach: tuple[float, float] | None
    """Lowest and highest value that a loop may ask for; None: the file states none."""


class StateSpace(Protocol):
    """Equations x' = f(x, u), y = h(x, u), w = g(x, u) with their parameters: readings y and the controlled output w.

    States are in SI base units, inputs and outputs in the units of the profile's channels.
    """

    profile: DeviceProfile
    states: tuple[str, ...]
    """Names of the states."""
    initial: FloatArray
    """States (n,) at power-up."""
    low: FloatArray
    """Values (n,) below which the states do not go."""
    high: FloatArray
    noise: FloatArray
    """Standard deviation (readings,) of each reading; 0 where the model file states none."""
    output_range: tuple[float, float] | None
    """Lowest and highest value of the controlled output that a loop may ask for; None: the file states none."""
    command_range: FloatArray
    """Lowest and highest value (inputs, 2) of each command."""
    outputs: tuple[ModelOutput, ...]
    """All outputs of the model, also the one that the loop does not read."""
    shown: int
    """Which of them is the controlled one."""
    left_out: tuple[str, ...]
    """Mechanisms of the model file that are not equations of it, such as a delay: this does not have them."""
    sources: LawSources
    parameters: FloatArray
    """Parameters (parameters,) of the laws [SI]."""
    input_factors: FloatArray
    """SI base units (inputs,) of each input's unit."""
    sensed: tuple[int, ...]
    """Places of the readings among the outputs."""
    directions: FloatArray
    """Direction (events,) in which what an event watches passes zero: +1, -1, 0 for both."""
    switched: NDArray[np.bool_]
    """Whether each state (n,) changes at events alone."""

    def __hash__(self) -> int:
        """Return the hash of this very model."""
        ...

    def input_si(self, levels: Sequence[float]) -> FloatArray:
        """Return commands (inputs,) in SI base units."""
        ...

    def rates(self, x: FloatArray, levels: Sequence[float]) -> FloatArray:
        """Return the rates (m, n) [SI/s] of states `x` (m, n) under one set of commands."""
        ...

    def readings(self, x: FloatArray, levels: Sequence[float]) -> FloatArray:
        """Return the readings (m, readings) of states `x` (m, n)."""
        ...

    def all_outputs(self, x: FloatArray, levels: Sequence[float]) -> FloatArray:
        """Return all outputs (m, outputs) of states `x` (m, n), each in its unit."""
        ...

    def controlled(self, x: FloatArray, levels: Sequence[float]) -> FloatArray:
        """Return the controlled output (m,) of states `x` (m, n)."""
        ...
