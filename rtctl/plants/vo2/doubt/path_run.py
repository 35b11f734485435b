"""A VO2 model on recorded commands, row by row, uncorrected by any reading (`rtctl.estimators.thermal_path`)."""

from __future__ import annotations

import math

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.estimators.drive import Drive
from rtctl.estimators.observer import PROBE_MA2
from rtctl.estimators.thermal_path import (
    BENT,
    READ,
    STATES,
    SWING,
    WARM,
    PathParams,
    path_params,
    path_start,
    path_step,
)
from rtctl.hysteresis.film_memory import FilmMemory
from rtctl.hysteresis.preisach.model import PreisachParams, cooled_stack, preisach_step
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.heat import surrogate_power
from rtctl.simulations.vo2.loop_dynamics import Vo2Dynamics


# 11 parameters because a kernel takes its arrays one by one
@kernel
def march(  # noqa: PLR0913
    x: FloatArray, film: FloatArray, beam: FloatArray, pieces: FloatArray, time_s: float, p: PathParams,
    r: PreisachParams, d: PreisachParams, log_read: FloatArray, bent: FloatArray, warm: FloatArray,
) -> float:  # fmt: skip
    """Run one copy over held currents; return its time [s].

    Args:
        x: state of `thermal_path`, advanced in place, as are both stacks.
        film: relays of the resistance model.
        beam: relays of the deflection model.
        pieces: row, heating current [mA], duration [s], heat beside it [mA^2] of each held current (m, 4).
        time_s: time at the start [s].
        p: parameters.
        r: parameters of the resistance model.
        d: parameters of the deflection model.
        log_read: ln of the resistance at the end of each row (n,) is put here.
        bent: deflections (n,) [um].
        warm: temperatures (n,) [mA^2].
    """
    for k in range(len(pieces)):
        row = int(pieces[k, 0])
        if pieces[k, 2] > 0.0:
            path_step(x, film, beam, pieces[k, 1], pieces[k, 3], time_s, pieces[k, 2], p, r, d)
            time_s += pieces[k, 2]
        log_read[row] = math.log(max(x[READ], 1e-300))
        bent[row] = x[BENT] + p.participation * (x[SWING] - x[BENT])
        warm[row] = x[WARM]
    return time_s


class PathRun:
    """A copy with its state."""

    def __init__(self, model: Vo2Model, dynamics: Vo2Dynamics) -> None:
        self._params = path_params(model, dynamics)
        self._r, self._d = model.resistance_preisach.params, model.deflection_preisach.params
        self._drive = Drive(dynamics)

    def start(self, level: float) -> None:
        """Start at rest at a commanded level [mA], from a full cooling."""
        self._x = np.zeros(STATES)
        self._film, self._beam = cooled_stack(self._r.grid), cooled_stack(self._d.grid)
        self._time_s = 0.0
        current = self._drive.start(level)
        path_start(self._x, self._film, self._beam, current, self._params, self._r, self._d)

    def run(self, levels: FloatArray, elapsed_s: FloatArray, heat: FloatArray) -> FloatArray:
        """Return ln R, deflection [um] and temperature [mA^2] of each row (3, n)."""
        given = (np.ascontiguousarray(one, dtype=np.float64) for one in (levels, elapsed_s, heat))
        pieces = self._drive.all_pieces(*given)
        found = np.empty((3, len(levels)))
        self._time_s = march(
            self._x, self._film, self._beam, pieces, self._time_s,
            self._params, self._r, self._d, found[0], found[1], found[2],
        )  # fmt: skip
        return found

    def film_memory(self) -> FilmMemory:
        """Return what the film has been through, and of one a little hotter that it was just made so."""
        power = surrogate_power(float(self._x[WARM]), self._params.balance)
        hotter = power + PROBE_MA2
        hotter_film, hotter_beam = self._film.copy(), self._beam.copy()
        preisach_step(hotter_film, math.sqrt(hotter), self._r)
        preisach_step(hotter_beam, math.sqrt(hotter), self._d)
        return FilmMemory(
            power, self._film.copy(), self._beam.copy(), hotter, hotter_film, hotter_beam, np.empty(0)
        )
