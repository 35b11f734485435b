"""Analytic right inverse of a GPI model: v = gamma^-1(u), u = PI^-1(y - c) = sum_j p^_j z_j (eqs. 7-11, 14).

With P_k = p_0 + ... + p_k: p^_0 = 1/p_0, p^_k = -p_k / (P_k P_{k-1}) (eq. 11, whose minus the paper's
transcription lost), r^_j = p_0 r_j + sum_{0<k<j} p_k (r_j - r_k) (eq. 9); z_j is the classical play of y - c
with radius r^_j.

GPI(inv(y)) = y, but inv(GPI(v)) != v between the envelopes: there every v gives the same y, and the branch
is a guess. State order: z (n,) [y unit], then the last v, then the branch (+1 heating, -1 cooling).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.envelopes import envelope_inverse, envelope_slope
from rtctl.hysteresis.gpi import GpiModel
from rtctl.hysteresis.play import classical_plays
from rtctl.hysteresis.status import IN_GAP, NOT_FINITE, OK, OUT_OF_RANGE, SATURATED
from rtctl.hysteresis.tables import inputs


class GpiInverseParams(NamedTuple):
    """Coefficients p_hat [1/y unit], r_hat [y unit] (n,), the model's envelopes, bias and range, and three limits.

    y_limit [y unit]: |y - c| beyond which no input gives y; u_limit [-]: the |u| there, below 1; deadband
    [y unit].
    """

    p_hat: FloatArray
    r_hat: FloatArray
    a_R: float
    b_R: float
    a_L: float
    b_L: float
    c: float
    v_low: float
    v_high: float
    y_limit: float
    u_limit: float
    deadband: float


class InverseStep(NamedTuple):
    """Answer v [v unit]; gain = dv/du = 1 / (a (1 - u^2)) [v unit]; status bits of `EstimateStatus`.

    |dv/dy| <= gain / p_0 where all weights are >= 0: times the noise of y, it is the error of v on a branch.
    """

    v: float
    gain: float
    status: int


@kernel
def gpi_inverse_step(state: FloatArray, y: float, params: GpiInverseParams) -> InverseStep:
    """Return the v that gives y, and how far to trust it; advance `state` (n + 2,) in place.

    On the branch it stays, y may move on at once; a reversal counts only when it exceeds the deadband (0:
    the paper's own rule), else v is held and flagged IN_GAP. A y beyond y_limit is clamped there before the
    plays see it (their memory would wind up) and flagged SATURATED. v is not clipped to the range, only
    flagged. A y that is not finite holds everything.
    """
    n = params.p_hat.size
    status = OK
    branch = state[n + 1]
    if not math.isfinite(y):
        status, moves = NOT_FINITE, 0.0
    else:
        offset = y - params.c
        if abs(offset) >= params.y_limit:
            status |= SATURATED
            offset = math.copysign(params.y_limit, offset)
        moves = _movement(offset - state[0], branch, params.deadband)
        if moves == 0.0:
            status |= IN_GAP
        else:
            classical_plays(state[:n], offset, params.r_hat)
            branch = moves
    u = _classical_inverse(state, params)
    if branch > 0.0:
        a, b = params.a_R, params.b_R
    else:
        a, b = params.a_L, params.b_L
    v = envelope_inverse(a, b, u) if moves != 0.0 else state[n]
    state[n], state[n + 1] = v, branch
    if v < params.v_low or v > params.v_high:
        status |= OUT_OF_RANGE
    return InverseStep(v, 1.0 / envelope_slope(a, u), status)


@kernel
def _movement(change: float, branch: float, deadband: float) -> float:
    """Return +1 for rising, -1 for falling, 0 for held.

    Along the branch any change moves, against it one beyond the deadband. `change` is counted from the furthest y of
    the
    branch, which z_0 holds: a play of y, not a threshold a step.
    """
    along = change * branch
    if along > 0.0:
        return branch
    if along < -deadband:
        return -branch
    return 0.0


@kernel
def _classical_inverse(state: FloatArray, params: GpiInverseParams) -> float:
    """Return u = sum_j p^_j z_j (eq. 8), within +-u_limit against rounding."""
    u = 0.0
    for j in range(params.p_hat.size):
        u += params.p_hat[j] * state[j]
    return min(max(u, -params.u_limit), params.u_limit)


@kernel
def gpi_inverse_run(
    state: FloatArray, y: FloatArray, params: GpiInverseParams
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return v, gain and status, each (samples,), for the outputs y (samples,); advance `state` in place."""
    v, gain, status = np.empty_like(y), np.empty_like(y), np.zeros(y.size, np.int64)
    for k in range(y.size):
        step = gpi_inverse_step(state, y[k], params)
        v[k], gain[k], status[k] = step.v, step.gain, step.status
    return v, gain, status


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GpiInverse:
    """Right inverse of `model`. Build it with `GpiInverse.of(model)`."""

    model: GpiModel
    params: GpiInverseParams

    @classmethod
    def of(cls, model: GpiModel, *, deadband: float = 0.0, u_limit: float = 1.0 - 1e-6) -> GpiInverse:
        """Build the inverse of a model.

        Args:
            model: GPI model.
            deadband: Change of y [y unit] as in `gpi_inverse_step`, never below rounding.
            u_limit: Clamp of the argument of arctanh [-].

        Raises:
            ValueError: Not r_0 = 0 <= r_1 <= ... < u_limit < 1, p_0 > 0 and every P_k > 0.
        """
        p, r, partial = model.p, model.r, np.cumsum(model.p)
        if not deadband >= 0.0:
            raise ValueError(f"deadband must be >= 0 in the unit of y, got {deadband:g}")
        if r[0] != 0.0 or (np.diff(r) < 0.0).any() or not r[-1] < u_limit < 1.0:
            raise ValueError(f"radii must rise from 0 to below u_limit = {u_limit:g} < 1, got {r.tolist()}")
        if not (partial > 0.0).all():
            raise ValueError(f"every partial sum of the weights must be > 0, got {partial.tolist()}")
        p_hat = np.concatenate(([1.0 / p[0]], -p[1:] / (partial[1:] * partial[:-1])))
        r_hat = np.concatenate(([0.0], np.cumsum(partial[:-1] * np.diff(r))))  # eq. 9 by its differences
        y_limit = float(p @ (u_limit - r))
        rounding = 16.0 * np.finfo(np.float64).eps * (y_limit + abs(model.c))
        params = GpiInverseParams(
            p_hat, r_hat, model.a_R, model.b_R, model.a_L, model.b_L, model.c, model.v_low, model.v_high,
            y_limit, float(u_limit), max(float(deadband), float(rounding)),
        )  # fmt: skip
        return cls(model=model, params=params)

    def state_at(self, w: FloatArray, v: float, *, rising: bool = True) -> FloatArray:
        """Return the state (n + 2,) that belongs to the model's plays w (n,) at the input v, last moved up or down.

        z_i = (sum_{j<=i} p_j) w_i + sum_{j>i} p_j w_j; started at zero instead, the error stays until a
        large sweep.
        """
        p = self.model.p
        partial = np.cumsum(p)
        beyond = (p @ w) - np.cumsum(p * w)
        return np.concatenate((partial * w + beyond, [float(v), 1.0 if rising else -1.0]))

    def initial_state(self, v0: float) -> FloatArray:
        """Return the state (n + 2,) after a full cooling, then up to v0."""
        return self.state_at(self.model.initial_state(v0), v0)

    def estimate(
        self, y: FloatArray, state: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return v, gain, status (samples,) for y (samples,), from a copy of `state` or from a full cooling."""
        start = self.initial_state(self.model.v_low) if state is None else state.copy()
        return gpi_inverse_run(start, inputs(y), self.params)
