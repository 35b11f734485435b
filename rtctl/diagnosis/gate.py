"""The gate: may a hypothesis be claimed? Only if nothing else is left in its residual.

At the fitted hypothesis every direction that is not its own is tested against the noise: each mechanism of the
catalogue, the catalogue together, the generic forces, past motion and drive with their powers; whether the residual
grows with the motion, which noise does not, and whether it repeats where an input was repeated. The smallest p-value
counts, times the number of tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, ncx2
from scipy.stats import f as f_distribution

from rtctl.border.simulation import Simulation
from rtctl.diagnosis.directions import (
    Direction,
    catalogue_directions,
    force_directions,
    mechanism_slopes,
)
from rtctl.diagnosis.hypothesis import Data, Hypothesis
from rtctl.diagnosis.projection import Projected, Rows, leftover, noise_of, project
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.residual_noise import NoiseModel

FloatArray = NDArray[np.float64]
COARSE = 0.3
"""Of the noise: a converter's step above it shows; random readings lie far closer."""
FIRST_ORDER = 0.3
"""Of the residual, by the fits' steps."""
ALONG_ONE = 1.0 / 8.0
"""Of an allowed misfit (squares): what may lie along one mechanism's direction. A static model that is off errs in many
ways at once; of ten devices of the blind generator with nothing hidden none had more than 1/12 along one."""
ALONG_MANY = 1.0 / 2.0
"""The same for many directions together; those ten had 0.28 at most."""
REPEATS = "something that repeats"
LAGS = 6
"""Of motion and drive, a quarter of a period apart."""


class Test(NamedTuple):
    """One question put to the residual."""

    name: str
    statistic: float
    freedom: int
    p_value: float


class Examined(NamedTuple):
    """A hypothesis at its optimum and what its residual still holds."""

    hypothesis: Hypothesis
    directions: tuple[Direction, ...]
    projected: Projected
    noise: tuple[NoiseModel, ...]
    tests: tuple[Test, ...]

    @property
    def p_value(self) -> float:
        """Of the sharpest test, for all of them."""
        return min(1.0, min(test.p_value for test in self.tests) * len(self.tests))


def examine(
    hypothesis: Hypothesis, data: Data, ids: Sequence[str], noise: Sequence[NoiseModel] | None = None
) -> Examined:
    """All tests at the optimum of `hypothesis`; `noise`: of each output, from a better one, or its own leftover."""
    data = data.glance
    others = tuple(identity for identity in ids if identity not in hypothesis.mechanisms)
    lines = hypothesis.linearise(data)
    named = catalogue_directions(hypothesis.simulation, others, data, [line.residual for line in lines])
    directions = [*named, *force_directions(data)]
    rows = [_rows(hypothesis, data, named, index, base) for index, base in enumerate(lines)]
    lags = len(rows[0].directions) - len(directions)
    directions += [Direction("", f"past {k}", "memory", {}, 1.0) for k in range(lags)]
    models = list(noise) if noise is not None else noise_of(rows)
    projected, outputs = project(rows, models), hypothesis.sensitivity.outputs
    if data.allowed:
        wider = _widened(data, outputs, models)
        tests = _tests(project(rows, wider), directions, _allowance(data, outputs, rows, wider))
    else:
        tests = _tests(projected, directions, 0.0)
    if noise is None and data.subject.grows_with_motion and not _quantised(data, models):
        tests.append(_growth(rows, models, data))
    if not data.allowed and not _quantised(data, models):  # a converter's steps repeat, too
        tests += beyond_repeats([row.residual for row in rows], models, data.records, outputs)
    return Examined(hypothesis, tuple(directions), projected, tuple(models), tuple(tests))


def _rows(hypothesis: Hypothesis, data: Data, named: Sequence[Direction], index: int, base: object) -> Rows:
    slopes = []
    for identity in dict.fromkeys(direction.mechanism for direction in named):
        own = [direction for direction in named if direction.mechanism == identity]
        slopes.append(mechanism_slopes(hypothesis, own, data, index))
    slopes.append(data.subject.slopes(hypothesis, data, index))
    slopes.append(_past(base.residual + _measured(data, hypothesis, index), data, index))  # type: ignore[attr-defined]
    return Rows(
        residual=resolved(hypothesis, data, index, base.residual),  # type: ignore[attr-defined]
        shared=base.shared,  # type: ignore[attr-defined]
        own=base.own,  # type: ignore[attr-defined]
        directions=np.concatenate(slopes),
    )


