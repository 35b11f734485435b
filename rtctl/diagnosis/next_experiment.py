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
PARTED = 0.5
"""Of the RMS of the readings so far: candidates that differ by more, though they explain these, have gone to different
motions, and what follows says nothing of their causes."""
DECIDES = 6.0
"""Standard errors between two candidates: of records that bring so many, 98 % leave one by EQUIVALENT."""
MOST_TIMES = 16
"""Repeats of one input that are proposed where one does not decide."""
ALIKE = 0.1
"""Standard errors from one record: below, candidates answer alike."""


class Scored(NamedTuple):
    """An input and the least separation [standard errors] that one record of it would bring."""

    input: Input
    separation: float
    whole: bool = True
    """No prediction parts from the others: else only what comes before counts, and a fit may not find back after it."""


class _Runs(NamedTuple):
    """Of each candidate (1 + unknowns, n) prediction and slopes in units of the noise, up to where predictions part."""

    tables: list[FloatArray]
    whole: bool


class NextExperiment(NamedTuple):
    """What to measure next."""

    best: Scored
    times: int
    """Records of it."""
    separation: float
    """[standard errors] The least that all of them bring."""
    separates: tuple[str, ...]
    menu: tuple[Scored, ...]

    @property
    def statement(self) -> str:
        """For a person."""
        *first, last = self.separates
        names = f"{', '.join(first)} {'from' if len(first) == 1 else 'and'} {last}" if first else last
        if self.separation < ALIKE:
            return (
                f"No input of the menu separates {names}: to each of them, within the drive that these data have, they "
                f"answer alike. The best is {self.best.input.statement}."
            )
        often = f", {self.times} times" if self.times > 1 else ""
        text = (
            f"Measure this next{often}: {self.best.input.statement}. It separates {names} by {self.separation:.3g} "
            "standard errors at least"
        )
        if self.separation >= DECIDES:
            return text + "."
        return (
            text
            + ", too few to decide: measure longer, with less noise, or drive harder than these data did."
        )

    @property
    def scenario(self) -> dict[str, Any]:
        """As `rtctl acquire` takes it: a table of excitation a record."""
        once = dict(self.best.input.scenario)
        return once | {"excitation": [*once["excitation"]] * self.times}

    @property
    def json(self) -> dict[str, Any]:
        """For `diagnosis.json`."""
        return {
            "statement": self.statement,
            "separates": list(self.separates),
            "input": self.best.input.statement,
            "times": self.times,
            "separation": self.separation,
            "scenario": "next-experiment.toml",
            "menu": [{"input": one.input.statement, "separation": one.separation} for one in self.menu],
        }


def next_experiment(
    candidates: Sequence[Hypothesis], nominal: Hypothesis, data: Data, noise: Sequence[NoiseModel],
    units: Mapping[str, str],
) -> NextExperiment | None:  # fmt: skip
    """For two candidates or more; None where there is nothing to separate or nothing that the plant can take.

    What decides only by the beginning of a record, as predictions part, is proposed where nothing else decides. So is
    what the `nominal` model does not follow: it is what the next diagnosis begins with.
    """
    if len(candidates) < 2:
        return None
    known = [_information(candidate, data, noise) for candidate in candidates]
    runs = [(entry, _runs(entry, candidates, nominal, data, noise)) for entry in menu(data, units)]
    possible = [
        (Scored(entry, _least(run.tables, known), run.whole), run.tables)
        for entry, run in runs
        if run is not None
    ]
    if not possible:
        return None
    possible.sort(key=lambda one: -one[0].separation)
    followed = sorted(possible, key=lambda one: not one[0].whole)
    tried = [
        (best, *_repeated(best.separation, tables, known)) for best, tables in (followed[0], possible[0])
    ]
    best, times, together = tried[0] if tried[0][2] >= DECIDES else max(tried, key=lambda one: one[2])
    names = [set(candidate.mechanisms) for candidate in candidates]
    common = set.intersection(*names)
    separates = dict.fromkeys(one for found in candidates for one in found.mechanisms if one not in common)
    return NextExperiment(best, times, together, tuple(separates), tuple(scored for scored, _ in possible))


