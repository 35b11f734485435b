"""The experiment that would decide: of a menu, the inputs that set the two closest candidates apart with the fewest
records. See `separation`, `record_plan`.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.experiment_design.candidate_inputs import Input, band_limited, menu
from rtctl.diagnosis.experiment_design.design import ALIKE, DECIDES, Planned, Scored, planned
from rtctl.diagnosis.experiment_design.t_optimality import Played, information, played, rest
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import NoiseModel


class NextExperiment(NamedTuple):
    """What to measure next."""

    plan: Planned
    separates: tuple[str, ...]
    """What the candidates that it sets apart have beside what all of them have."""
    alike: tuple[tuple[str, str], ...]
    """Pairs of the same that no input of the menu sets apart."""
    menu: tuple[Scored, ...]
    nearest: bool = False
    """Whether the candidates are no causes, only those that come nearest to what the data show."""

    @property
    def best(self) -> Scored:
        """The input that the plan begins with."""
        return self.plan.records[0][0]

    @property
    def times(self) -> int:
        """Records of all inputs."""
        return self.plan.times

    @property
    def separation(self) -> float:
        """[standard errors] The least that all of them bring."""
        return self.plan.separation

    @property
    def in_vain(self) -> bool:
        """Whether the best of the menu separates nothing."""
        return self.separation < ALIKE

    @property
    def statement(self) -> str:
        """For a person."""
        if self.in_vain:
            return (
                f"No input of the menu separates {_apart(self.separates)}: to each of them, within the drive that "
                f"these data have, they answer alike. The best is {self.best.input.statement}."
            )
        names = _apart([" or ".join(twins) for twins in self._twins])
        text = f"Measure this next{self._what} {names} by {self.separation:.3g} standard errors at least"
        if self.separation < DECIDES:
            text += (
                ", too few to decide: measure longer, with less noise, or drive harder than these data did"
            )
        if self.nearest:
            text += "; neither explains these data, they only come nearest"
        twins = " or ".join(f"{one} from {other}" for one, other in self.alike)
        return f"{text}." + (f" No input of the menu separates {twins}." if twins else "")

    @property
    def _what(self) -> str:
        """What follows "Measure this next": how often, what, what it does."""
        if len(self.plan.records) > 1:
            return f", {self.times} records: {self._inputs}. Together they separate"
        often = f", {self.times} times" if self.times > 1 else ""
        return f"{often}: {self._inputs}. It separates"

    @property
    def _inputs(self) -> str:
        """Of more than one, with the records of each."""
        if len(self.plan.records) == 1:
            return self.best.input.statement
        return "; ".join(f"{times} x {scored.input.statement}" for scored, times in self.plan.records)

    @property
    def _twins(self) -> list[list[str]]:
        """What it sets apart, those that no input does together."""
        pairs = [set(pair) for pair in self.alike]
        groups: list[list[str]] = []
        for name in self.separates:
            home = next((group for group in groups if any({name, one} in pairs for one in group)), None)
            if home is None:
                groups.append([name])
            else:
                home.append(name)
        return groups

    @property
    def scenario(self) -> dict[str, Any]:
        """As `rtctl acquire` takes it: a table of excitation a record."""
        tables = [
            table
            for scored, times in self.plan.records
            for table in [*scored.input.scenario["excitation"]] * times
        ]
        return dict(self.best.input.scenario) | {"excitation": tables}

    @property
    def json(self) -> dict[str, Any]:
        """For `diagnosis.json`."""
        return {
            "statement": self.statement,
            "separates": list(self.separates),
            "alike": [list(pair) for pair in self.alike],
            "input": self._inputs,
            "times": self.times,
            "records": [
                {"input": scored.input.statement, "times": times} for scored, times in self.plan.records
            ],
            "separation": self.separation,
            "scenario": "next-experiment.toml",
            "menu": [
                {"input": one.input.statement, "separation": one.separation, "whole": one.whole}
                for one in self.menu
            ],
        }


def _apart(names: Sequence[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} {'from' if len(first) == 1 else 'and'} {last}"


def next_experiment(
    candidates: Sequence[Hypothesis], nominal: Hypothesis, problem: Problem, noise: Sequence[NoiseModel],
    units: Mapping[str, str], *, nearest: bool = False,
) -> NextExperiment | None:  # fmt: skip
    """For two candidates or more, or the two that come `nearest` where none is a cause; None
    where there is nothing to separate or nothing that the plant can take.

    What decides only by the beginning of a record, as predictions part, is proposed where nothing else decides. So is
    what the `nominal` model does not follow: it is what the next diagnosis begins with. Pairs that no input of the
    menu separates have no say.
    """
    if len(candidates) < 2:
        return None
    known = [information(candidate, problem, noise) for candidate in candidates]
    possible = [
        (entry, brought)
        for entry in menu(problem, units)
        if (brought := played(_record(entry, candidates[0], problem), candidates, nominal, problem, noise))
    ]
    if not possible:
        return None

    def settled(entry: Input) -> Played | None:
        record = _record(entry, candidates[0], problem)
        return played(record, candidates, nominal, problem, noise, settled=True)

    found = _chosen(possible, known, settled)
    common = set.intersection(*(set(candidate.mechanisms) for candidate in candidates))
    names = [" + ".join(own for own in one.mechanisms if own not in common) for one in candidates]
    report = dict.fromkeys(names[k] for pair in found.counted for k in pair)
    return NextExperiment(
        found.plan, tuple(report), tuple((names[i], names[j]) for i, j in found.alike), found.menu, nearest
    )


class _Chosen(NamedTuple):
    """The plan, all inputs by what one record brings, and the pairs that it sets apart and that none does."""

    plan: Planned
    menu: tuple[Scored, ...]
    counted: list[tuple[int, int]]
    alike: list[tuple[int, int]]


def _chosen(
    possible: Sequence[tuple[Input, Played]], known: Sequence[FloatArray],
    settled: Callable[[Input], Played | None],
) -> _Chosen:  # fmt: skip
    """`known` of each candidate: its `information`.

    The plan's inputs are played again until all are `settled`: of records that may begin anywhere slopes at rest
    promise more than they hold.
    """
    pairs = list(itertools.combinations(range(len(known)), 2))
    brought, done = [one for _, one in possible], set[int]()
    while True:
        alike = [pair for pair in pairs if max(one.separation(*pair, known) for one in brought) < ALIKE]
        counted = [pair for pair in pairs if pair not in alike] or pairs

        def least(one: Played, counted: Sequence[tuple[int, int]] = counted) -> float:
            return min(one.separation(*pair, known) for pair in counted)

        made = [
            (Scored(entry, least(one), one.whole), one)
            for (entry, _), one in zip(possible, brought, strict=True)
        ]
        made.sort(key=lambda one: -one[0].separation)
        plan = planned(made, least)
        wanted = {id(scored.input) for scored, _ in plan.records} - done
        if not wanted:
            return _Chosen(plan, tuple(scored for scored, _ in made), counted, alike)
        done |= wanted
        brought = [
            (settled(entry) if id(entry) in wanted else None) or one
            for (entry, _), one in zip(possible, brought, strict=True)
        ]


def _record(entry: Input, candidate: Hypothesis, problem: Problem) -> FitRecord:
    """Held as the records so far are, by the same chain; nothing was measured yet."""
    drive = problem.subject.drive
    hold = problem.records[0].stimulus.holds[drive]
    levels = entry.levels
    if hold == "band-limited":
        levels = band_limited(levels, 2.0 * np.pi / (problem.scales.rate * entry.period_s))
    nothing = np.zeros(len(entry.levels))
    peak = {
        name: max(r.stimulus.peak.get(name, 0.0) for r in problem.records)
        for name in candidate.sensitivity.outputs
    }
    stimulus = Stimulus(
        inputs={drive: levels}, holds={drive: hold}, period_s=entry.period_s,
        initial=dict(zip(candidate.simulation.state, rest(candidate).tolist(), strict=True)), peak=peak,
    )  # fmt: skip
    return FitRecord(
        name="next", stimulus=stimulus, measured=dict.fromkeys(candidate.sensitivity.outputs, nothing)
    )
