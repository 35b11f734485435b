"""The gate: may a hypothesis be claimed? Only if nothing else is left in its residual.

At the fitted hypothesis every direction that is not its own is tested against the noise: each mechanism of the
catalogue, the catalogue together, the generic forces, past motion and drive with their powers; whether the residual
grows with the motion, which noise does not, and whether it repeats where an input was repeated. The smallest p-value
counts, times the number of tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, ncx2
from scipy.stats import f as f_distribution

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.directions import (
    Direction,
    catalogue_directions,
    force_directions,
    mechanism_slopes,
)
from rtctl.diagnosis.residual.heteroscedasticity import Uneven, uneven
from rtctl.diagnosis.residual.projection import (
    Projected,
    Rows,
    beyond_unknowns,
    by_output,
    leftover,
    noise_of,
    project,
)
from rtctl.diagnosis.residual.residual_rows import as_converted
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import NoiseModel, group_by_period

FIRST_ORDER = 0.3
"""Of the residual, by the fits' steps."""
IN_COLOUR = (1.0 / 8.0, 1.0 / 4.0)
"""Of an allowed misfit (squares): what may lie along one mechanism's direction, and along many together, in the noise's
metric. A static model that is off errs in many ways at once; of twelve devices of the blind generator with nothing
hidden none had more than 0.082 along one, 0.11 along many."""
BY_SIZE = (1.0 / 4.0, 1.0)
"""The same by plain squares, where the twelve had 0.11 and 0.56 at most."""
NOTHING = 1e-6
"""Of what is allowed: so much less is certain to be exceeded, to 0.1 %."""
BARELY = 1.5
"""Times the noise (squares): a residual below it may be noise that is not as large everywhere."""
DOUBTFUL = 0.1
"""P-value below which that is asked."""
REPEATS = "something that repeats"
LAGS = 6
"""Of motion and drive, a quarter of a period apart."""


class ResidualTest(NamedTuple):
    """One question put to the residual."""

    name: str
    statistic: float
    freedom: int
    p_value: float


class Metric(NamedTuple):
    """Residual and directions in units of some noise, and what of a misfit is no gap: noncentralities."""

    projected: Projected | Uneven
    along: FloatArray
    """(k,) of each direction alone."""
    together: float
    """Of many."""

    def chances(self, chosen: NDArray[np.intp]) -> FloatArray:
        """(c,) of squares at least as large along each of the chosen directions alone."""
        removed = self.projected.single()
        return np.array([_chance(float(removed[k]), 1, float(self.along[k])) for k in chosen])

    def chance(self, chosen: NDArray[np.intp]) -> float:
        """Of squares at least as large along the chosen directions together."""
        statistic, freedom = self.projected.block(chosen)
        return _chance(statistic, freedom, self.together) if freedom else 1.0


class TestedHypothesis(NamedTuple):
    """A hypothesis at its optimum and what its residual still holds."""

    hypothesis: Hypothesis
    directions: tuple[Direction, ...]
    projected: Projected
    noise: tuple[NoiseModel, ...]
    tests: tuple[ResidualTest, ...]

    @property
    def p_value(self) -> float:
        """Of the sharpest test, for all of them."""
        return min(1.0, min(test.p_value for test in self.tests) * len(self.tests))