def resolved(hypothesis: Hypothesis, data: Data, index: int, coarse: FloatArray) -> FloatArray:
    """The residual at the simulation's own steps: in a slope the fits' coarse ones cancel, in a residual they do not.

    `coarse` (outputs, n) where the difference is beyond the first order that takes the optimum along.
    """
    record, sensitivity = data.records[index], hypothesis.sensitivity
    start = np.atleast_2d(hypothesis.start(index))
    run = hypothesis.simulation.predict(record.stimulus, hypothesis.values_of(index), start)
    fine = np.stack([run.outputs[name][0, record.first :] for name in sensitivity.outputs])
    fine = fine - _measured(data, hypothesis, index)
    small = np.sum((fine - coarse) ** 2) < FIRST_ORDER**2 * np.sum(coarse**2)
    return fine if small else coarse


def _measured(data: Data, hypothesis: Hypothesis, index: int) -> FloatArray:
    record = data.records[index]
    return np.stack([record.measured[name][record.first :] for name in hypothesis.sensitivity.outputs])


def _past(simulated: FloatArray, data: Data, index: int) -> FloatArray:
    """Reading and drive, and their powers, at lags of a quarter period: (directions, outputs, n)."""
    record = data.records[index]
    y = simulated - simulated.mean(axis=1, keepdims=True) if data.subject.about_mean else simulated
    y = y / np.sqrt(np.mean(y**2, axis=1, keepdims=True) + 1e-300)
    u = record.stimulus.inputs[data.subject.drive][record.first :] / (data.scales.drive or 1.0)
    lag = max(1, round(data.subject.lag_s(data.scales) / record.period_s))
    made = []
    for k in range(LAGS):
        for series in (y, y**2, y**3, np.broadcast_to(u, y.shape), np.broadcast_to(u**3, y.shape)):
            late = np.zeros_like(y)
            if k * lag < y.shape[1]:
                late[:, k * lag :] = series[:, : y.shape[1] - k * lag]
            made.append(late)
    return np.array(made)


def _widened(data: Data, outputs: Sequence[str], noise: Sequence[NoiseModel]) -> list[NoiseModel]:
    """Noise with the variance of what is allowed beside it: else a quiet output allows for what a loud one shows."""
    wider = []
    for name, model in zip(outputs, noise, strict=True):
        power = max(float(np.mean(model.power(4096))), 1e-300)
        wider.append(model._replace(variance=model.variance * (1.0 + data.allowed[name] / power)))
    return wider


def _allowance(
    data: Data, outputs: Sequence[str], rows: Sequence[Rows], noise: Sequence[NoiseModel]
) -> float:
    """Noncentrality of a chi-squared whose misfit is as large as is allowed, in `noise` that is widened by it."""
    samples = sum(row.residual.shape[1] for row in rows)
    shares = [
        data.allowed[name] / max(float(np.mean(model.power(4096))), 1e-300)
        for name, model in zip(outputs, noise, strict=True)
    ]
    return float(samples * np.sum(shares))


def _chance(statistic: float, freedom: int, allowance: float) -> float:
    """Of a sum of squares at least as large, where the misfit is what is allowed."""
    if allowance > 0.0:
        return float(ncx2.sf(statistic, freedom, allowance))
    return float(chi2.sf(statistic, freedom))


def _tests(projected: Projected, directions: Sequence[Direction], allowance: float) -> list[Test]:
    removed = projected.single()
    named = np.array([k for k, d in enumerate(directions) if d.mechanism], dtype=np.intp)
    given = np.array([k for k in named if directions[k].trials == 1], dtype=np.intp)
    forces = np.array([k for k, d in enumerate(directions) if not d.mechanism and d.coordinate != "memory"])
    past = np.array([k for k, d in enumerate(directions) if d.coordinate == "memory"])
    tests = []
    usable = named[projected.usable[named]] if len(named) else named
    if len(usable):
        trials = np.array([directions[k].trials for k in usable])
        chances = (
            np.array([_chance(float(one), 1, ALONG_ONE * allowance) for one in removed[usable]]) * trials
        )
        best = usable[int(np.argmin(np.where(chances > 0.0, chances, -removed[usable])))]
        p_value = min(1.0, float(chances.min()) * len(usable))
        tests.append(Test(f"{directions[best].mechanism} alone", float(removed[best]), 1, p_value))
    for name, chosen in (("catalogue", given), ("generic forces", forces), ("past motion and drive", past)):
        statistic, freedom = projected.block(chosen)
        if freedom:
            chance = _chance(statistic, freedom, ALONG_MANY * allowance)
            tests.append(Test(name, statistic, freedom, chance))
    return tests


