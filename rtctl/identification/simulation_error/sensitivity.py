"""Sensitivities of the outputs: a free run and its neighbours as lanes of one simulation.

Unknowns are scaled: values = scale x unknown, so that one step of the finite differences suits all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import FreeParameter, Prediction, Simulation
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import compute_parameter_scales, estimate_scales

IntArray = NDArray[np.intp]
FORWARD_STEP = 1e-7
"""Step of a forward difference, relative to an unknown or its scale.

Round-off is 1e-6 of a derivative, truncation Q times 1e-7.
"""
MAX_LINEAR_SHARE = 1e-3
"""Share of an output's swing: a neighbour that departs by more is near a fold, where forward slopes are wrong."""
CENTRAL_SHARE = 5e-4
"""Departure aimed at by the central difference that replaces it: truncation and round-off are 1e-5 of a derivative."""
MIN_STEP_FACTOR = 1e-6
"""Smallest factor of the forward step; a motion that departs further over less has no slope."""


class Linearisation(NamedTuple):
    """A free run minus the measurement, and its derivatives by scaled unknowns."""

    residual: FloatArray
    """Simulated minus measured (outputs, n) from the first scored sample on."""
    shared: FloatArray
    """Derivatives by the shared unknowns (p, outputs, n)."""
    local: FloatArray
    """Derivatives by the local unknowns (q, outputs, n)."""
    begin: FloatArray
    """The reading at the first sample and its derivatives (1 + p + q, continued outputs)."""
    end: FloatArray
    """The reading at the last sample and its derivatives (1 + p + q, continued outputs)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitivity:
    """A simulation, its free parameters and their scales, and whether initial states are free too."""

    simulation: Simulation
    free: IntArray
    scale: FloatArray
    """Scale of each free parameter (p,) in its unit."""
    state_scale: FloatArray
    """Scale of each local unknown (q,); (0,) where initial states are given."""
    outputs: tuple[str, ...]
    """Names of the outputs that are compared."""
    record_parameters: IntArray = field(default_factory=lambda: np.empty(0, np.intp))
    """Indices of parameters with one value a record; they follow the initial state among its local unknowns."""
    fastest: FloatArray = field(default_factory=lambda: np.empty(0))
    """Size of each free parameter (p,) in its unit beyond which samples show nothing of it; (0,) without limits."""

    @classmethod
    def of(
        cls,
        simulation: Simulation,
        records: Sequence[FitRecord],
        free: Sequence[int] | None = None,
        *,
        free_start: bool = True,
        scales: Scales | None = None,
        record_parameters: Sequence[int] = (),
    ) -> Sensitivity:
        """Build the sensitivity of a simulation on these records.

        Args:
            simulation: Model and parameters.
            records: Records that set the scales and the compared outputs.
            free: Indices of the free parameters; None: all that are not fixed.
            free_start: Whether initial states are free.
            scales: Typical sizes of the motion; None: estimated from the records.
            record_parameters: Indices of those free parameters that have one value a record.
        """
        scales = scales or estimate_scales(records)
        moving = [k for k, one in enumerate(simulation.parameters) if not one.fixed] if free is None else free
        moving = [k for k in moving if k not in record_parameters]
        apart = compute_parameter_scales([simulation.parameters[k] for k in record_parameters], scales)
        sizes = compute_parameter_scales([simulation.parameters[k] for k in moving], scales)
        by_name = {"displacement": scales.displacement, "velocity": scales.velocity}
        states = [by_name.get(name, 1.0) or 1.0 for name in simulation.state] if free_start else []
        swept = "frequency" in records[0].stimulus.inputs
        measured = set.intersection(*(set(record.measured) for record in records))
        return cls(
            simulation=simulation,
            free=np.array(moving, dtype=np.intp),
            scale=sizes,
            state_scale=np.append(states, apart),
            outputs=tuple(name for name in simulation.outputs if name in measured),
            record_parameters=np.array(record_parameters, dtype=np.intp),
            fastest=np.empty(0) if swept else _fastest_of([simulation.parameters[k] for k in moving], scales),
        )

    @property
    def continued(self) -> tuple[str, ...]:
        """Names of the outputs that are states, which go on where one segment ends and the next begins."""
        return (
            tuple(name for name in self.simulation.outputs if name in self.simulation.state) or self.outputs
        )

    @property
    def current_values(self) -> FloatArray:
        """Values (parameters,) of the simulation itself."""
        return np.array([parameter.value for parameter in self.simulation.parameters])

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds (p,) of the scaled shared parameters."""
        found = [self.simulation.parameters[k] for k in self.free]
        low, high = np.array([one.low for one in found]), np.array([one.high for one in found])
        if self.fastest.size:
            low, high = np.maximum(low, -self.fastest), np.minimum(high, self.fastest)
        return low / self.scale, high / self.scale

    def find_at_limit(self, shared: FloatArray) -> tuple[str, ...]:
        """Return the names of the shared unknowns (p,) that ended beyond what samples show."""
        if not self.fastest.size:
            return ()
        ended = np.abs(shared * self.scale) >= (1.0 - 1e-6) * self.fastest
        return tuple(self.simulation.parameters[k].name for k in self.free[ended])

    def values(self, shared: FloatArray) -> FloatArray:
        """Return all parameters (parameters,) with the shared ones at `shared` (p,), scaled."""
        values = self.current_values
        values[self.free] = shared * self.scale
        return values

    def linearise(
        self, record: FitRecord, shared: FloatArray, start: FloatArray, steps_per_period: float | None = None
    ) -> Linearisation | None:
        """Linearise the free run of a record.

        Args:
            record: Inputs and measured outputs.
            shared: (p,) scaled shared unknowns.
            start: Initial state (states,) in units, followed by the record's own parameters where there are any.
            steps_per_period: Steps of the integrator; None: the simulation's own.

        Returns:
            The linearisation, or None where the run diverges.
        """
        p = len(self.free)
        ahead = self._steps(shared, start)
        behind = np.zeros_like(ahead)
        run = self._run(record, shared, start, _build_lanes(ahead, behind), steps_per_period)
        moved = self._moved(run, record) if run is not None else behind
        if (moved > MAX_LINEAR_SHARE).any():
            ahead, behind = self._on_both_sides(shared, ahead, moved)
            run = self._run(record, shared, start, _build_lanes(ahead, behind), steps_per_period)
        if run is None:
            return None
        lanes = self._lanes(run, record)
        measured = np.stack([record.measured[name][record.first :] for name in self.outputs])
        moves = (ahead + behind) / np.concatenate((self.scale, self.state_scale))
        slopes = _compute_slopes(lanes, behind, moves)
        begin, end = (self._reading(run, sample, behind, moves) for sample in (0, -1))
        return Linearisation(lanes[0] - measured, slopes[:p], slopes[p:], begin, end)

    def change(
        self,
        record: FitRecord,
        shared: FloatArray,
        start: FloatArray,
        move: FloatArray,
        steps_per_period: float | None = None,
    ) -> FloatArray | None:
        """Return the change (outputs, n) of the free run by a step of all scaled unknowns.

        Args:
            record: Inputs and measured outputs.
            shared: (p,) scaled shared unknowns.
            start: Initial state as in `linearise`.
            move: (p + q,) step of the scaled unknowns.
            steps_per_period: Steps of the integrator; None: the simulation's own.

        Returns:
            The change, or None where the run diverges or the step crosses a bound.
        """
        there = shared + move[: len(shared)]
        if (there < self.bounds[0]).any() or (there > self.bounds[1]).any():
            return None
        both = np.vstack((np.zeros_like(move), move * np.concatenate((self.scale, self.state_scale))))
        run = self._run(record, shared, start, both, steps_per_period)
        if run is None:
            return None
        without, with_it = self._lanes(run, record)
        changed: FloatArray = with_it - without
        return changed

    def _lanes(self, run: Prediction, record: FitRecord) -> FloatArray:
        """Return the lanes (lanes, outputs, n) from the first scored sample on."""
        return np.stack([run.outputs[name][:, record.first :] for name in self.outputs], axis=1)

    def _run(
        self,
        record: FitRecord,
        shared: FloatArray,
        start: FloatArray,
        moves: FloatArray,
        steps_per_period: float | None,
    ) -> Prediction | None:
        """Run lanes at `moves` (lanes, p + q) in units from the unknowns.

        None where one diverges, or where no sensible step of the integrator resolves the values.
        """
        p, states = len(self.free), len(start) - len(self.record_parameters)
        values = np.tile(self.values(shared), (len(moves), 1))
        values[:, self.record_parameters] = start[states:]
        values[:, self.free] += moves[:, :p]
        values[:, self.record_parameters] += moves[:, p + states :]
        initial = np.tile(start[:states], (len(moves), 1))
        initial[:, : moves.shape[1] - p] += moves[:, p : p + states]
        try:
            run = self.simulation.predict(record.stimulus, values, initial, steps_per_period)
        except ValueError:
            return None
        return None if (run.diverged_at >= 0).any() else run

    def _moved(self, run: Prediction, record: FitRecord) -> FloatArray:
        """Return the largest departure (p + q,) of each neighbour from the run, as a share of the output's swing."""
        shares = np.zeros(len(self.scale) + len(self.state_scale))
        for name in self.outputs:
            lanes = run.outputs[name][:, record.first :]
            swing = max(np.ptp(lanes[0]), np.ptp(record.measured[name][record.first :]))
            if swing > 0.0:
                shares = np.maximum(shares, np.abs(lanes[1:] - lanes[0]).max(axis=1, initial=0.0) / swing)
        return shares

    def _on_both_sides(
        self, shared: FloatArray, ahead: FloatArray, moved: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return steps ahead and behind, smaller where a neighbour departed far; none behind near a bound."""
        small = ahead * np.clip(CENTRAL_SHARE / np.maximum(moved, CENTRAL_SHARE), MIN_STEP_FACTOR, 1.0)
        behind, p = small.copy(), len(self.free)
        low, high = self.bounds
        reached = shared - small[:p] / self.scale
        behind[:p] = np.where((reached < low) | (reached > high), 0.0, small[:p])
        return small, behind

    def _reading(self, run: Prediction, sample: int, behind: FloatArray, moves: FloatArray) -> FloatArray:
        """Return the continued reading at a sample and its derivatives (1 + p + q, continued outputs)."""
        lanes = np.stack([run.outputs[name][:, sample] for name in self.continued], axis=1)
        return np.concatenate((lanes[:1], _compute_slopes(lanes[..., None], behind, moves)[..., 0]))

    def _steps(self, shared: FloatArray, start: FloatArray) -> FloatArray:
        """Return finite-difference steps (p + q,) in units, away from a bound."""
        steps = FORWARD_STEP * self.scale * np.maximum(np.abs(shared), 1.0)
        steps = np.where(shared * self.scale + steps > self.bounds[1] * self.scale, -steps, steps)
        own = FORWARD_STEP * np.maximum(self.state_scale, np.abs(start[: len(self.state_scale)]))
        return np.concatenate((steps, own))


def _build_lanes(ahead: FloatArray, behind: FloatArray) -> FloatArray:
    """Return the lanes (lanes, p + q): no step, each step ahead, each step behind that is not zero."""
    return np.vstack((np.zeros_like(ahead), np.diag(ahead), -np.diag(behind)[behind != 0.0]))


def _compute_slopes(lanes: FloatArray, behind: FloatArray, moves: FloatArray) -> FloatArray:
    """Return slopes (p + q, outputs, n) of lanes in the order of `_build_lanes`.

    Args:
        lanes: (lanes, outputs, n) outputs.
        behind: (p + q,) steps behind, 0 for a forward difference.
        moves: (p + q,) distance from behind to ahead in scaled units.
    """
    other = np.zeros(len(behind), dtype=np.intp)
    other[behind != 0.0] = 1 + len(behind) + np.arange(np.count_nonzero(behind))
    slopes: FloatArray = (lanes[1 : 1 + len(behind)] - lanes[other]) / moves[:, None, None]
    return slopes


def _fastest_of(parameters: Sequence[FreeParameter], scales: Scales) -> FloatArray:
    """Return the largest sizes (p,) that samples show; of a model that begins beyond it, its own size."""
    return np.array(
        [
            max(one.declared.fastest(scales), abs(one.value)) if one.declared.fastest else np.inf
            for one in parameters
        ]
    )
