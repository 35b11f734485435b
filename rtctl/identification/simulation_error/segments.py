"""The cost of a fit: free runs over segments of records, each from its own state, joined where they follow each other.

A segment that is a whole record makes it an output-error fit. Shorter ones make it multiple shooting: the reading at
a segment's end minus that at the next one's start, over `gap` (continued outputs,), is one more residual.

Reference: H. Bock, Recent advances in parameter identification techniques for ODE (1983).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from typing import NamedTuple, TypeVar

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.least_squares.arrowhead_solver import NormalEquations, make_zero_equations
from rtctl.identification.least_squares.levenberg_marquardt import Unknowns
from rtctl.identification.simulation_error.sensitivity import Linearisation, Sensitivity
from rtctl.identification.threads import each

T = TypeVar("T")
DIFFERENCE_STEP = 0.1
"""Fraction of a step at which the second derivative is evaluated."""
PRIOR_WEIGHT = 0.03
"""Weight of the prior of a start state, in readings of its size.

What the scored samples still show of the state outweighs it by far; a state that they have forgotten would drift
without it.
"""
MIN_THREADED_SAMPLES = 4000
"""Samples of a segment below which threads do not pay: the time is spent in the interpreter, where they wait."""


class Segment(NamedTuple):
    """A part of a record. One that is joined ends with the first sample of the next segment."""

    record: FitRecord
    start: FloatArray
    """State (states,) at its first sample; where it is free, the fit starts here."""
    joined: bool
    """Whether the next segment continues where this one ends."""
    prior: FloatArray | None = None
    """Expected state (states,) of a record whose first samples are not scored; None without one."""


class SegmentTerms(NamedTuple):
    """The terms of one segment in the normal equations, and its two ends for the continuity."""

    cost: float
    shared: FloatArray
    gradient: FloatArray
    border: FloatArray
    local: FloatArray
    local_gradient: FloatArray
    square: FloatArray
    """Sums of squared residuals (outputs,) in squared units."""
    begin: FloatArray
    """The reading at the start and its derivatives (1 + p + q, continued outputs)."""
    end: FloatArray
    """The reading at the end and its derivatives (1 + p + q, continued outputs)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentCost:
    """Cost of segments with residuals in multiples of `sigma` (outputs,)."""

    sensitivity: Sensitivity
    segments: Sequence[Segment]
    sigma: FloatArray
    executor: Executor | None = None
    steps_per_period: float | None = None
    gap: FloatArray | None = None
    """Scale of the continuity residual (continued outputs,) in units; None where nothing is joined."""
    cache_size: int = 0
    """Number of recent points whose derivatives are kept for `compute_second_derivative`."""
    cache: list[tuple[Unknowns, list[Linearisation | None]]] = field(
        default_factory=list, init=False, repr=False
    )

    def with_changes(self, **changes: object) -> SegmentCost:
        """Return the same cost with other weights or steps."""
        return replace(self, **changes)  # type: ignore[arg-type]

    def start(self, shared: FloatArray) -> Unknowns:
        """Return unknowns with the segments' own initial states."""
        scale = self.sensitivity.state_scale
        own = np.array([segment.start[: len(scale)] / scale for segment in self.segments])
        return Unknowns(shared, own.reshape(len(self.segments), len(scale)))

    def state(self, index: int, unknowns: Unknowns) -> FloatArray:
        """Return the initial state of a segment in units."""
        scale = self.sensitivity.state_scale
        return unknowns.local[index] * scale if len(scale) else self.segments[index].start

    def linearise(self, index: int, unknowns: Unknowns) -> Linearisation | None:
        """Return one segment's free run and its derivatives; None where it diverges."""
        return self.sensitivity.linearise(
            self.segments[index].record, unknowns.shared, self.state(index, unknowns), self.steps_per_period
        )

    def compute_terms(self, unknowns: Unknowns) -> list[SegmentTerms] | None:
        """Compute the terms of all segments, in parallel where there are threads; None where one diverges."""

        def one(index: int) -> tuple[Linearisation | None, SegmentTerms | None]:
            found = self.linearise(index, unknowns)
            piece = None if found is None else self._piece(found, self.segments[index].joined)
            if piece is not None and len(unknowns.local[index]):
                piece = _add_state_prior(
                    piece, unknowns.local[index], self.segments[index], self.sensitivity.state_scale
                )
            return (found if self.cache_size else None), piece

        made = self._of_each(one)
        if self.cache_size:
            self.cache.append((unknowns, [line for line, _ in made]))
            del self.cache[: -self.cache_size]
        whole = [piece for _, piece in made if piece is not None]
        return whole if len(whole) == len(made) else None

    def equations(self, unknowns: Unknowns) -> NormalEquations | None:
        """Return the Gauss-Newton normal equations; None where a segment diverges."""
        pieces = self.compute_terms(unknowns)
        if pieces is None:
            return None
        p, q = len(self.sensitivity.free), len(self.sensitivity.state_scale)
        total = make_zero_equations(p, len(pieces), q)
        cost = 0.0
        for k, piece in enumerate(pieces):
            cost += piece.cost
            total.shared[...] += piece.shared
            total.shared_gradient[...] += piece.gradient
            total.border[k] += piece.border
            total.diagonal[k] += piece.local
            total.local_gradient[k] += piece.local_gradient
            if self.segments[k].joined and self.gap is not None:
                cost += _add_continuity(total, k, piece, pieces[k + 1], self.gap, p)
        return total._replace(cost=cost)

    def compute_second_derivative(self, here: Unknowns, move: Unknowns) -> Unknowns | None:
        """Return J^T r'' at `here` along `move` over segments that are not joined; None where one diverges."""
        known = next((lines for point, lines in self.cache if point is here), None)
        if known is not None:  # asked for again while steps from there are rejected
            self.cache.sort(key=lambda one: one[0] is here)

        def one(index: int) -> tuple[FloatArray, FloatArray] | None:
            line = self.linearise(index, here) if known is None else known[index]
            record = self.segments[index].record
            by = DIFFERENCE_STEP * np.concatenate((move.shared, move.local[index]))
            start = self.state(index, here)
            change = self.sensitivity.change(record, here.shared, start, by, self.steps_per_period)
            if line is None or change is None:
                return None
            straight = np.tensordot(move.shared, line.shared, 1) + np.tensordot(
                move.local[index], line.local, 1
            )
            second = 2.0 / DIFFERENCE_STEP * (change / DIFFERENCE_STEP - straight) / self.sigma[:, None] ** 2
            return np.tensordot(line.shared, second, 2), np.tensordot(line.local, second, 2)

        if any(segment.joined for segment in self.segments):
            return None
        made = self._of_each(one)
        whole = [found for found in made if found is not None]
        if len(whole) < len(made):
            return None
        return Unknowns(np.sum([shared for shared, _ in whole], axis=0), np.array([own for _, own in whole]))

    def _of_each(self, one: Callable[[int], T]) -> list[T]:
        """Apply `one` to each segment index, in parallel where there are threads."""
        indices = range(len(self.segments))
        length = sum(segment.record.samples for segment in self.segments) / len(self.segments)
        return each(self.executor if length >= MIN_THREADED_SAMPLES else None, one, indices)

    def _piece(self, found: Linearisation, joined: bool) -> SegmentTerms:
        p = len(found.shared)
        slopes = np.concatenate((found.shared, found.local))
        table = np.concatenate((found.residual[None], slopes))
        scored = table[:, :, :-1] if joined else table  # the last sample is the next segment's first
        flat = (scored / self.sigma[:, None]).reshape(len(table), -1)
        gram = flat @ flat.T
        return SegmentTerms(
            cost=0.5 * float(gram[0, 0]),
            shared=gram[1 : 1 + p, 1 : 1 + p],
            gradient=gram[1 : 1 + p, 0],
            border=gram[1 + p :, 1 : 1 + p],
            local=gram[1 + p :, 1 + p :],
            local_gradient=gram[1 + p :, 0],
            square=np.einsum("on,on->o", scored[0], scored[0]),
            begin=found.begin,
            end=found.end,
        )


