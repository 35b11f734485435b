"""Gap-free model: plays plus a reversible term, y = F(v) = c + q1 v + q2 v^2 + sum_j p_j w_j, p_j >= 0.

An EGPI (eq. 12) held strictly increasing: after a reversal y moves along the reversible term instead of
standing still, so each y belongs to one v and the inverse has no gap to guess in, at the price of an
iteration. State order: w (n,), the memories of the plays [-], then the last v; forward and inverse share it
and hand it over as it is.

Newton on the current branch inside a bracket: rising, F(v) = c + q(v) + sum_j p_j max(w_j, gamma_R(v) - r_j).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.egpi import EgpiParams, advance_plays, egpi_step
from rtctl.hysteresis.envelopes import check_order, envelope, envelope_slope
from rtctl.hysteresis.gpi import cooled_plays
from rtctl.hysteresis.status import NOT_FINITE, OK, OUT_OF_RANGE, SATURATED, BranchPoint
from rtctl.hysteresis.tables import Table, inputs, model_of, own_array, own_floats, table_of

_MAX_ITERATIONS = 80  # bisection alone halves any range of doubles in fewer


class GapFreeParams(NamedTuple):
    """The plays and c3 = c, c2 = q1, c4 = q2 as in an EGPI; the range; changes that count as none."""

    egpi: EgpiParams
    v_low: float
    v_high: float
    v_tolerance: float
    y_tolerance: float


@kernel
def gap_free_step(state: FloatArray, v: float, params: GapFreeParams) -> float:
    """Return y after the input v; advance `state` (n + 1,) in place. A NaN input gives NaN and moves nothing."""
    y = egpi_step(state[:-1], v, params.egpi)
    if not math.isnan(v):
        state[-1] = v
    return y


@kernel
def gap_free_run(state: FloatArray, v: FloatArray, params: GapFreeParams) -> FloatArray:
    """Return y (samples,) for the inputs v (samples,); advance `state` in place."""
    y = np.empty_like(v)
    for k in range(v.size):
        y[k] = gap_free_step(state, v[k], params)
    return y


@kernel
def branch_value(
    w: FloatArray, v: float, rising: bool, params: EgpiParams, keep: bool
) -> tuple[float, float]:
    """Return F and dF/dv at v, reached from the memories w (n,) in one direction; `keep` moves w there, in place."""
    y = params.c3 + v * (params.c2 + params.c4 * v)
    slope = params.c2 + 2.0 * params.c4 * v
    for j in range(w.size):
        a = params.a_R[j] if rising else params.a_L[j]
        gamma = envelope(a, params.b_R[j] if rising else params.b_L[j], v)
        edge = gamma - params.r[j] if rising else gamma + params.r[j]
        memory = w[j]
        if (edge >= memory) if rising else (edge <= memory):
            memory = edge
            slope += params.p[j] * envelope_slope(a, gamma)
        if keep:
            w[j] = memory
        y += params.p[j] * memory
    return y, slope


@kernel
def gap_free_inverse_step(state: FloatArray, y: float, params: GapFreeParams) -> BranchPoint:
    """Return the one v with F(v) = y from `state` (n + 1,), which is advanced to it in place.

    A y that no v of the range gives is answered with the end of the range, flagged SATURATED and
    OUT_OF_RANGE; one that is not finite holds v.
    """
    w, v = state[:-1], state[-1]
    egpi = params.egpi
    now = egpi.c3 + v * (egpi.c2 + egpi.c4 * v)
    for j in range(w.size):
        now += egpi.p[j] * w[j]
    finite = math.isfinite(y)
    if not finite or abs(y - now) <= params.y_tolerance:
        # at rest: the direction of the last movement is the one whose edges hold plays
        _, up = branch_value(w, v, True, egpi, False)
        _, down = branch_value(w, v, False, egpi, False)
        return BranchPoint(v, max(up, down), OK if finite else NOT_FINITE)
    rising = y > now
    end = max(v, params.v_high) if rising else min(v, params.v_low)
    v, inside = _solve(w, y, v, end, rising, params)
    state[-1] = v
    _, slope = branch_value(w, v, rising, egpi, True)
    return BranchPoint(v, slope, OK if inside else SATURATED | OUT_OF_RANGE)


@kernel
def _solve(
    w: FloatArray, y: float, near: float, end: float, rising: bool, params: GapFreeParams
) -> tuple[float, bool]:
    """Find v from `near` to `end` with F(v) = y, to the tolerance; False where y lies beyond the end.

    Newton's method, replaced by bisection when it leaves the bracket or does not halve the residual; the far
    end is evaluated only when Newton asks for more.
    """
    far, bounded = end, False
    v, last_error = near, math.inf
    for _ in range(_MAX_ITERATIONS):
        value, slope = branch_value(w, v, rising, params.egpi, False)
        error = y - value
        if (error > 0.0) == rising:
            if v == end:
                return v, abs(error) <= params.y_tolerance
            near = v
        else:
            far, bounded = v, True
        step = error / slope
        if abs(step) <= params.v_tolerance or (bounded and abs(far - near) <= params.v_tolerance):
            return min(max(v + step, min(near, far)), max(near, far)), True
        leaves = (v + step - near) * (v + step - far) >= 0.0
        if leaves and not bounded:
            v = far
        elif leaves or abs(error) > 0.5 * last_error:
            v = 0.5 * (near + far)
        else:
            v += step
        last_error = abs(error)
    return v, True


@kernel
def gap_free_inverse_run(
    state: FloatArray, y: FloatArray, params: GapFreeParams
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return v, slope and status, each (samples,), for the outputs y (samples,); advance `state` in place."""
    v, slope, status = np.empty_like(y), np.empty_like(y), np.zeros(y.size, np.int64)
    for k in range(y.size):
        point = gap_free_inverse_step(state, y[k], params)
        v[k], slope[k], status[k] = point.v, point.slope, point.status
    return v, slope, status


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GapFreeModel:
    """Weights p >= 0 [y unit], radii r [-], envelopes a_R, a_L [1/v unit], b_R, b_L [-], each (n,).

    Equal entries are common envelopes. c [y unit]; q1 [y/v] and q2 [y/v^2], both >= 0, with q1 + 2 q2 v > 0
    on v_low to v_high. Raises ValueError where y would not rise or order is not preserved.
    """

    p: FloatArray
    r: FloatArray
    a_R: FloatArray
    b_R: FloatArray
    a_L: FloatArray
    b_L: FloatArray
    q1: float
    c: float
    v_low: float
    v_high: float
    q2: float = 0.0

    def __post_init__(self) -> None:
        own_floats(self, "q1", "q2", "c", "v_low", "v_high")
        size = own_array(self, "r").size
        for name in ("p", "a_R", "b_R", "a_L", "b_L"):
            own_array(self, name, size)
        check_order((self.a_R, self.b_R), (self.a_L, self.b_L), self.r, (self.v_low, self.v_high))
        if (self.p < 0.0).any():
            raise ValueError(f"weights p must be >= 0 for a rising output, got {self.p.min():g}")
        least = self.q1 + 2.0 * self.q2 * self.v_low
        if self.q1 < 0.0 or self.q2 < 0.0 or not least > 0.0:
            raise ValueError(
                f"q1 = {self.q1:g}, q2 = {self.q2:g} must be >= 0 with a slope > 0, got {least:g} at v_low"
            )

    @property
    def params(self) -> GapFreeParams:
        """Return the parameters of the kernels."""
        egpi = EgpiParams(
            self.p, self.r, self.a_R, self.b_R, self.a_L, self.b_L, self.q1, self.c, self.q2
        )  # fmt: skip
        span = self.v_high - self.v_low
        rise = span * (self.q1 + self.q2 * (self.v_high + self.v_low)) + 2.0 * float(self.p.sum())
        return GapFreeParams(egpi, self.v_low, self.v_high, 1e-12 * span, 4e-12 * rise)

    def initial_state(self, v0: float) -> FloatArray:
        """Return w and v (n + 1,) after a full cooling, then up to v0."""
        w = cooled_plays(self.r)
        advance_plays(w, float(v0), self.params.egpi)
        return np.append(w, float(v0))

    def simulate(self, v: FloatArray, state: FloatArray | None = None) -> FloatArray:
        """Return y (samples,) for v (samples,), from a copy of `state` or from a full cooling."""
        v = inputs(v)
        if not v.size:
            return v
        return gap_free_run(self.initial_state(v[0]) if state is None else state.copy(), v, self.params)

    def invert(
        self, y: FloatArray, state: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return v, slope, status (samples,) for y (samples,), from a copy of `state` or from a full cooling."""
        start = self.initial_state(self.v_low) if state is None else state.copy()
        return gap_free_inverse_run(start, inputs(y), self.params)

    def to_table(self) -> Table:
        """Return plain floats and lists, with `kind = "gap_free"`."""
        return table_of(self, "gap_free")

    @classmethod
    def from_table(cls, table: Table) -> GapFreeModel:
        """Return the model of a table. Raises InputError that names the key."""
        return model_of(cls, "gap_free", table)
