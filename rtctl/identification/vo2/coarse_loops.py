"""Test whether identified loops are too coarse, and refit them on a grid adapted to the film.

A film whose domains switch one by one has steps in its loops, which cells spread over the whole range smear. Two tests
show it, and neither rests on a model of the noise: the residual of a read-out at states that the staircases reach
more than once, against the scatter of the readings there (lack of fit against pure error, as in the analysis of
variance); and whether as many cells, placed where the relays switch, leave a much smaller residual. Only
records that move through a step can tell where it lies between two levels of a staircase; `refit_loop` uses both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.hysteresis.preisach.model import PreisachModel, cooled_stack, move_input
from rtctl.identification.vo2.adapted_grid import adapt_nodes
from rtctl.identification.vo2.heating import prepend_full_cooling
from rtctl.identification.vo2.preisach_fit import PreisachFit, fit_preisach
from rtctl.identification.vo2.staircase import SteadyStates, extract_steady_states, simulate_hold_ends
from rtctl.measured.dataset import Dataset
from rtctl.models.vo2 import Vo2Model

ReadOuts = Mapping[str, PreisachModel]
"""Read-outs of a model by output: `resistance` gives -ln R."""
COARSE_LIMITS = ((0.8, 1e-3), (0.92, 2.5e-3))
"""Pairs of the residual ratio and the least misfit with which a read-out is too coarse.

The first is the RMS residual of as many cells elsewhere over that of the given read-out; the second the RMS misfit,
relative to the output's standard deviation, that the other cells certainly (95 %) remove. In noise of half a percent
the larger misfit reduces the residual less, so there are two pairs. Measured: in twelve generated devices with such
domains the misfit was 0.16 to 0.79 % of the deflection; in two of 40 others 0.09 and 0.10 %; of 60 more none was
coarse.
"""
MIN_REPEATED_STATES = 30
"""Repeated states below which lack of fit cannot be tested."""
MIN_LACK_OF_FIT = 2.0
"""Ratio of lack of fit to pure error below which no refit is tried, if both read-outs are below it.

One film moves both read-outs, and its domains may show in one alone.
"""
CLAIMED_ERROR_FACTOR = 1.1
"""Multiple of the identification's own residual above which a read-out was not learned from these staircases."""
MAX_CELLS = 80
"""Cells along each field of finer loops: time and memory grow with the fourth power."""
SAMPLE_BUDGETS = (3000, 6000)
"""Evenly spread samples of records used beside the staircases, for choosing the grid and for the fit on it."""
SMOOTH_CELLS = 40
"""Cells along each field of the first fit, unless relays are known to switch together.

Fewer cells take a tenth of the time, and fit noise less where there is no step.
"""
BLOCK_SAMPLES = 50
UNITS = {"deflection": "um", "resistance": "dimensionless"}
OUTPUT_NAMES = {"deflection": "the deflection", "resistance": "ln R"}
RESAMPLES = 200


class Samples(NamedTuple):
    """Samples of one read-out in order: surrogate v, reading y, and which are `scored`, all (n,)."""

    v: FloatArray
    y: FloatArray
    scored: NDArray[np.bool_]


