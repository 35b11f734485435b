"""PIDs of several outputs behind a static decoupler, with anti-windup in the outputs' own coordinates.

    u = u0 + K v,   v_i = PID_i(setpoint_i, y_i),   and what the limits let through: v := G (u_applied - u0)

v_i has the unit of output i and would move it alone, at rest, by as much. Where a limit holds a command back, each
integral gives up what its own output lost by that.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.controllers.pid import PidController, PidGains
from rtctl.controllers.several.decoupling import Decoupler
from rtctl.estimators.several_outputs import SeveralEstimates
from rtctl.interfaces import Column, ControlAction, Estimate

TERMS = ("proportional", "integral", "derivative")


class DecoupledPid:
    """`rtctl.interfaces.Controller` of several outputs; the estimate must be one of `SeveralOutputs`."""

    preview_s = 0.0

    # 7 parameters because it is made of as many parts
    def __init__(
        self,
        gains: PidGains,
        decoupler: Decoupler,
        center: FloatArray,
        outputs: Sequence[Column],
        further: FloatArray,
        *,
        period_s: float,
        setpoint_weight: float,
    ) -> None:
        """Build the controller.

        Args:
            gains: Gains of every PID: behind the decoupler each output has the gain 1.
            decoupler: Commands of each output.
            center: Commands (commands,) of the working point, u0.
            outputs: Names and units, the loop's own output first.
            further: Setpoints (outputs - 1, samples) of the other outputs.
            period_s: Sample period [s].
            setpoint_weight: Weight of every PID.
        """
        self._pids = [PidController(gains, unit=unit, setpoint_weight=setpoint_weight) for _, unit in outputs]
        self._decoupler, self._center, self._further, self._period_s = decoupler, center, further, period_s
        self.terms = tuple(
            [(f"{word}_{name}", unit) for name, unit in outputs[1:] for word in ("setpoint", "estimate")]
            + [(f"{word}_{name}", unit) for name, unit in outputs for word in TERMS]
        )
        self._at = 0
        self._asked = self._center

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        """Start so that the first commands equal the applied levels."""
        self._at = -2  # the first step is that of the start, the second that of the first sample
        alone = self._alone(levels)
        for pid, level, wanted, value in zip(
            self._pids, alone.tolist(), self._wanted(setpoint), _values(estimate), strict=True
        ):
            pid.start((level,), wanted, estimate._replace(value=value))

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        """Return the commands and the terms of every output; see `Controller`."""
        self._at += max(1, round(elapsed_s / self._period_s))
        wanted, values = self._wanted(setpoint), _values(estimate)
        actions = [
            pid.step(one, one, estimate._replace(value=value), elapsed_s)
            for pid, one, value in zip(self._pids, wanted, values, strict=True)
        ]
        asked = np.array([action.levels[0] for action in actions])
        self._asked = self._center + self._decoupler.inverse @ asked
        beside = [number for pair in zip(wanted[1:], values[1:], strict=True) for number in pair]
        terms = (*beside, *(term for action in actions for term in action.terms))
        return ControlAction(tuple(self._asked.tolist()), terms)

    def applied(self, levels: Sequence[float]) -> None:
        """Take back from each integral what its output lost by the limits (anti-windup)."""
        if tuple(levels) == tuple(self._asked.tolist()):
            return
        for pid, level in zip(self._pids, self._alone(levels).tolist(), strict=True):
            pid.applied((level,))

    def _alone(self, levels: Sequence[float]) -> FloatArray:
        """Return what each output gets of commands, (outputs,) in its unit."""
        return np.asarray(self._decoupler.gains @ (np.asarray(levels, dtype=np.float64) - self._center))

    def _wanted(self, setpoint: float) -> list[float]:
        at = min(max(self._at, 0), self._further.shape[1] - 1)
        return [setpoint, *self._further[:, at].tolist()]


def _values(estimate: Estimate) -> tuple[float, ...]:
    assert isinstance(estimate, SeveralEstimates)
    return (estimate.value, *estimate.further)