def run_residual_tests(
    hypothesis: Hypothesis, problem: Problem, ids: Sequence[str], noise: Sequence[NoiseModel] | None = None
) -> TestedHypothesis:
    """All tests at the optimum of `hypothesis`; `noise`: of each output, from a better one, or its own leftover."""
    problem = problem.glance
    others = tuple(identity for identity in ids if identity not in hypothesis.mechanisms)
    lines = hypothesis.linearise(problem)
    named = catalogue_directions(hypothesis.simulation, others, problem, [line.residual for line in lines])
    directions = [*named, *force_directions(problem)]
    rows = [_rows(hypothesis, problem, named, index, base) for index, base in enumerate(lines)]
    lags = len(rows[0].directions) - len(directions)
    directions += [Direction("", f"past {k}", "memory", {}, 1.0) for k in range(lags)]
    models = list(noise) if noise is not None else noise_of(rows, slow=not problem.allowed)
    projected, outputs = project(rows, models), hypothesis.sensitivity.outputs
    of_noise = Metric(projected, np.zeros(len(directions)), 0.0)
    if problem.allowed:
        allowed = np.array([problem.allowed[name] for name in outputs])
        tests = _beyond_what_is_allowed(directions, of_noise, rows, models, allowed)
    else:
        tests = _tests(directions, of_noise)
        excess = projected.residual / max(projected.samples - projected.rank, 1)
        if excess < BARELY and min(test.p_value for test in tests) < DOUBTFUL:
            tests = _tests(directions, of_noise, of_noise._replace(projected=uneven(rows, models, projected)))
    stepped = any(
        problem.step(name) > 0.0 for name in outputs
    )  # a converter's noise follows the motion, and repeats
    if noise is None and problem.subject.grows_with_motion and not stepped:
        tests.append(_growth(rows, models, problem))
    if not problem.allowed and not stepped:
        tests += beyond_repeats(beyond_unknowns(rows, projected), models, problem.records, outputs)
    return TestedHypothesis(hypothesis, tuple(directions), projected, tuple(models), tuple(tests))


def _rows(
    hypothesis: Hypothesis, problem: Problem, named: Sequence[Direction], index: int, base: object
) -> Rows:
    slopes = []
    for _, own in groupby(named, key=lambda direction: (direction.mechanism, direction.form)):
        slopes.append(mechanism_slopes(hypothesis, list(own), problem, index))
    slopes.append(problem.subject.slopes(hypothesis, problem, index))
    slopes.append(_past(base.residual + _measured(problem, hypothesis, index), problem, index))  # type: ignore[attr-defined]
    made = Rows(
        residual=resolved(hypothesis, problem, index, base.residual),  # type: ignore[attr-defined]
        shared=base.shared,  # type: ignore[attr-defined]
        local=base.local,  # type: ignore[attr-defined]
        directions=np.concatenate(slopes),
        period_s=problem.records[index].period_s,
    )
    return as_converted(made, problem, index, hypothesis.sensitivity.outputs)


def resolved(hypothesis: Hypothesis, problem: Problem, index: int, coarse: FloatArray) -> FloatArray:
    """The residual at the simulation's own steps: in a slope the fits' coarse ones cancel, in a residual they do not.

    `coarse` (outputs, n) where the difference is beyond the first order that takes the optimum along.
    """
    record, sensitivity = problem.records[index], hypothesis.sensitivity
    start = np.atleast_2d(hypothesis.start(index))
    run = hypothesis.simulation.predict(record.stimulus, hypothesis.values_of(index), start)
    fine = np.stack([run.outputs[name][0, record.first :] for name in sensitivity.outputs])
    fine = fine - _measured(problem, hypothesis, index)
    small = np.sum((fine - coarse) ** 2) < FIRST_ORDER**2 * np.sum(coarse**2)
    return fine if small else coarse


def _measured(problem: Problem, hypothesis: Hypothesis, index: int) -> FloatArray:
    record = problem.records[index]
    return np.stack([record.measured[name][record.first :] for name in hypothesis.sensitivity.outputs])


def _past(simulated: FloatArray, problem: Problem, index: int) -> FloatArray:
    """Reading and drive, and their powers, at lags of a quarter period: (directions, outputs, n)."""
    record = problem.records[index]
    y = simulated - simulated.mean(axis=1, keepdims=True) if problem.subject.about_mean else simulated
    y = y / np.sqrt(np.mean(y**2, axis=1, keepdims=True) + 1e-300)
    u = record.stimulus.inputs[problem.subject.drive][record.first :] / (problem.scales.drive or 1.0)
    lag = max(1, round(problem.subject.lag_s(problem.scales) / record.period_s))
    made = []
    for k in range(LAGS):
        for series in (y, y**2, y**3, np.broadcast_to(u, y.shape), np.broadcast_to(u**3, y.shape)):
            late = np.zeros_like(y)
            if k * lag < y.shape[1]:
                late[:, k * lag :] = series[:, : y.shape[1] - k * lag]
            made.append(late)
    return np.array(made)


