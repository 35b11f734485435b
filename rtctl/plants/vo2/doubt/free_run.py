"""Free run of a VO2 model on recorded commands, with its answer to small changes of the device.

The model runs from the first command on and is never corrected by a reading, so that nothing hides what it gets wrong:

    r = ln R_read - ln R_model,    e = D_read - D_model,    dr/dtheta_j = (ln R_j - ln R_model) / delta_j

Beside it run copies in which one thing each differs by delta_j: heat, gain of the current, delay, ... Each keeps
its own history, because the local slope of a hysteretic model says nothing of how its loops answer.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.doubt.belief import Direction, Named, Predicted, Rows
from rtctl.hysteresis.film_memory import FilmMemory
from rtctl.models.vo2 import Vo2Model
from rtctl.plants.vo2.doubt.explaining import Taken, explain
from rtctl.plants.vo2.doubt.path_run import PathRun
from rtctl.plants.vo2.doubt.pure_phases import lagging, pure_phases
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics, loop_dynamics

HEAT_MA2 = 0.2  # a fifth of a degree
GAIN = 2e-3
TIME_SHARE = 0.25  # of the time constant: a delay, the lags
SECOND_SHARE = 0.05
SECOND_TIMES = 4.0  # time constant of the second part over the first


@dataclass(frozen=True, slots=True, kw_only=True)
class Copy:
    """A copy of the model that differs in one thing."""

    dynamics: Vo2Dynamics
    heat: float = 0.0
    """Heat beside the current's [mA^2]."""
    size: float = 1.0
    """By how much it differs [the direction's unit]."""


def copies_of(model: Vo2Model) -> dict[str, Copy]:
    """Return the model itself under "", and the copies by the id of what differs."""
    own = loop_dynamics(model)
    balance, tau_s = own.balance, own.balance.time_constant_s
    time_s = TIME_SHARE * tau_s
    gain, offset = own.current
    stronger = own.current._replace(gain=gain * (1.0 + GAIN), offset=offset * (1.0 + GAIN))
    found = {
        "": Copy(dynamics=own),
        "thermal.ambient_drift": Copy(dynamics=own, heat=HEAT_MA2, size=HEAT_MA2),
        "input.gain_drift": Copy(dynamics=replace(own, current=stronger), size=GAIN),
        "actuation.delay": Copy(dynamics=replace(own, delay_s=own.delay_s + time_s), size=time_s),
        "sensor.lag": Copy(dynamics=replace(own, sensor_lag_s=own.sensor_lag_s + time_s), size=time_s),
        "hysteresis.rate_dependence": Copy(dynamics=lagging(own, time_s, pure_phases(model)), size=time_s),
    }
    if balance.share == 0.0:
        second = balance._replace(share=SECOND_SHARE, second_time_constant_s=SECOND_TIMES * tau_s)
        found["thermal.second_time_constant"] = Copy(dynamics=replace(own, balance=second), size=SECOND_SHARE)
    return found


MEMORIES = 32
"""Windows of which it is known what the film had been through at their end."""
ROUNDING = 1e-10
"""Share of a course below which two copies of it are the same: a lag of the sensor moves no beam."""
UNITS = {
    "thermal.ambient_drift": "mA^2", "input.gain_drift": "", "actuation.delay": "s", "sensor.lag": "s",
    "hysteresis.rate_dependence": "s", "thermal.second_time_constant": "", "sensor.gain": "",
}  # fmt: skip


class Vo2Belief:
    """`rtctl.doubt.belief.Belief` of a VO2 actuator; residuals are those of ln R."""

    def __init__(self, model: Vo2Model) -> None:
        self._model = model
        self._taken: Taken | None = None
        self._memories: deque[tuple[int, FilmMemory]] = deque(maxlen=MEMORIES)
        self._copies = copies_of(model)
        self._runs = {name: PathRun(model, copy.dynamics) for name, copy in self._copies.items()}
        self.directions = tuple(
            Direction(name, UNITS[name]) for name in (*list(self._copies)[1:], "sensor.gain")
        )
        self.reading_error = model.reading_error_elsewhere or 3.0 * model.reading_error
        self.output_error = model.deflection_error_elsewhere or 3.0 * model.deflection_error
        self.output_unit = "um"
        self.output_width = model.deflection.width
        self._log_width = math.log(model.resistance.high / model.resistance.low)

    def memory_before(self, sample: int) -> tuple[int, FilmMemory] | None:
        """See `Belief`; by the model's free run."""
        return next((one for one in reversed(self._memories) if one[0] <= sample), None)

    def start(self, level: float) -> None:
        """See `Belief`."""
        self._memories.clear()
        for run in self._runs.values():
            run.start(level)

    def predict(self, rows: Rows) -> Predicted:
        """See `Belief`."""
        warmth, aged = np.zeros((2, len(rows.levels)))
        if self._taken is not None:
            warmth, aged = self._taken.courses(rows)
        found = {
            name: self._runs[name].run(rows.levels, rows.elapsed_s, copy.heat + warmth)
            for name, copy in self._copies.items()
        }
        reading, output, warm = found[""]
        self._memories.append((int(rows.samples[-1]) + 1, self._runs[""].film_memory()))
        pairs = [(found[name], self._copies[name].size) for name in self._copies if name]
        still = np.zeros_like(reading)
        width = self._model.current.width
        motion = np.stack([np.sqrt(np.maximum(warm, 0.0)) / width, reading / self._log_width], axis=1)
        return Predicted(
            log_of(rows.sensed) - reading - aged, reading, output, motion,
            np.stack([*(_answer(one[0], reading, size) for one, size in pairs), still + 1.0], axis=1),
            np.stack([*(_answer(one[1], output, size) for one, size in pairs), still], axis=1),
        )  # fmt: skip

    def explain(self, rows: Rows, onset: int, before: tuple[float, float]) -> list[Named]:
        """See `Belief`."""
        if self._taken is None:
            period_s = float(np.median(rows.elapsed_s))
            self._taken = Taken(self._copies[""].dynamics, pure_phases(self._model), period_s)
        return explain(self._model, rows, onset, before, self._taken)

    def take(self, named: Named, sample: int) -> None:
        """See `Belief`."""
        if self._taken is not None:
            self._taken.take(named, sample)


def _answer(changed: FloatArray, course: FloatArray, size: float) -> FloatArray:
    """Return what a change of `size` does to a course (n,), per unit; 0 where the two differ by rounding alone."""
    apart = changed - course
    if np.abs(apart).max(initial=0.0) <= ROUNDING * np.abs(course).max(initial=0.0):
        return np.zeros_like(course)
    return apart / size


def log_of(resistance: FloatArray) -> FloatArray:
    """Return ln R (n,); of what is no resistance the value before, so that a lost reading is a reading that stands."""
    good = np.isfinite(resistance) & (resistance > 0.0)
    if not good.any():
        return np.zeros_like(resistance)
    place = np.maximum.accumulate(np.where(good, np.arange(len(good)), int(np.argmax(good))))
    found: FloatArray = np.log(resistance[place])
    return found