def _add_state_prior(
    piece: SegmentTerms, own: FloatArray, segment: Segment, scale: FloatArray
) -> SegmentTerms:
    """Add the prior of the start state to a segment's terms; `own` and `scale` are (q,)."""
    if segment.prior is None:
        return piece
    states = len(segment.prior)
    off = own[:states] - segment.prior / scale[:states]
    weight = np.zeros(len(own))
    weight[:states] = PRIOR_WEIGHT**2
    gradient = piece.local_gradient.copy()
    gradient[:states] += PRIOR_WEIGHT**2 * off
    return piece._replace(
        cost=piece.cost + 0.5 * PRIOR_WEIGHT**2 * float(off @ off),
        local=piece.local + np.diag(weight),
        local_gradient=gradient,
    )


def _add_continuity(
    total: NormalEquations, k: int, piece: SegmentTerms, after: SegmentTerms, gap: FloatArray, p: int
) -> float:
    """Add the gap between segments k and k + 1 to the equations, and return its cost."""
    miss = (piece.end[0] - after.begin[0]) / gap
    shared = (piece.end[1 : 1 + p] - after.begin[1 : 1 + p]) / gap
    here, there = piece.end[1 + p :] / gap, -after.begin[1 + p :] / gap
    total.shared[...] += shared @ shared.T
    total.shared_gradient[...] += shared @ miss
    total.border[k] += here @ shared.T
    total.border[k + 1] += there @ shared.T
    total.diagonal[k] += here @ here.T
    total.diagonal[k + 1] += there @ there.T
    total.next[k] += here @ there.T
    total.local_gradient[k] += here @ miss
    total.local_gradient[k + 1] += there @ miss
    return 0.5 * float(miss @ miss)
