"""The experiment that would decide: inputs that set the two closest candidates apart with the fewest records.

The inputs are chosen from a menu of candidate inputs, see `candidate_inputs`; `t_optimality` scores them and `design`
chooses the number of records.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.experiment_design.candidate_inputs import (
    CandidateInput,
    limit_band,
    list_candidate_inputs,
)
from rtctl.diagnosis.experiment_design.design import Design, ScoredInput, find_design
from rtctl.diagnosis.experiment_design.t_optimality import (
    Comparison,
    compare_candidates,
    compute_information,
    find_rest_state,
)
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.thresholds import ExperimentThresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.noise.residual_noise import NoiseModel
from rtctl.output.readable_units import readable


class NextExperiment(NamedTuple):
    """What to measure next, and what it separates."""

    plan: Design
    """Inputs and the number of records of each."""
    separates: tuple[str, ...]
    """Mechanisms of the candidates that the design separates, without those that all candidates have."""
    alike: tuple[tuple[str, str], ...]
    """Pairs of mechanisms that no input of the menu separates."""
    menu: tuple[ScoredInput, ...]
    """All candidate inputs, best first."""
    nearest: bool = False
    """Whether the candidates are no causes, only those that come nearest to what the data show."""
    limits: ExperimentThresholds = ExperimentThresholds()
    """Thresholds of the design."""

    @property
    def best(self) -> ScoredInput:
        """Input of the first record."""
        return self.plan.records[0][0]

    @property
    def times(self) -> int:
        """Number of records of all inputs."""
        return self.plan.times

    @property
    def duration_s(self) -> float:
        """Time [s] that the device is driven for all records, without pauses between them."""
        return sum(
            times * len(scored.input.levels) * scored.input.period_s for scored, times in self.plan.records
        )

    @property
    def separation(self) -> float:
        """Separation of the two closest candidates by all records [standard errors]."""
        return self.plan.separation

    @property
    def in_vain(self) -> bool:
        """Whether no input of the menu separates anything."""
        return self.separation < self.limits.alike_separation

    @property
    def decides(self) -> bool:
        """Whether the records suffice to decide between the candidates."""
        return self.separation >= self.limits.deciding_separation

    @property
    def statement(self) -> str:
        """Proposal in words."""
        if self.in_vain:
            return (
                f"No input of the menu separates {_join_names(self.separates)}: to each of them, within the drive that "
                f"these data have, they answer alike. The best is {self.best.input.statement}."
            )
        groups = [" or ".join(twins) for twins in self._twins]
        names = _join_names(groups)
        if self.decides:
            text = (
                f"Measure this next{self._what} {names} by {self.separation:.3g} standard errors at least, and the "
                f"device is driven for {readable(self.duration_s, 's', 3)} in all"
            )
        else:
            often = f", {self.times} times" if self.times > 1 else ""
            text = (
                f"No input of the menu decides between {' and '.join(groups)} as these data were measured: the best, "
                f"{self._inputs}{often}, separates them by {self.separation:.3g} standard errors, and "
                f"{self.limits.deciding_separation:.3g} are needed. What is missing: longer records, less noise, or a "
                "stronger drive than these data had"
            )
        if self.nearest:
            text += "; neither explains these data, they only come nearest"
        twins = " or ".join(f"{one} from {other}" for one, other in self.alike)
        return f"{text}." + (f" No input of the menu separates {twins}." if twins else "")

    @property
    def _what(self) -> str:
        """Words after "Measure this next": number of records, inputs, and the verb."""
        if len(self.plan.records) > 1:
            return f", {self.times} records: {self._inputs}. Together they separate"
        often = f", {self.times} times" if self.times > 1 else ""
        return f"{often}: {self._inputs}. It separates"

    @property
    def _inputs(self) -> str:
        """Inputs in words, with the number of records of each if there is more than one input."""
        if len(self.plan.records) == 1:
            return self.best.input.statement
        return "; ".join(f"{times} x {scored.input.statement}" for scored, times in self.plan.records)

    @property
    def _twins(self) -> list[list[str]]:
        """Mechanisms that the design separates, in groups that no input separates."""
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
        """Scenario as `rtctl acquire` reads it: one excitation table a record."""
        tables = [
            table
            for scored, times in self.plan.records
            for table in [*scored.input.scenario["excitation"]] * times
        ]
        return dict(self.best.input.scenario) | {"excitation": tables}

    @property
    def json(self) -> dict[str, Any]:
        """Proposal as `diagnosis.json` holds it."""
        return {
            "statement": self.statement,
            "separates": list(self.separates),
            "alike": [list(pair) for pair in self.alike],
            "input": self._inputs,
            "times": self.times,
            "duration_s": self.duration_s,
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


def _join_names(names: Sequence[str]) -> str:
    """Return names in words: "a from b", or "a, b and c"."""
    *first, last = names
    return f"{', '.join(first)} {'from' if len(first) == 1 else 'and'} {last}"


def propose_experiment(
    candidates: Sequence[Hypothesis], nominal: Hypothesis, problem: Problem, noise: Sequence[NoiseModel],
    units: Mapping[str, str], *, nearest: bool = False,
) -> NextExperiment | None:  # fmt: skip
    """Propose the experiment that separates the two closest candidates with the fewest records.

    An input under which predictions, that of the nominal model included, take different courses decides only by the
    initial part of a record; it is proposed where no other decides. Pairs that no input separates are left out.

    Args:
        candidates: Fitted candidates.
        nominal: The fitted nominal model, from which the next diagnosis starts.
        problem: Records to fit, their scales and the thresholds.
        noise: Noise model of each output.
        units: Units of the dataset's channels, by name.
        nearest: Whether the candidates are no causes, only the two that come nearest to what the data show.

    Returns:
        The proposal; None where there are fewer than two candidates, or no input that the plant can take.
    """
    if len(candidates) < 2:
        return None
    known = [compute_information(candidate, problem, noise) for candidate in candidates]

    def compare(candidate_input: CandidateInput, *, settled: bool = False) -> Comparison | None:
        record = _make_record(candidate_input, candidates[0], problem)
        return compare_candidates(record, candidates, nominal, problem, noise, settled=settled)

    options = [
        (candidate_input, comparison)
        for candidate_input in list_candidate_inputs(problem, units)
        if (comparison := compare(candidate_input))
    ]
    if not options:
        return None
    limits = problem.thresholds.experiment
    choice = _choose_inputs(options, known, lambda one: compare(one, settled=True), limits)
    common = set.intersection(*(set(candidate.mechanisms) for candidate in candidates))
    names = [" + ".join(own for own in one.mechanisms if own not in common) for one in candidates]
    separates = dict.fromkeys(names[k] for pair in choice.counted for k in pair)
    alike = tuple((names[i], names[j]) for i, j in choice.alike)
    return NextExperiment(choice.plan, tuple(separates), alike, choice.menu, nearest, limits)


class _Choice(NamedTuple):
    """The chosen design, with all inputs and the pairs of candidates that it separates."""

    plan: Design
    """The design."""
    menu: tuple[ScoredInput, ...]
    """All inputs by their separation with one record, best first."""
    counted: list[tuple[int, int]]
    """Pairs of candidates that count for a separation."""
    alike: list[tuple[int, int]]
    """Pairs of candidates that no input separates."""


def _choose_inputs(
    options: Sequence[tuple[CandidateInput, Comparison]], known: Sequence[FloatArray],
    settle: Callable[[CandidateInput], Comparison | None], limits: ExperimentThresholds,
) -> _Choice:  # fmt: skip
    """Find the design, until all of its inputs are compared with settled initial states.

    Sensitivities at rest promise more separation than a record brings whose initial state is free.

    Args:
        options: Candidate inputs with their comparisons.
        known: Information (p, p) of each candidate from the data so far.
        settle: Compares the candidates under an input with settled initial states.
        limits: Thresholds of the design.
    """
    pairs = list(itertools.combinations(range(len(known)), 2))
    comparisons, done = [comparison for _, comparison in options], set[int]()
    while True:
        alike = [
            pair
            for pair in pairs
            if max(one.separation(*pair, known) for one in comparisons) < limits.alike_separation
        ]
        counted = [pair for pair in pairs if pair not in alike] or pairs

        def least(comparison: Comparison, counted: Sequence[tuple[int, int]] = counted) -> float:
            return min(comparison.separation(*pair, known) for pair in counted)

        proposals = [
            (ScoredInput(candidate_input, least(comparison), comparison.whole), comparison)
            for (candidate_input, _), comparison in zip(options, comparisons, strict=True)
        ]
        proposals.sort(key=lambda proposal: -proposal[0].separation)
        design = find_design(proposals, least, limits)
        unsettled = {id(scored.input) for scored, _ in design.records} - done
        if not unsettled:
            return _Choice(design, tuple(scored for scored, _ in proposals), counted, alike)
        done |= unsettled
        comparisons = [
            (settle(candidate_input) if id(candidate_input) in unsettled else None) or comparison
            for (candidate_input, _), comparison in zip(options, comparisons, strict=True)
        ]


def _make_record(candidate_input: CandidateInput, candidate: Hypothesis, problem: Problem) -> FitRecord:
    """Return a record of an input that is not measured yet: held as the records so far are, with readings of zero.

    Args:
        candidate_input: The input.
        candidate: A candidate, of which the record begins at rest.
        problem: Records to fit, which show how the drive is held between samples.
    """
    drive = problem.subject.drive
    hold = problem.records[0].stimulus.holds[drive]
    levels, period_s = candidate_input.levels, candidate_input.period_s
    if hold == "band-limited":
        levels = limit_band(levels, 2.0 * np.pi / (problem.scales.rate * period_s))
    outputs = candidate.sensitivity.outputs
    peak = {name: max(r.stimulus.peak.get(name, 0.0) for r in problem.records) for name in outputs}
    state = find_rest_state(candidate).tolist()
    stimulus = Stimulus(
        inputs={drive: levels}, holds={drive: hold}, period_s=period_s,
        initial=dict(zip(candidate.simulation.state, state, strict=True)), peak=peak,
    )  # fmt: skip
    return FitRecord(
        name="next", stimulus=stimulus, measured=dict.fromkeys(outputs, np.zeros(len(candidate_input.levels)))
    )