def _beyond_what_is_allowed(
    directions: Sequence[Direction],
    of_noise: Metric,
    rows: Sequence[Rows],
    noise: Sequence[NoiseModel],
    allowed: FloatArray,
) -> list[ResidualTest]:
    """The tests where a misfit of `allowed` mean squares (outputs,) is no gap: in two metrics, widened by it.

    In that of the noise, which has the colour of a static model's errors too, a fast effect stands out and a slow one
    is hidden; by plain squares, as the allowed size is meant, a slow one counts that is beyond the noise as well.
    """
    powers = np.array([max(model.mean_square, 1e-300) for model in noise])
    wider = 1.0 + allowed / powers
    coloured = [model.scale_variance(k) for model, k in zip(noise, wider, strict=True)]
    plain = [NoiseModel(np.empty(0), power * k) for power, k in zip(powers, wider, strict=True)]
    squares = sum(row.residual.shape[1] for row in rows) * allowed / (powers * wider)
    in_colour, in_squares = (
        _metric(rows, models, squares, most) for models, most in ((coloured, IN_COLOUR), (plain, BY_SIZE))
    )
    by_size = [
        test._replace(name=f"{test.name}, by size") for test in _tests(directions, in_squares, of_noise)
    ]
    return [*_tests(directions, in_colour), *by_size]


def _metric(
    rows: Sequence[Rows], noise: Sequence[NoiseModel], squares: FloatArray, most: tuple[float, float]
) -> Metric:
    """Where a misfit of `squares` (outputs,) is no gap of which not `most` lies along one direction, or along many.

    Along a direction that is spread over the outputs by shares lies (sum sqrt(share x squares))^2 at most.
    """
    projected = project(rows, noise)
    along = np.sum(np.sqrt(by_output(projected, rows, noise) * squares[:, None]), axis=0) ** 2
    return Metric(projected, most[0] * along, most[1] * float(squares.sum()))


def _tests(directions: Sequence[Direction], *metrics: Metric) -> list[ResidualTest]:
    """Of one direction at its best and of blocks: the first metric's statistic, the largest chance in all of them."""
    first = metrics[0].projected
    removed = first.single()
    named = np.array([k for k, d in enumerate(directions) if d.mechanism], dtype=np.intp)
    given = np.array([k for k in named if directions[k].trials == 1], dtype=np.intp)
    forces = np.array([k for k, d in enumerate(directions) if not d.mechanism and d.coordinate != "memory"])
    past = np.array([k for k, d in enumerate(directions) if d.coordinate == "memory"])
    tests = []
    usable = named[first.usable[named]] if len(named) else named
    if len(usable):
        trials = np.array([directions[k].trials for k in usable])
        chances = np.max([one.chances(usable) for one in metrics], axis=0) * trials
        best = usable[int(np.argmin(np.where(chances > 0.0, chances, -removed[usable])))]
        p_value = min(1.0, float(chances.min()) * len(usable))
        tests.append(ResidualTest(f"{directions[best].mechanism} alone", float(removed[best]), 1, p_value))
    for name, chosen in (("catalogue", given), ("generic forces", forces), ("past motion and drive", past)):
        statistic, freedom = first.block(chosen)
        if freedom:
            tests.append(ResidualTest(name, statistic, freedom, max(one.chance(chosen) for one in metrics)))
    return tests


def _chance(statistic: float, freedom: int, allowance: float) -> float:
    """Of a sum of squares at least as large, where the misfit is what is allowed."""
    if statistic <= NOTHING * allowance:  # SciPy's distribution overflows there
        return 1.0
    if allowance > 0.0:
        return float(ncx2.sf(statistic, freedom, allowance))
    return float(chi2.sf(statistic, freedom))


