"""Generalised Prandtl-Ishlinskii model: y = c + sum_j p_j w_j, plays w_j between common envelopes (eqs. 3-6).

It factorises as GPI = PI o F_0: one generalised play of radius zero, u = F_0[v], then classical plays of u
with the radii r_j. State order: w (n,), the memories of the plays [-].

Zhang et al., IEEE/ASME Trans. Mechatronics 21(5), 2016, eqs. (3)-(6), (16), (17).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.envelopes import check_order, envelope
from rtctl.hysteresis.play import play
from rtctl.hysteresis.tables import Table, inputs, model_of, own_array, own_floats, table_of


class GpiParams(NamedTuple):
    """Parameters of the kernels in the symbols of eq. 6: p, r (n,); envelopes tanh(a v + b); bias c."""

    p: FloatArray
    r: FloatArray
    a_R: float
    b_R: float
    a_L: float
    b_L: float
    c: float


@kernel
def gpi_step(w: FloatArray, v: float, params: GpiParams) -> float:
    """Return y after the input v; advance w (n,) in place: an allocation a step would cost more than the step.

    A NaN input gives NaN and leaves w as it was.
    """
    if math.isnan(v):
        return math.nan
    lower = envelope(params.a_R, params.b_R, v)
    upper = envelope(params.a_L, params.b_L, v)
    y = params.c
    for j in range(w.size):
        w[j] = play(w[j], lower - params.r[j], upper + params.r[j])
        y += params.p[j] * w[j]
    return y


@kernel
def gpi_run(w: FloatArray, v: FloatArray, params: GpiParams) -> FloatArray:
    """Return y (samples,) for the inputs v (samples,); advance w in place."""
    y = np.empty_like(v)
    for k in range(v.size):
        y[k] = gpi_step(w, v[k], params)
    return y


def cooled_plays(r: FloatArray) -> FloatArray:
    """Return memories (n,) after a full heating and cooling, where tanh is -1: r - 1 (0 where r >= 1: at rest)."""
    return np.minimum(r - 1.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GpiModel:
    """Common envelopes, weights p [y unit] and radii r [-], both (n,), bias c [y unit].

    Envelopes a_R, a_L [1/v unit], b_R, b_L [-]; identified on v_low to v_high. Raises ValueError where an
    envelope falls or order is not preserved.
    """

    p: FloatArray
    r: FloatArray
    a_R: float
    b_R: float
    a_L: float
    b_L: float
    c: float
    v_low: float
    v_high: float

    def __post_init__(self) -> None:
        own_floats(self, "a_R", "b_R", "a_L", "b_L", "c", "v_low", "v_high")
        own_array(self, "p", own_array(self, "r").size)
        check_order((self.a_R, self.b_R), (self.a_L, self.b_L), self.r, (self.v_low, self.v_high))

    @property
    def params(self) -> GpiParams:
        """Return the parameters of the kernels."""
        return GpiParams(self.p, self.r, self.a_R, self.b_R, self.a_L, self.b_L, self.c)

    def initial_state(self, v0: float) -> FloatArray:
        """Return w (n,) after a full cooling, then up to v0."""
        w = cooled_plays(self.r)
        gpi_step(w, float(v0), self.params)
        return w

    def simulate(self, v: FloatArray, state: FloatArray | None = None) -> FloatArray:
        """Return y (samples,) for v (samples,), from a copy of `state` or from a full cooling."""
        v = inputs(v)
        if not v.size:
            return v
        return gpi_run(self.initial_state(v[0]) if state is None else state.copy(), v, self.params)

    def to_table(self) -> Table:
        """Return plain floats and lists, with `kind = "gpi"`."""
        return table_of(self, "gpi")

    @classmethod
    def from_table(cls, table: Table) -> GpiModel:
        """Return the model of a table. Raises InputError that names the key."""
        return model_of(cls, "gpi", table)
