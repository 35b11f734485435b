"""Extended GPI model: y = G(v) + sum_j p_j w_j, G = c3 + c2 v + c4 v^2, own envelopes a play (eqs. 12, 15).

The weights and G may have any sign, so y need not rise with v (thermal expansion against the transition).
State order: w (n,), the memories of the plays [-].

Zhang et al., IEEE/ASME Trans. Mechatronics 21(5), 2016, eqs. (12), (15) and Table II; c4 = 0 is the paper's
own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.envelopes import check_order, envelope
from rtctl.hysteresis.gpi import cooled_plays
from rtctl.hysteresis.play import play
from rtctl.hysteresis.tables import Table, inputs, model_of, own_array, own_floats, table_of


class EgpiParams(NamedTuple):
    """Parameters of the kernels: p, r and the envelopes tanh(a v + b), all (n,); G(v) = c3 + c2 v + c4 v^2."""

    p: FloatArray
    r: FloatArray
    a_R: FloatArray
    b_R: FloatArray
    a_L: FloatArray
    b_L: FloatArray
    c2: float
    c3: float
    c4: float


@kernel
def advance_plays(w: FloatArray, v: float, params: EgpiParams) -> None:
    """Move the memories w (n,) of plays with envelopes of their own to the input v, in place."""
    for j in range(w.size):
        lower = envelope(params.a_R[j], params.b_R[j], v) - params.r[j]
        upper = envelope(params.a_L[j], params.b_L[j], v) + params.r[j]
        w[j] = play(w[j], lower, upper)


@kernel
def egpi_step(w: FloatArray, v: float, params: EgpiParams) -> float:
    """Return y after the input v; advance w (n,) in place. A NaN input gives NaN and leaves w as it was."""
    if math.isnan(v):
        return math.nan
    advance_plays(w, v, params)
    y = params.c3 + v * (params.c2 + params.c4 * v)
    for j in range(w.size):
        y += params.p[j] * w[j]
    return y


@kernel
def egpi_run(w: FloatArray, v: FloatArray, params: EgpiParams) -> FloatArray:
    """Return y (samples,) for the inputs v (samples,); advance w in place."""
    y = np.empty_like(v)
    for k in range(v.size):
        y[k] = egpi_step(w, v[k], params)
    return y


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EgpiModel:
    """Weights p [y unit], radii r [-], envelopes a_R, a_L [1/v unit], b_R, b_L [-], each (n,).

    G: c3 [y unit], c2 [y/v], c4 [y/v^2]; identified on v_low to v_high. Raises ValueError where an envelope
    falls or order is not preserved.
    """

    p: FloatArray
    r: FloatArray
    a_R: FloatArray
    b_R: FloatArray
    a_L: FloatArray
    b_L: FloatArray
    c2: float
    c3: float
    v_low: float
    v_high: float
    c4: float = 0.0

    def __post_init__(self) -> None:
        own_floats(self, "c2", "c3", "c4", "v_low", "v_high")
        size = own_array(self, "r").size
        for name in ("p", "a_R", "b_R", "a_L", "b_L"):
            own_array(self, name, size)
        check_order((self.a_R, self.b_R), (self.a_L, self.b_L), self.r, (self.v_low, self.v_high))

    @property
    def params(self) -> EgpiParams:
        """Return the parameters of the kernels."""
        return EgpiParams(
            self.p, self.r, self.a_R, self.b_R, self.a_L, self.b_L, self.c2, self.c3, self.c4
        )  # fmt: skip

    def initial_state(self, v0: float) -> FloatArray:
        """Return w (n,) after a full cooling, then up to v0."""
        w = cooled_plays(self.r)
        egpi_step(w, float(v0), self.params)
        return w

    def simulate(self, v: FloatArray, state: FloatArray | None = None) -> FloatArray:
        """Return y (samples,) for v (samples,), from a copy of `state` or from a full cooling."""
        v = inputs(v)
        if not v.size:
            return v
        return egpi_run(self.initial_state(v[0]) if state is None else state.copy(), v, self.params)

    def to_table(self) -> Table:
        """Return plain floats and lists, with `kind = "egpi"`."""
        return table_of(self, "egpi")

    @classmethod
    def from_table(cls, table: Table) -> EgpiModel:
        """Return the model of a table. Raises InputError that names the key."""
        return model_of(cls, "egpi", table)
