"""What changed in a VO2 device, from the rows around the change: each cause alone, its size fitted, the rest as before.

    cost = mean (r / s_r)^2 + mean (e / s_e)^2 over the rows after the onset, each against what it was before

Every trial is a free run over the rows before and after: a cause that begins at the onset leaves what came before
as it was, and hysteresis is asked, not linearised. The time courses are a step (a delay, a lag, a gain) or a ramp
from the onset on (ambient, ageing, the current's gain).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.doubt.belief import Named, Rows
from rtctl.models.vo2 import Vo2Model
from rtctl.plants.vo2.doubt.path_run import PathRun
from rtctl.plants.vo2.doubt.pure_phases import PurePhases, lagging
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
REFINEMENTS = 3
REFINED = 30.0
"""A cause is refined if its first sizes leave at most so many times what the best one leaves."""
LEAST_ROWS, LEAST_SHARE = 500, 0.1
"""Rows before the change from which a difference of the room is taken; of the error before it, what may be left."""
PROBE_MA2 = 0.1
UNCERTAIN_S = 1.0
"""How late after its onset a change may really have begun [s]: a window of the watch."""
SECOND = "thermal.second_time_constant"
SECOND_TIMES = (3.0, 6.0, 12.0)
"""Time constants of a second part over the first that are tried first."""
SPREAD, SHAPES, MOST_SHARE = 1.6, 5, 0.9
"""Factor by which a time constant is moved at first, how often, and the largest share of a second part."""


class Taken:
    """Changes that were named before, which the rows have besides the one that is asked for."""

    def __init__(self, dynamics: Vo2Dynamics, phases: PurePhases, period_s: float) -> None:
        self.dynamics, self.phases, self._period_s = dynamics, phases, period_s
        self._courses: list[tuple[str, float, int]] = []

    def take(self, named: Named, sample: int) -> None:
        """Take a cause as true from a sample on; those of a shape that is not known any more are left out."""
        own, size = self.dynamics, named.size
        if named.id == "actuation.delay":
            self.dynamics = replace(own, delay_s=own.delay_s + size)
        elif named.id == "sensor.lag":
            self.dynamics = replace(own, sensor_lag_s=own.sensor_lag_s + size)
        elif named.id == "hysteresis.rate_dependence":
            self.dynamics = lagging(own, size, self.phases)
        elif named.id in ("thermal.ambient_drift", "input.gain_drift", "sensor.ageing", "sensor.gain"):
            self._courses.append((named.id, size, sample))

    def courses(self, rows: Rows) -> tuple[FloatArray, FloatArray]:
        """Return heat [mA^2] and what is added to ln R, of each row (n,)."""
        warmth, aged = np.zeros(len(rows.samples)), np.zeros(len(rows.samples))
        for name, size, sample in self._courses:
            since_s = np.maximum(rows.samples - sample, 0.0) * self._period_s
            if name == "thermal.ambient_drift":
                warmth += size * since_s
            elif name == "input.gain_drift":
                warmth += ((1.0 + size * since_s) ** 2 - 1.0) * rows.levels**2
            elif name == "sensor.ageing":
                aged += size * since_s
            else:
                aged += math.log(1.0 + size) * (rows.samples >= sample)
        return warmth, aged


class Trial:
    """The rows, and what a trial of a cause leaves of their residuals."""

    def __init__(
        self,
        model: Vo2Model,
        dynamics: Vo2Dynamics,
        rows: Rows,
        onset: int,
        before: tuple[float, float],
        taken: Taken,
    ) -> None:
        self.model, self.own, self.rows, self.onset = model, dynamics, rows, onset
        self.before = before
        self.log_read = np.log(np.where(rows.sensed > 0.0, rows.sensed, np.nan))
        time_s = np.cumsum(rows.elapsed_s)
        self.since_s: FloatArray = np.maximum(time_s - time_s[onset], 0.0)
        uncertain = round(UNCERTAIN_S / float(np.median(rows.elapsed_s)))
        self.judged = onset + min(uncertain, (len(rows.levels) - onset) // 3)
        """First row that counts: the onset is known to a window, in which a step that is right may not have begun."""
        self.after: FloatArray = (np.arange(len(rows.levels)) >= onset).astype(np.float64)
        self.heat, self.offset = 0.0, 0.0
        self._warmth, self._aged = taken.courses(rows)
        self.log_read = self.log_read - self._aged
        self._take_heat()
        self.base = self.run(dynamics)
        self._take_offset()

    def _take_heat(self) -> None:
        """Take the heat [mA^2] that fits the rows before the onset: what the room differed by before is no change."""
        begin, k = self.onset // 3, self.onset
        if k - begin < LEAST_ROWS:
            return
        base, warmer = self.run(self.own), self.run(self.own, heat=np.full_like(self.after, PROBE_MA2))
        answer = (warmer[0] - base[0])[begin:k] / PROBE_MA2
        off = np.nan_to_num((self.log_read - base[0])[begin:k])
        if (size := float(answer @ answer)) > 0.0:
            self.heat = float(answer @ off) / size
            left = float(np.mean((off - self.heat * answer) ** 2))
            self.before = (max(left, LEAST_SHARE * self.before[0]), self.before[1])

    def _take_offset(self) -> None:
        """Take what the reference [um] differed by before the onset: the run begins cold, the beam did not."""
        before = slice(self.onset // 3, self.onset)
        off = (self.rows.reference - self.base[1])[before]
        off = off[np.isfinite(off)]
        if len(off) < LEAST_ROWS or not math.isfinite(self.before[1]):
            return
        self.offset = float(off.mean())
        self.before = (self.before[0], max(float(off.var()), LEAST_SHARE * self.before[1]))

    def run(
        self, dynamics: Vo2Dynamics, levels: FloatArray | None = None, heat: FloatArray | None = None
    ) -> FloatArray:
        """Return ln R, deflection [um] and temperature of a free run over all rows (3, n)."""
        rows, nothing = self.rows, self._warmth + self.heat
        path = PathRun(self.model, dynamics)
        path.start(min(float(rows.levels.min()), self.model.current.low))
        levels = rows.levels if levels is None else levels
        return path.run(levels, rows.elapsed_s, nothing if heat is None else nothing + heat)

    def cost(self, found: FloatArray, read: FloatArray | None = None) -> float:
        """Return the cost of a run; `read` (n,) is added to its ln R."""
        k = self.judged
        off = self.log_read[k:] - found[0, k:] - (0.0 if read is None else read[k:])
        cost = float(np.nanmean(off * off)) / self.before[0]
        bent = self.rows.reference[k:] - found[1, k:] - self.offset
        if np.isfinite(bent).any() and math.isfinite(self.before[1]):
            cost = 0.5 * (cost + float(np.nanmean(bent * bent)) / self.before[1])
        return cost


class Cause(NamedTuple):
    """A cause with one size."""

    id: str
    sentence: str
    """With the size as `{own}` in its unit, `{ms}`, `{percent}` or `{factor}`."""
    unit: str
    sizes: tuple[float, ...]
    """Sizes that are tried first, in order; the best one is refined between its neighbours."""
    cost: Callable[[Trial, float], float]
    shape: float = math.nan
    """See `Named`."""

    def tells(self, size: float) -> str:
        """Return the sentence for a size."""
        return self.sentence.format(own=size, ms=1e3 * size, percent=100.0 * size, factor=1.0 + size)


def explain(
    model: Vo2Model, rows: Rows, onset: int, before: tuple[float, float], taken: Taken
) -> list[Named]:
    """Fit each cause; return no change at all, then the causes, the best one first. See `Belief.explain`."""
    dynamics = taken.dynamics
    trial = Trial(model, dynamics, rows, onset, before, taken)
    nothing = Named("", "nothing has changed", 0.0, "", trial.cost(trial.base))
    coarse = [
        (cause, [cause.cost(trial, size) for size in cause.sizes])
        for cause in causes_of(dynamics, taken.phases)
    ]
    least = min(min(costs) for _, costs in coarse)
    found = [
        _refined(trial, cause, costs) for cause, costs in coarse if min(costs) <= REFINED * max(least, 1.0)
    ]
    best: dict[str, Named] = {}
    for one in sorted(found, key=lambda one: one.cost):
        best.setdefault(one.id, one)
    if SECOND in best:
        best[SECOND] = _reshaped(trial, dynamics, best[SECOND])
    return [nothing, *sorted(best.values(), key=lambda one: one.cost)]


def _reshaped(trial: Trial, own: Vo2Dynamics, one: Named) -> Named:
    """Return a second part of the heat with the share and the time constant that leave the least, near those found.

    A pattern search: the time constant is moved by a factor, with its share as it is or with the same product of both.
    """
    factor = SPREAD
    for _ in range(SHAPES):
        tried = [
            (tau_s, share)
            for tau_s in (one.shape / factor, one.shape * factor)
            for share in (one.size, one.size * one.shape / tau_s)
            if share <= MOST_SHARE
        ]
        tried += [(one.shape, one.size / factor), (one.shape, min(one.size * factor, MOST_SHARE))]
        for tau_s, share in tried:
            cause = second_part(own, tau_s)
            if (cost := cause.cost(trial, share)) < one.cost:
                one = Named(cause.id, cause.tells(share), share, cause.unit, cost, tau_s)
        factor = math.sqrt(factor)
    return one


def _refined(trial: Trial, cause: Cause, costs: list[float]) -> Named:
    """Return a cause with its best size, searched between the neighbours of the best of `costs` of its sizes."""
    sizes, k = cause.sizes, int(np.argmin(costs))
    low, high = sizes[max(k - 1, 0)], sizes[min(k + 1, len(sizes) - 1)]
    size, least = sizes[k], costs[k]
    for _ in range(REFINEMENTS):
        for trial_size in (high - GOLDEN * (high - low), low + GOLDEN * (high - low)):
            if (found := cause.cost(trial, trial_size)) < least:
                size, least = trial_size, found
        low, high = size - 0.5 * GOLDEN * (high - low), size + 0.5 * GOLDEN * (high - low)
    return Named(cause.id, cause.tells(size), size, cause.unit, least, cause.shape)


def _both(*sizes: float) -> tuple[float, ...]:
    return (*(-size for size in reversed(sizes)), *sizes)


def causes_of(own: Vo2Dynamics, phases: PurePhases) -> list[Cause]:
    """Return the causes that are tried; `phases`: what does not lag where the transition does."""
    balance, tau_s = own.balance, own.balance.time_constant_s

    def later(t: Trial, s: float) -> float:
        return t.cost(t.run(replace(own, delay_s=own.delay_s + max(s, 0.0))))

    def reading_late(t: Trial, s: float) -> float:
        return t.cost(t.run(replace(own, sensor_lag_s=own.sensor_lag_s + max(s, 0.0))))

    def domains(t: Trial, s: float) -> float:
        return t.cost(t.run(lagging(own, max(s, 0.0), phases)))

    def warming(t: Trial, s: float) -> float:
        return t.cost(t.run(own, heat=s * t.since_s))

    def stronger(t: Trial, s: float) -> float:
        return t.cost(t.run(own, levels=t.rows.levels * (1.0 + s * t.since_s)))

    def ageing(t: Trial, s: float) -> float:
        return t.cost(t.base, s * t.since_s)

    def losing(t: Trial, s: float) -> float:
        return t.cost(t.base, math.log(max(1.0 + s, 1e-9)) * t.after)

    def leaking(t: Trial, s: float) -> float:
        return t.cost(t.base, np.log(np.maximum(1.0 + s * t.rows.levels / np.exp(t.base[0]), 1e-9)) * t.after)

    times = tuple(tau_s * share for share in (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0))
    rates = _both(0.003, 0.01, 0.03, 0.06, 0.12, 0.3)
    found = [
        Cause("actuation.delay", "the current acts {ms:.2g} ms later", "s", times, later),
        Cause("sensor.lag", "the reading of the resistance lags by {ms:.2g} ms", "s", times, reading_late),
        Cause("hysteresis.rate_dependence", "the transition lags by {ms:.2g} ms", "s", times, domains),
        Cause("thermal.ambient_drift", "heat beside the current's grows by {own:.2g} mA^2/s", "mA^2/s", rates,
              warming),
        Cause("input.gain_drift", "the gain of the current drifts by {percent:.2g} %/s", "1/s",
              _both(0.0001, 0.0003, 0.001, 0.003), stronger),
        Cause("sensor.ageing", "the resistance that is read drifts by {percent:.2g} %/s", "1/s",
              _both(0.0005, 0.002, 0.005, 0.02), ageing),
        Cause("sensor.gain", "the sensor reads the resistance times {factor:.3g}", "",
              _both(0.005, 0.02, 0.05, 0.15, 0.4), losing),
        Cause("sensor.crosstalk", "the current leaks into the reading, {own:.2g} ohm/mA", "ohm/mA",
              _both(10.0, 40.0, 150.0, 500.0), leaking),
    ]  # fmt: skip
    if balance.share == 0.0:
        found += [second_part(own, times * tau_s) for times in SECOND_TIMES]
    return found


def second_part(own: Vo2Dynamics, tau_s: float) -> Cause:
    """Return the cause that a share of the heat follows with a second time constant [s]."""

    def cost(t: Trial, share: float) -> float:
        balance = own.balance._replace(share=share, second_time_constant_s=tau_s)
        return t.cost(t.run(replace(own, balance=balance)))

    return Cause(
        SECOND, f"{{percent:.2g}} % of the heat follows in {1e3 * tau_s:.2g} ms", "",
        (-0.2, -0.05, 0.05, 0.15, 0.3, 0.5), cost, tau_s,
    )  # fmt: skip