def _growth(rows: Sequence[Rows], noise: Sequence[NoiseModel], problem: Problem) -> ResidualTest:
    """Whether the leftover's variance goes with the motion's within records: log variance of blocks on log amplitude,
    rank-based, both about their means in each record, since a bench may have been noisier on one day than on another.

    The simulated motion's: where a ring-down has died away, the size of a reading is that of its own noise.
    """
    from scipy.stats import spearmanr

    sizes, amplitudes = list[FloatArray](), list[FloatArray]()
    for index, left in enumerate(leftover(_as_noisy(rows, noise), noise)):
        record = problem.records[index]
        block = max(16, round(4.0 * np.pi / problem.scales.rate / record.period_s))
        motion = record.measured[problem.subject.output][record.first :] + rows[index].residual[0]
        count = len(motion) // block
        if count < 4:
            continue
        white = noise[0].for_period(record.period_s).whiten(left[0])[: count * block].reshape(count, block)
        pieces = motion[: count * block].reshape(count, block)
        for found, of_blocks in (
            (sizes, np.log(np.mean(white**2, axis=1) + 1e-12)),
            (amplitudes, np.log(np.std(pieces, axis=1) + 1e-300)),
        ):
            found.append(of_blocks - of_blocks.mean())
    if not sizes:
        return ResidualTest("residual grows with the motion", 0.0, 0, 1.0)
    x, y = np.concatenate(amplitudes), np.concatenate(sizes)
    if not (np.ptp(x) > 0.0 and np.ptp(y) > 0.0):
        return ResidualTest("residual grows with the motion", 0.0, 0, 1.0)
    ranked = spearmanr(x, y, alternative="greater")
    return ResidualTest("residual grows with the motion", float(ranked.statistic), 1, float(ranked.pvalue))


def _as_noisy(rows: Sequence[Rows], noise: Sequence[NoiseModel]) -> list[Rows]:
    """Each record in units of its own noise: what a loud one makes parameters err by is no gap of a quiet one."""
    found = []
    for row, left in zip(rows, leftover(rows, noise), strict=True):
        white = [model.for_period(row.period_s).whiten(one) for model, one in zip(noise, left, strict=True)]
        own = 1.0 / np.array([float(one.std()) or 1.0 for one in white])[:, None]
        found.append(
            replace(
                row,
                residual=row.residual * own,
                shared=row.shared * own,
                local=row.local * own,
                directions=row.directions * own,
            )
        )
    return found


def beyond_repeats(
    residuals: Sequence[FloatArray],
    noise: Sequence[NoiseModel],
    records: Sequence[FitRecord],
    outputs: Sequence[str],
) -> list[ResidualTest]:
    """Whether the mean residual of repeats of one input is more than their scatter explains: what repeats is no noise.

    Of m repeats the mean is independent of the scatter about it: m mean^2 over scatter^2 / (m - 1) is F-distributed.
    `residuals` (outputs, n) of each record. Empty without repeats.
    """
    common = deviations = 0.0
    freedom = rest = 0
    for letter in dict.fromkeys(record.repeat for record in records if record.repeat is not None):
        group = [k for k, record in enumerate(records) if record.repeat == letter]
        length = min(residuals[k].shape[1] for k in group)
        periods = [records[k].period_s for k in group]
        if len(group) < 2 or len({records[k].first for k in group}) > 1 or len(group_by_period(periods)) > 1:
            continue
        of_group = [model.for_period(periods[0]) for model in noise]
        for o, (name, model) in enumerate(zip(outputs, of_group, strict=True)):
            readings = np.stack([records[k].measured[name][records[k].first :][:length] for k in group])
            scatter = model.whiten(readings - readings.mean(axis=0))
            mean = model.whiten(np.mean([residuals[k][o, :length] for k in group], axis=0)[None])
            common += len(group) * float(np.sum(mean**2))
            deviations += float(np.sum(scatter**2))
            freedom, rest = freedom + length, rest + length * (len(group) - 1)
    if not freedom or not deviations > 0.0:
        return []
    statistic = (common / freedom) / (deviations / rest)
    return [ResidualTest(REPEATS, statistic, freedom, float(f_distribution.sf(statistic, freedom, rest)))]


def start_of(simulation: Simulation, values: FloatArray) -> Simulation:
    """`simulation` at `values`, within its bounds."""
    low = np.array([parameter.low for parameter in simulation.parameters])
    high = np.array([parameter.high for parameter in simulation.parameters])
    return simulation.with_values(np.clip(values, low, high))
