"""The experiment that would decide: of a menu, the input whose least separation between two candidates is largest.

T-optimal, the rival re-fitted to old and new data: with d the difference of both predictions, S the rival's
sensitivities on the new input and I its information from the data so far, all in units of the noise,

    T = min over c of |d - S' c|^2 + c' I c = d d - d S' (S S' + I)^-1 S d

Reference: Atkinson & Fedorov, The design of experiments for discriminating between two rival models (1975), eq. 2.3.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.hypothesis import Data, Hypothesis
from rtctl.diagnosis.menu import Input, menu
from rtctl.diagnosis.projection import Rows
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.residual_noise import NoiseModel

FloatArray = NDArray[np.float64]
FURTHEST = 1.5
"""Times the largest measured displacement: a device is not sent further on a simulation's word."""
DECIDES = 5.0
"""Standard errors between two candidates."""


class Scored(NamedTuple):
    """An input and the least separation [standard errors] that it would bring; NaN: not to be sent."""

    input: Input
    separation: float


class NextExperiment(NamedTuple):
    """What to measure next."""

    best: Scored
    separates: tuple[str, ...]
    menu: tuple[Scored, ...]

    @property
    def statement(self) -> str:
        """For a person."""
        *first, last = self.separates
        names = f"{', '.join(first)} {'from' if len(first) == 1 else 'and'} {last}" if first else last
        text = (
            f"Measure this next: {self.best.input.statement}. It separates {names} by {self.best.separation:.3g} "
            "standard errors at least"
        )
        if self.best.separation >= DECIDES:
            return text + "."
        return (
            text
            + ", too few to decide: measure longer, with less noise, or drive harder than these data did."
        )

    @property
    def json(self) -> dict[str, Any]:
        """For `diagnosis.json`."""
        return {
            "statement": self.statement,
            "separates": list(self.separates),
            "input": self.best.input.statement,
            "separation": self.best.separation,
            "scenario": "next-experiment.toml",
            "menu": [{"input": one.input.statement, "separation": one.separation} for one in self.menu],
        }


def next_experiment(
    candidates: Sequence[Hypothesis], data: Data, noise: Sequence[NoiseModel], units: Mapping[str, str]
) -> NextExperiment | None:
    """For two candidates or more; None where there is nothing to separate or nothing that the plant can take."""
    if len(candidates) < 2:
        return None
    known = [_information(candidate, data, noise) for candidate in candidates]
    scored = [Scored(entry, _least(entry, candidates, known, data, noise)) for entry in menu(data, units)]
    possible = [one for one in scored if np.isfinite(one.separation)]
    if not possible:
        return None
    ranking = sorted(possible, key=lambda one: -one.separation)
    names = [set(candidate.mechanisms) for candidate in candidates]
    common = set.intersection(*names)
    separates = dict.fromkeys(one for found in candidates for one in found.mechanisms if one not in common)
    return NextExperiment(ranking[0], tuple(separates), tuple(ranking))


def _information(candidate: Hypothesis, data: Data, noise: Sequence[NoiseModel]) -> FloatArray:
    """(p, p) of the shared unknowns, from all records so far."""
    total = np.zeros((len(candidate.shared), len(candidate.shared)))
    for line in candidate.linearise(data):
        rows = Rows(residual=line.residual, shared=line.shared, own=line.own, directions=line.shared[:0])
        flat = rows.whitened(noise)[0][1:]
        total += flat @ flat.T
    return total


def _least(
    entry: Input,
    candidates: Sequence[Hypothesis],
    known: Sequence[FloatArray],
    data: Data,
    noise: Sequence[NoiseModel],
) -> float:
    """Separation [standard errors] of the pair that is hardest to tell apart; NaN where the device might be hurt."""
    record = _record(entry, candidates[0], data)
    outputs = candidates[0].sensitivity.outputs
    furthest = {n: FURTHEST * max(float(np.abs(r.measured[n]).max()) for r in data.records) for n in outputs}
    runs = []
    for candidate in candidates:
        start = np.append(_rest(candidate), candidate.starts[0, candidate.states :])
        line = candidate.sensitivity.linearise(record, candidate.shared, start, data.steps_per_period)
        if line is None or any(np.abs(line.residual[o]).max() > furthest[n] for o, n in enumerate(outputs)):
            return float("nan")
        table = np.concatenate((line.residual[None], line.shared, line.own))
        white = np.stack([model.whiten(table[:, o]) for o, model in enumerate(noise)], axis=1)
        runs.append(white.reshape(len(white), -1))
    pairs = itertools.permutations(range(len(runs)), 2)
    return float(
        np.sqrt(max(0.0, min(separation(runs[i][0], runs[j][0], runs[j][1:], known[j]) for i, j in pairs)))
    )


def separation(true: FloatArray, rival: FloatArray, slopes: FloatArray, information: FloatArray) -> float:
    """T: squares that remain of `true` - `rival` (n,) once the rival moved along `slopes` (q, n), as far as
    `information` (p, p) of its first p unknowns lets it.
    """
    difference = true - rival
    normal = slopes @ slopes.T
    p = len(information)
    normal[:p, :p] += information
    right = slopes @ difference
    size = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    solved = np.linalg.pinv(normal / size[:, None] / size, rcond=1e-12, hermitian=True) @ (right / size)
    return float(difference @ difference - (right / size) @ solved)


def _record(entry: Input, candidate: Hypothesis, data: Data) -> FitRecord:
    """Held as a converter holds it; nothing was measured yet."""
    nothing = np.zeros(len(entry.levels))
    peak = {
        name: max(r.stimulus.peak.get(name, 0.0) for r in data.records)
        for name in candidate.sensitivity.outputs
    }
    stimulus = Stimulus(
        inputs={data.subject.drive: entry.levels}, holds={data.subject.drive: "zero"}, period_s=entry.period_s,
        initial=dict(zip(candidate.simulation.state, _rest(candidate).tolist(), strict=True)), peak=peak,
    )  # fmt: skip
    return FitRecord(
        name="next", stimulus=stimulus, measured=dict.fromkeys(candidate.sensitivity.outputs, nothing)
    )


def _rest(candidate: Hypothesis) -> FloatArray:
    """State (states,): zero, or where the first record began: a bistable beam rests in a well."""
    values = {p.name: p.value for p in candidate.simulation.parameters}
    start = np.zeros(candidate.states)
    if values.get("stiffness", 1.0) < 0.0:
        start[0] = candidate.starts[0][0]
    return start