def _repeated(once: float, tables: Sequence[FloatArray], known: Sequence[FloatArray]) -> tuple[int, float]:
    """How many records of one input decide, and what they separate; MOST_TIMES where no number up to it does, once
    where it would be in vain.
    """
    if once >= DECIDES or once < ALIKE:
        return 1, once
    for times in range(2, MOST_TIMES + 1):
        together = _least(tables, known, times)
        if together >= DECIDES:
            break
    return times, together


def _information(candidate: Hypothesis, data: Data, noise: Sequence[NoiseModel]) -> FloatArray:
    """(p, p) of the shared unknowns, from all records so far."""
    total = np.zeros((len(candidate.shared), len(candidate.shared)))
    for line in candidate.linearise(data):
        rows = Rows(residual=line.residual, shared=line.shared, own=line.own, directions=line.shared[:0])
        flat = rows.whitened(noise)[0][1:]
        total += flat @ flat.T
    return total


def _runs(
    entry: Input,
    candidates: Sequence[Hypothesis],
    nominal: Hypothesis,
    data: Data,
    noise: Sequence[NoiseModel],
) -> _Runs | None:
    """None where the device might be hurt, or predictions part from the start."""
    record = _record(entry, candidates[0], data)
    outputs = candidates[0].sensitivity.outputs
    furthest = {n: FURTHEST * max(float(np.abs(r.measured[n]).max()) for r in data.records) for n in outputs}
    tables = []
    for candidate in (*candidates, nominal):
        start = np.append(_rest(candidate), candidate.starts[0, candidate.states :])
        line = candidate.sensitivity.linearise(record, candidate.shared, start, data.steps_per_period)
        if line is None or any(np.abs(line.residual[o]).max() > furthest[n] for o, n in enumerate(outputs)):
            return None
        tables.append(np.concatenate((line.residual[None], line.shared, line.own)))
    sizes = np.array([data.size(name) for name in outputs])
    count = tables[0].shape[2]
    end = _together(np.stack([table[0] for table in tables]), sizes)
    if not end:
        return None
    runs = []
    for table in tables[:-1]:
        white = np.stack([model.whiten(table[:, o, :end]) for o, model in enumerate(noise)], axis=1)
        runs.append(white.reshape(len(white), -1))
    return _Runs(runs, end == count)


def _together(predicted: FloatArray, sizes: FloatArray) -> int:
    """Samples up to where predictions (candidates, outputs, n) part; `sizes` (outputs,) of the readings so far."""
    apart = predicted.max(axis=0) - predicted.min(axis=0)
    far = np.any(apart > PARTED * sizes[:, None], axis=0)
    return int(np.argmax(far)) if far.any() else predicted.shape[2]


def _least(tables: Sequence[FloatArray], known: Sequence[FloatArray], times: int = 1) -> float:
    """Separation [standard errors] by so many records, of the pair that is hardest to tell apart."""
    often = [np.sqrt(times) * table for table in tables]
    pairs = itertools.permutations(range(len(often)), 2)
    found = min(separation(often[i][0], often[j][0], often[j][1:], known[j]) for i, j in pairs)
    return float(np.sqrt(max(0.0, found)))


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
    """Held as the records so far are, by the same chain; nothing was measured yet."""
    nothing = np.zeros(len(entry.levels))
    peak = {
        name: max(r.stimulus.peak.get(name, 0.0) for r in data.records)
        for name in candidate.sensitivity.outputs
    }
    drive = data.subject.drive
    stimulus = Stimulus(
        inputs={drive: entry.levels}, holds={drive: data.records[0].stimulus.holds[drive]}, period_s=entry.period_s,
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