class LoopResolution(NamedTuple):
    """Comparison of a read-out with one of as many cells placed where the relays switch."""

    given: PreisachModel
    finer: PreisachModel
    """Read-out of as many cells, placed where the relays switch."""
    staircases: Samples
    left: FloatArray
    """Residual of the given read-out at the scored samples."""
    left_finer: FloatArray
    """Residual of the finer read-out at the scored samples."""

    @property
    def rms(self) -> tuple[float, float]:
        """RMS residuals of the given and of the finer read-out."""
        return _compute_rms(self.left), _compute_rms(self.left_finer)

    @property
    def share(self) -> float:
        """RMS residual of the finer read-out over that of the given one."""
        given, finer = self.rms
        return finer / given

    @property
    def is_coarse(self) -> bool:
        """Whether the residual shrinks much, and certainly by a size that matters."""
        size = float(self.staircases.y[self.staircases.scored].std())
        return any(self.share < share and self.misfit[1] > least * size for share, least in COARSE_LIMITS)

    @property
    def misfit(self) -> tuple[float, float, float]:
        """RMS residual of the given read-out beyond the finer one, and its 95 % interval, resampled in blocks."""
        count = max(1, len(self.left) // BLOCK_SAMPLES)
        beyond = [part.mean() for part in np.array_split(self.left**2 - self.left_finer**2, count)]
        draws = np.random.default_rng(0).integers(0, count, (RESAMPLES, count))
        means = np.sqrt(np.maximum(np.array(beyond)[draws].mean(axis=1), 0.0))
        low, high = np.percentile(means, [2.5, 97.5])
        return float(np.sqrt(max(float(np.mean(beyond)), 0.0))), float(low), float(high)


def find_coarse_loops(model: Vo2Model, dataset: Dataset) -> dict[str, LoopResolution]:
    """Compare read-outs by output; empty where none is too coarse, or no staircase can show it."""
    ends = _find_steady_states(dataset)
    if ends is None:
        return {}
    states = _number_states(ends)
    with threadpool_limits(1, "blas"):
        given = _collect_given(model, dataset, ends)
        if all(one.lack_of_fit(states) < MIN_LACK_OF_FIT for one in given.values()):
            return {}
        found = {output: _compare_with_finer(one) for output, one in given.items()}
    return found if any(one.is_coarse for one in found.values()) else {}


def collect_loops(model: Vo2Model, dataset: Dataset) -> dict[str, LoopResolution]:
    """Return the identified loops by output, for `refit_loop` where other records show that they are off.

    None of them is marked as coarse.
    """
    ends = _find_steady_states(dataset)
    if ends is None:
        return {}
    with threadpool_limits(1, "blas"):
        given = _collect_given(model, dataset, ends)
    return {
        name: LoopResolution(one.read, one.read, one.staircases, one.left, one.left)
        for name, one in given.items()
    }


def describe_improvement(coarse: Mapping[str, LoopResolution]) -> str:
    """Describe the residuals of the finer read-outs against the given ones, for each output that is too coarse."""
    said = []
    for output, one in ((output, one) for output, one in coarse.items() if one.is_coarse):
        unit = "" if UNITS[output] == "dimensionless" else f" {UNITS[output]}"
        given, finer = one.rms
        said.append(f"{finer:.3g}{unit} of {OUTPUT_NAMES[output]} instead of {given:.3g}{unit}")
    return ", ".join(said)


def refit_loop(coarse: LoopResolution, records: Sequence[Samples]) -> PreisachModel:
    """Refit a read-out to the staircases and to `records` of a known temperature, on a grid adapted to the film."""
    model = coarse.finer
    with threadpool_limits(1, "blas"):
        cells = _count_cells(coarse.given)
        first = cells if coarse.is_coarse else min(SMOOTH_CELLS, cells)
        for rows, count in zip(SAMPLE_BUDGETS, (first, cells), strict=True):
            parts = [coarse.staircases, *(_prepend_cold_sample(one) for one in _thin(records, rows))]
            v, y, scored = (np.concatenate(column) for column in zip(*parts, strict=True))
            nodes = adapt_nodes(model, count)
            nodes[0], nodes[-1] = (
                min(nodes[0], float(v[scored].min())),
                max(nodes[-1], float(v[scored].max())),
            )
            model = fit_preisach(v, y, scored, nodes=nodes, near=model, sign=coarse.given.sign).model
    return model


def compute_lack_of_fit(left: FloatArray, states: Sequence[int]) -> float:
    """Return the lack of fit over the pure error of the residuals `left` (n,) at repeated `states` (n,).

    The lack of fit is the mean square of the mean residual at states that are reached more than once, the pure error
    that of the scatter about it.

    Returns:
        The ratio, or NaN where fewer than `MIN_REPEATED_STATES` states are repeated.
    """
    _, place, count = np.unique(np.asarray(states), return_inverse=True, return_counts=True)
    means = np.bincount(place, left) / count
    again = count > 1
    freedom = int((count[again] - 1).sum())
    if again.sum() < MIN_REPEATED_STATES:
        return float("nan")
    scatter = np.bincount(place, (left - means[place]) ** 2)[again].sum() / freedom
    lack = float(np.mean(count[again] * means[again] ** 2))
    return lack / max(float(scatter), 1e-300)


class _GivenReadOut(NamedTuple):
    """A read-out of the model and what it leaves at the scored samples."""

    read: PreisachModel
    staircases: Samples
    left: FloatArray

    def lack_of_fit(self, states: NDArray[np.intp]) -> float:
        return compute_lack_of_fit(self.left, states[self.staircases.scored].tolist())


def _find_steady_states(dataset: Dataset) -> SteadyStates | None:
    """Return the staircases' steady states; None where there is no staircase or it has too few holds."""
    try:
        return extract_steady_states(dataset)
    except InputError:
        return None


def _collect_given(model: Vo2Model, dataset: Dataset, ends: SteadyStates) -> dict[str, _GivenReadOut]:
    """Return the given read-outs and their residuals by output, for the measured outputs."""
    v = simulate_hold_ends(dataset, model.time_constant_s, reads_after=model.reads_after)
    reading = -np.log(np.maximum(ends.resistance_ohm, 1e-300))
    found = {}
    for output, read, claimed, y in (
        ("deflection", model.deflection_preisach, model.deflection_error, ends.deflection_um),
        ("resistance", model.resistance_preisach, model.reading_error, reading),
    ):
        scored = ends.scored & np.isfinite(y)
        if scored.any():
            staircases = Samples(v, np.nan_to_num(y), scored)
            found[output] = _GivenReadOut(read, staircases, _compute_residual(read, claimed, staircases))
    return found


def _compute_residual(read: PreisachModel, claimed: float, staircases: Samples) -> FloatArray:
    """Return the residual at the scored samples.

    It is that of the read-out, or of one on its grid fitted to these staircases where the read-out was learned
    elsewhere.
    """
    v, y, scored = staircases
    left: FloatArray = (y - read.simulate(v))[scored]
    return (
        left
        if _compute_rms(left) <= CLAIMED_ERROR_FACTOR * claimed
        else _fit_on_nodes(staircases, read, read.grid).residual
    )


def _compare_with_finer(given: _GivenReadOut) -> LoopResolution:
    read, staircases, left = given
    finer = _fit_on_nodes(staircases, read, adapt_nodes(read, _count_cells(read)))
    return LoopResolution(read, finer.model, staircases, left, finer.residual)


def _fit_on_nodes(staircases: Samples, read: PreisachModel, nodes: FloatArray) -> PreisachFit:
    return fit_preisach(*staircases, nodes=nodes, near=read, sign=read.sign)


def _count_cells(read: PreisachModel) -> int:
    """Return the read-out's own number of cells, limited."""
    return min(len(read.grid) - 1, MAX_CELLS)


def _number_states(ends: SteadyStates) -> NDArray[np.intp]:
    """Return a number (n,) for each hold, equal where the relays remember the same extremes of current."""
    known: dict[tuple[float, ...], int] = {}
    grid = np.array([0.0, float(ends.current_mA.max())])
    stack, found = cooled_stack(grid), []
    for current, reset in zip(ends.current_mA.tolist(), ends.reset.tolist(), strict=True):
        stack = cooled_stack(grid) if reset else stack
        top = move_input(stack, max(current, 0.0))
        found.append(known.setdefault(tuple(stack[1 : 2 + top].tolist()), len(known)))
    return np.array(found, dtype=np.intp)


def _prepend_cold_sample(one: Samples) -> Samples:
    """Put a full cooling in front."""
    first = np.zeros(1)
    return Samples(prepend_full_cooling(one.v), np.append(first, one.y), np.append([False], one.scored))


def _thin(records: Sequence[Samples], most: int) -> list[Samples]:
    total = sum(int(one.scored.sum()) for one in records)
    step = max(1, -(-total // most))
    thin = []
    for one in records:
        scored = np.zeros(len(one.v), dtype=bool)
        scored[np.flatnonzero(one.scored)[::step]] = True
        thin.append(one._replace(scored=scored))
    return thin


def _compute_rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
