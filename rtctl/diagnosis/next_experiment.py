"""The experiment that would decide: of a menu, the input whose least separation between two candidates is largest, as
often as it takes. See `separation`.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.hypothesis import Data, Hypothesis
from rtctl.diagnosis.menu import Input, menu
from rtctl.diagnosis.separation import Played, information, played, rest
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.residual_noise import NoiseModel

DECIDES = 8.0
"""Standard errors between two candidates. Where the data so far are even, 98 % of records that bring 6 leave one by
`search.EQUIVALENT`; but what is to be told apart is known as well as these few data know it, and its square enters.
"""
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


class NextExperiment(NamedTuple):
    """What to measure next."""

    best: Scored
    times: int
    """Records of it."""
    separation: float
    """[standard errors] The least that all of them bring."""
    separates: tuple[str, ...]
    """What the candidates that it sets apart have beside what all of them have."""
    alike: tuple[tuple[str, str], ...]
    """Pairs of the same that no input of the menu sets apart."""
    menu: tuple[Scored, ...]

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
        often = f", {self.times} times" if self.times > 1 else ""
        text = (
            f"Measure this next{often}: {self.best.input.statement}. It separates {names} by {self.separation:.3g} "
            "standard errors at least"
        )
        if self.separation < DECIDES:
            text += (
                ", too few to decide: measure longer, with less noise, or drive harder than these data did"
            )
        twins = " or ".join(f"{one} from {other}" for one, other in self.alike)
        return f"{text}." + (f" No input of the menu separates {twins}." if twins else "")

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
        once = dict(self.best.input.scenario)
        return once | {"excitation": [*once["excitation"]] * self.times}

    @property
    def json(self) -> dict[str, Any]:
        """For `diagnosis.json`."""
        return {
            "statement": self.statement,
            "separates": list(self.separates),
            "alike": [list(pair) for pair in self.alike],
            "input": self.best.input.statement,
            "times": self.times,
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
    candidates: Sequence[Hypothesis], nominal: Hypothesis, data: Data, noise: Sequence[NoiseModel],
    units: Mapping[str, str],
) -> NextExperiment | None:  # fmt: skip
    """For two candidates or more; None where there is nothing to separate or nothing that the plant can take.

    What decides only by the beginning of a record, as predictions part, is proposed where nothing else decides. So is
    what the `nominal` model does not follow: it is what the next diagnosis begins with. Pairs that no input of the
    menu separates have no say.
    """
    if len(candidates) < 2:
        return None
    known = [information(candidate, data, noise) for candidate in candidates]
    possible = [
        (entry, brought)
        for entry in menu(data, units)
        if (brought := played(_record(entry, candidates[0], data), candidates, known, nominal, data, noise))
    ]
    if not possible:
        return None
    pairs = list(itertools.combinations(range(len(candidates)), 2))
    alike = [pair for pair in pairs if max(one.separation(*pair) for _, one in possible) < ALIKE]
    counted = [pair for pair in pairs if pair not in alike] or pairs

    def least(brought: Played, times: int = 1) -> float:
        return min(brought.separation(*pair, times) for pair in counted)

    ranking = sorted(
        ((Scored(entry, least(brought), brought.whole), brought) for entry, brought in possible),
        key=lambda one: -one[0].separation,
    )
    best, times, apart = _chosen(
        [(scored, *_repeated(partial(least, brought))) for scored, brought in ranking]
    )
    common = set.intersection(*(set(candidate.mechanisms) for candidate in candidates))
    names = [" + ".join(one for one in found.mechanisms if one not in common) for found in candidates]
    told = dict.fromkeys(names[k] for pair in counted for k in pair)
    return NextExperiment(
        best, times, apart, tuple(told), tuple((names[i], names[j]) for i, j in alike),
        tuple(scored for scored, _ in ranking),
    )  # fmt: skip


def _chosen(proposals: Sequence[tuple[Scored, int, float]]) -> tuple[Scored, int, float]:
    """That which decides with the fewest records, without predictions that part if there is one; else that which brings
    most with all of them.

    It may be another than the best of one record: what that owes to the data so far does not grow with their number.
    """
    deciding = [one for one in proposals if one[2] >= DECIDES]
    if not deciding:
        return max(proposals, key=lambda one: one[2])
    return min([one for one in deciding if one[0].whole] or deciding, key=lambda one: (one[1], -one[2]))


def _repeated(least: Callable[[int], float]) -> tuple[int, float]:
    """How many records of an input decide, and what they separate; MOST_TIMES where no number up to it does, once
    where it would be in vain.
    """
    apart = least(1)
    if apart >= DECIDES or apart < ALIKE:
        return 1, apart
    few, many, apart = 1, MOST_TIMES, least(MOST_TIMES)
    while apart >= DECIDES and many - few > 1:  # it grows with their number
        middle = (few + many) // 2
        if (there := least(middle)) >= DECIDES:
            many, apart = middle, there
        else:
            few = middle
    return many, apart


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
        initial=dict(zip(candidate.simulation.state, rest(candidate).tolist(), strict=True)), peak=peak,
    )  # fmt: skip
    return FitRecord(
        name="next", stimulus=stimulus, measured=dict.fromkeys(candidate.sensitivity.outputs, nothing)
    )