def _quantised(data: Data, noise: Sequence[NoiseModel]) -> bool:
    """Whether the noise is mostly that of a converter: it then depends on the motion, and is no sign of a gap."""
    spread = float(np.sqrt(noise[0].power(4096).mean()))
    steps = []
    for record in data.records:
        levels = np.unique(record.measured[data.subject.output])
        if len(levels) > 2:
            steps.append(float(np.median(np.diff(levels))))
    return bool(steps) and min(steps) > COARSE * spread


def _growth(rows: Sequence[Rows], noise: Sequence[NoiseModel], data: Data) -> Test:
    """Whether the leftover's variance goes with the motion's: log variance of blocks on log amplitude, rank-based."""
    from scipy.stats import spearmanr

    block = max(16, round(4.0 * np.pi / data.scales.rate / data.records[0].period_s))
    sizes, amplitudes = [], []
    for index, left in enumerate(leftover(rows, noise)):
        record = data.records[index]
        motion = record.measured[data.subject.output][record.first :]
        count = len(motion) // block
        if count < 4:
            continue
        white = noise[0].whiten(left[0])[: count * block].reshape(count, block)
        sizes.append(np.log(np.mean(white**2, axis=1) + 1e-12))
        pieces = motion[: count * block].reshape(count, block)
        amplitudes.append(np.log(np.std(pieces, axis=1) + 1e-300))
    if not sizes:
        return Test("residual grows with the motion", 0.0, 0, 1.0)
    found = spearmanr(np.concatenate(amplitudes), np.concatenate(sizes), alternative="greater")
    p_value = float(found.pvalue)
    return Test(
        "residual grows with the motion", float(found.statistic), 1, p_value if np.isfinite(p_value) else 1.0
    )


def beyond_repeats(
    residuals: Sequence[FloatArray],
    noise: Sequence[NoiseModel],
    records: Sequence[FitRecord],
    outputs: Sequence[str],
) -> list[Test]:
    """Whether the mean residual of repeats of one input is more than their scatter explains: what repeats is no noise.

    Of m repeats the mean is independent of the scatter about it: m mean^2 over scatter^2 / (m - 1) is F-distributed.
    `residuals` (outputs, n) of each record. Empty without repeats.
    """
    common = deviations = 0.0
    freedom = rest = 0
    for letter in dict.fromkeys(record.repeat for record in records if record.repeat is not None):
        group = [k for k, record in enumerate(records) if record.repeat == letter]
        length = min(residuals[k].shape[1] for k in group)
        if len(group) < 2 or len({records[k].first for k in group}) > 1:
            continue
        for o, (name, model) in enumerate(zip(outputs, noise, strict=True)):
            readings = np.stack([records[k].measured[name][records[k].first :][:length] for k in group])
            scatter = model.whiten(readings - readings.mean(axis=0))
            mean = model.whiten(np.mean([residuals[k][o, :length] for k in group], axis=0)[None])
            common += len(group) * float(np.sum(mean**2))
            deviations += float(np.sum(scatter**2))
            freedom, rest = freedom + length, rest + length * (len(group) - 1)
    if not freedom or not deviations > 0.0:
        return []
    statistic = (common / freedom) / (deviations / rest)
    return [Test(REPEATS, statistic, freedom, float(f_distribution.sf(statistic, freedom, rest)))]


def start_of(simulation: Simulation, values: FloatArray) -> Simulation:
    """`simulation` at `values`, within its bounds."""
    low = np.array([parameter.low for parameter in simulation.parameters])
    high = np.array([parameter.high for parameter in simulation.parameters])
    return simulation.with_values(np.clip(values, low, high))
