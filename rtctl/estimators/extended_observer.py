"""The thermal observer of an extended model: the same filter around a richer prediction.

Heat b and model error m are estimated as in `rtctl.estimators.observer`, whose equations apply; what predicts the
reading is `thermal_path`, once at b and once `PROBE_MA2` hotter. Of a sensor that lags, the model's error m would be
seen for as long as the lag remembers it, which the filter would take for heat: so the lag is taken back, from the
reading and from both predictions alike, R_k = (Y_k - a Y_(k-1)) / (1 - a), a = exp(-h / tau_r), at the price of its
noise, whose variance grows by (1 + a^2) / (1 - a)^2 (Y / R)^2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rtctl.arithmetic.elementary import exp, log
from rtctl.arithmetic.standard_error import combined
from rtctl.border.arrays import FloatArray
from rtctl.estimators.drive import Drive, DriveParams, arrival, heating_current, later, send
from rtctl.estimators.observer import (
    DISAGREEMENT,
    DISAGREES,
    NOT_FINITE,
    OUT_OF_RANGE,
    PROBE_MA2,
    ObserverParams,
    believed,
    condition_on,
    filter_start,
    observer_params,
    propagate,
)
from rtctl.estimators.thermal_path import (
    BENT,
    READ,
    SWING,
    WARM,
    PathParams,
    ThermalPath,
    path_params,
    path_step,
    settle_path,
    surrogate_at,
)
from rtctl.hysteresis.film_memory import FilmMemory
from rtctl.hysteresis.preisach.model import PreisachParams, preisach_slope
from rtctl.interfaces import Estimate
from rtctl.models.vo2 import SURROGATE, Vo2Model
from rtctl.simulations.vo2.heat import surrogate_power
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics


class SwingingEstimate(Estimate):
    """An estimate that the loop records as any other one; it knows by how much the beam swings just then."""

    swing: float
    """Part of `value` by which the beam is beyond where it settles [um]."""

    @property
    def settled(self) -> float:
        """The deflection without the swing [um], which heat cannot damp."""
        return self.value - self.swing


class Errors(NamedTuple):
    """Errors of the identified model."""

    deflection: float
    """Standard deviation of the deflection on its data [um]."""


class ExtendedConstants(NamedTuple):
    """Parameters of `extended_observer_step`."""

    errors: Errors
    observer: ObserverParams
    path: PathParams
    drive: DriveParams
    resistance: PreisachParams
    deflection: PreisachParams


@dataclass(slots=True)
class ExtendedMemory:
    """Memory of `extended_observer_step`."""

    filter: FloatArray
    """(7,) as in `rtctl.estimators.observer`; its first two entries are not used."""
    path: FloatArray
    """State of `thermal_path`, with the stacks of -ln R and of deflection beside it."""
    film: FloatArray
    beam: FloatArray
    probe: FloatArray
    """The same a little hotter."""
    probe_film: FloatArray
    probe_beam: FloatArray
    drive: FloatArray
    """Memory of `rtctl.estimators.drive`."""
    before: FloatArray
    """(3,) reading, prediction and hotter prediction of the sample before [ohm]; NaN: there is none."""
    clock: FloatArray
    """(2,) time since the start and its rounding, see `later` [s]."""
    swing: float
    """How far the beam is beyond where it settles [um]."""


# 8 parameters because the translated language has no tuples that are indexed
def correct(  # noqa: PLR0913
    x: FloatArray, before: FloatArray, ohm: float, expected_ohm: float, probed_ohm: float, elapsed_s: float,
    lag_s: float, p: ObserverParams,
) -> int:  # fmt: skip
    """Condition the filter on a reading, in place; return status bits.

    Args:
        x: the filter's state (7,).
        before: reading and both predictions of the sample before (3,) [ohm], replaced in place.
        ohm: the reading [ohm].
        expected_ohm: what the path predicts [ohm].
        probed_ohm: what the hotter one predicts [ohm].
        elapsed_s: time since the sample before [s].
        lag_s: time constant of the sensor [s]; 0: none.
        p: parameters of the filter.
    """
    if not 0.0 < ohm < math.inf:
        before[0] = math.nan
        return NOT_FINITE
    film, expected, probed, noise = ohm, expected_ohm, probed_ohm, p.reading_variance
    is_first = math.isnan(before[0]) or elapsed_s <= 0.0
    if lag_s > 0.0 and not is_first:
        kept = exp(-elapsed_s / lag_s)
        gone = 1.0 - kept
        film = (ohm - kept * before[0]) / gone
        expected = (expected_ohm - kept * before[1]) / gone
        probed = (probed_ohm - kept * before[2]) / gone
    before[0], before[1], before[2] = ohm, expected_ohm, probed_ohm
    if lag_s > 0.0 and is_first:
        return 0
    if not (film > 0.0 and expected > 0.0 and probed > 0.0):
        return 0  # noise of the lag's inversion carries no information
    if lag_s > 0.0:
        kept = exp(-elapsed_s / lag_s)
        grown = ohm / expected / (1.0 - kept)
        noise *= (1.0 + kept * kept) * grown * grown
    sensitivity = log(expected / probed) / PROBE_MA2
    withheld = x[2] - believed(x[2], p.heat_faked)
    innovation = log(expected / film) - sensitivity * withheld - x[3]
    far = condition_on(x, innovation, sensitivity, noise)
    return DISAGREES if far > DISAGREEMENT else 0


def extended_observer_step(
    s: Any, c: Any, level: float, sensed: float, elapsed_s: float
) -> tuple[float, float, float, int]:
    """Return deflection [um], surrogate [mA], standard error [um] and status bits; advance `ExtendedMemory` in place.

    Args:
        s: the memory.
        c: fields of `ExtendedConstants`.
        level: the command that was held [mA].
        sensed: the reading [ohm].
        elapsed_s: time since the sample before [s].
    """
    before = surrogate_at(s.path[WARM], c.path.balance)
    heat = believed(s.filter[2], c.observer.heat_faked)
    current = heating_current(s.drive, level, c.drive)
    if elapsed_s > 0.0:
        send(s.drive, current, elapsed_s)
    left_s = elapsed_s
    while left_s > c.drive.shortest_s:
        held, lasts_s = arrival(s.drive, left_s, c.drive.shortest_s)
        path_step(s.path, s.film, s.beam, held, heat, s.clock[0], lasts_s, c.path, c.resistance, c.deflection)
        path_step(
            s.probe, s.probe_film, s.probe_beam, held, heat + PROBE_MA2, s.clock[0], lasts_s, c.path, c.resistance,
            c.deflection,
        )  # fmt: skip
        later(s.clock, lasts_s)
        left_s -= lasts_s
    v = surrogate_at(s.path[WARM], c.path.balance)
    propagate(s.filter, abs(v - before), elapsed_s, c.observer)
    status = OUT_OF_RANGE if v < c.observer.low or v > c.observer.high else 0
    status |= correct(
        s.filter, s.before, sensed, s.path[READ], s.probe[READ], elapsed_s, c.path.sensor_lag_s, c.observer
    )
    slope = preisach_slope(s.beam, c.deflection)
    heating = max(v - c.path.balance.zone, 1e-9)
    error = abs(slope) * math.sqrt(max(s.filter[4], 0.0)) / (2.0 * heating)
    s.swing = c.path.participation * (s.path[SWING] - s.path[BENT])
    return s.path[BENT] + s.swing, v, combined(error, c.errors.deflection), status


class ExtendedObserver:
    """The thermal observer of a model with mechanisms."""

    surrogate = SURROGATE

    def __init__(self, model: Vo2Model, dynamics: Vo2Dynamics) -> None:
        self._drive, self.delay_s = Drive(dynamics), float(dynamics.delay_s)
        params = path_params(model, dynamics)
        self._path, self._probe = ThermalPath(model, params), ThermalPath(model, params)
        self.constants = ExtendedConstants(
            Errors(float(model.deflection_error)), observer_params(model), params, self._drive.params,
            model.resistance_preisach.params, model.deflection_preisach.params,
        )  # fmt: skip
        self.memory = self.at_rest(model.current.low)

    def at_rest(self, level: float) -> ExtendedMemory:
        """Return the memory at rest at an applied current [mA], from a full cooling."""
        path, probe = self._path, self._probe
        current = self._drive.start(level)
        path.start(current)
        probe.start(path.current_of(path.power_of(current) + PROBE_MA2))
        return ExtendedMemory(
            filter_start(self.constants.observer), path.x, path.film, path.beam, probe.x, probe.film, probe.beam,
            self._drive.memory, np.full(3, math.nan), np.zeros(2), 0.0,
        )  # fmt: skip

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """Start at rest at the applied current, from a full cooling; see `Estimator`."""
        self.memory = self.at_rest(float(levels[0]))
        return self.step(levels, sensed, 0.0)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """Return the estimate of one sample."""
        self._drive.make_room()
        self.memory.drive = self._drive.memory
        found = extended_observer_step(
            self.memory, self.constants, float(levels[0]), float(sensed[0]), elapsed_s
        )
        value, surrogate, error, status = found
        made = SwingingEstimate(float(value), float(surrogate), float(error), status)
        made.swing = float(self.memory.swing)
        return made

    def film_memory(self) -> FilmMemory:
        """See `Remembering`."""
        own, balance = self.memory, self.constants.path.balance
        power, hotter = (surrogate_power(float(x[WARM]), balance) for x in (own.path, own.probe))
        stacks = (one.copy() for one in (own.film, own.beam, own.probe_film, own.probe_beam))
        film, beam, hotter_film, hotter_beam = stacks
        return FilmMemory(power, film, beam, hotter, hotter_film, hotter_beam, own.filter[2:].copy())

    def inherit(self, memory: FilmMemory) -> None:
        """See `Inheriting`; what a sensor that lags has not read yet is forgotten."""
        own, constants = self.memory, self.constants
        own.filter[:] = filter_start(constants.observer)  # its own has followed a device that was another one
        own.filter[2 : 2 + memory.filter.size] = memory.filter
        warm = (own.path, own.film, own.beam, memory.power, memory.film, memory.beam)
        hotter = (
            own.probe,
            own.probe_film,
            own.probe_beam,
            memory.hotter,
            memory.hotter_film,
            memory.hotter_beam,
        )
        for x, film, beam, power, new_film, new_beam in (warm, hotter):
            film[:], beam[:] = new_film, new_beam
            settle_path(x, film, beam, power, constants.path, constants.resistance, constants.deflection)
        own.before[:] = math.nan

    def drift_from_now(self) -> None:
        """See `Drifting`."""
        self.memory.clock[:] = 0.0
