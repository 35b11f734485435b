"""What the outputs do when an unknown moves: a free run and its neighbours as lanes of one simulation.

Unknowns are scaled: values = scale x unknown, so that one step of the finite differences suits all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import Prediction, Simulation
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import parameter_scales, scales_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
DIFFERENCE = 1e-7
"""Of an unknown, or of its scale if that is more: round-off is 1e-6 of a derivative, cut-off Q times 1e-7."""


class Linearised(NamedTuple):
    """A free run minus the measurement, and its derivatives by scaled unknowns."""

    residual: FloatArray
    """(outputs, n) from the first scored sample on."""
    shared: FloatArray
    """(p, outputs, n)"""
    own: FloatArray
    """(states or 0, outputs, n)"""
    begin: FloatArray
    """(1 + p + states or 0, all outputs of the simulation) at the first sample: the run and its derivatives."""
    end: FloatArray
    """The same at the last sample."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitivity:
    """A simulation, which of its parameters move, in which units, and whether initial states move too."""

    simulation: Simulation
    free: IntArray
    scale: FloatArray
    """Of each free parameter."""
    state_scale: FloatArray
    """Of each initial state; (0,) where they are given."""
    outputs: tuple[str, ...]
    """That are compared."""
    of_record: IntArray = field(default_factory=lambda: np.empty(0, np.intp))
    """Indices of parameters that each record has for itself; they follow the initial state among its own unknowns."""

    @classmethod
    def of(
        cls,
        simulation: Simulation,
        records: Sequence[FitRecord],
        free: Sequence[int] | None = None,
        *,
        free_start: bool = True,
        scales: Scales | None = None,
        of_record: Sequence[int] = (),
    ) -> Sensitivity:
        """`free`: indices of parameters; None: those that are not fixed. `of_record`: of those, each record's own."""
        scales = scales or scales_of(records)
        moving = [k for k, one in enumerate(simulation.parameters) if not one.fixed] if free is None else free
        moving = [k for k in moving if k not in of_record]
        apart = parameter_scales([simulation.parameters[k] for k in of_record], scales)
        sizes = parameter_scales([simulation.parameters[k] for k in moving], scales)
        by_name = {"displacement": scales.displacement, "velocity": scales.velocity}
        states = [by_name.get(name, 1.0) or 1.0 for name in simulation.state] if free_start else []
        measured = set.intersection(*(set(record.measured) for record in records))
        return cls(
            simulation=simulation,
            free=np.array(moving, dtype=np.intp),
            scale=sizes,
            state_scale=np.append(states, apart),
            outputs=tuple(name for name in simulation.outputs if name in measured),
            of_record=np.array(of_record, dtype=np.intp),
        )

    @property
    def own_values(self) -> FloatArray:
        """Of the simulation, all (parameters,)."""
        return np.array([parameter.value for parameter in self.simulation.parameters])

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Of the scaled free parameters."""
        found = [self.simulation.parameters[k] for k in self.free]
        low, high = np.array([one.low for one in found]), np.array([one.high for one in found])
        return low / self.scale, high / self.scale

    def values(self, shared: FloatArray) -> FloatArray:
        """All parameters (parameters,) with the free ones at `shared` (p,), scaled."""
        values = self.own_values
        values[self.free] = shared * self.scale
        return values

    def linearise(
        self, record: FitRecord, shared: FloatArray, start: FloatArray, steps_per_period: float | None = None
    ) -> Linearised | None:
        """Around scaled `shared` (p,) from the initial state `start` (states,) in units; None: it diverges there.

        `start` goes on with the record's own parameters, where there are any.
        """
        p, q = len(self.free), len(self.state_scale)
        shared_steps, own_steps = self._steps(shared, start)
        values = np.tile(self.values(shared), (1 + p + q, 1))
        states = len(start) - len(self.of_record)
        initial = np.tile(start[:states], (1 + p + q, 1))
        values[:, self.of_record] = start[states:]
        for k in range(p):
            values[1 + k, self.free[k]] += shared_steps[k]
        for k in range(q):
            if k < states:
                initial[1 + p + k, k] += own_steps[k]
            else:
                values[1 + p + k, self.of_record[k - states]] += own_steps[k]
        try:
            run = self.simulation.predict(record.stimulus, values, initial, steps_per_period)
        except ValueError:  # no sensible step resolves these values
            return None
        if (run.diverged_at >= 0).any():
            return None
        lanes = np.stack([run.outputs[name][:, record.first :] for name in self.outputs], axis=1)
        measured = np.stack([record.measured[name][record.first :] for name in self.outputs])
        moves = np.concatenate((shared_steps / self.scale, own_steps / self.state_scale))
        slopes = (lanes[1:] - lanes[0]) / moves[:, None, None]
        begin, end = (self._reading(run, sample, moves) for sample in (0, -1))
        return Linearised(lanes[0] - measured, slopes[:p], slopes[p:], begin, end)

    def _reading(self, run: Prediction, sample: int, moves: FloatArray) -> FloatArray:
        lanes = np.stack([run.outputs[name][:, sample] for name in self.simulation.outputs], axis=1)
        return np.concatenate((lanes[:1], (lanes[1:] - lanes[0]) / moves[:, None]))

    def _steps(self, shared: FloatArray, start: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Finite differences in units, away from a bound."""
        steps = DIFFERENCE * self.scale * np.maximum(np.abs(shared), 1.0)
        steps = np.where(shared * self.scale + steps > self.bounds[1] * self.scale, -steps, steps)
        own = DIFFERENCE * np.maximum(self.state_scale, np.abs(start[: len(self.state_scale)]))
        return steps, own
