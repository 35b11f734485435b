"""The rows of the targets: what is to be reached, and what each way of diagnosing reached on the same cases."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from further import resolved, resolved_but_for_equivalents
from judge import NO_ANSWER, judged, wrong_alone
from rates import Line, Rate, markdown, rate

GOOD = ("right", "set")
SEEN = 0.1
"""Miss of the re-fitted nominal model over the noise, from which on an effect is to be seen."""
FULL = 80_000
"""Samples to fit of a case of full size: 5 records of 16,000."""


class Row(NamedTuple):
    """One target; `cases` and `hit` of lines as judged, `at_most` where fewer is better."""

    name: str
    cases: Callable[[Line], bool]
    hit: Callable[[Line], bool]
    reach: dict[str, float]
    """By plant."""
    at_most: bool = False
    of_program_only: bool = False


def _of_kind(kind: str) -> Callable[[Line], bool]:
    return lambda line: line["kind"] == kind


def _is(*judgements: str) -> Callable[[Line], bool]:
    return lambda line: line["judgement"] in judgements


def _both(share: float) -> dict[str, float]:
    return {"oscillator": share, "vo2": share}


ROWS = (
    Row("nothing hidden: something said to be wrong", _of_kind("null"), _is("false", *NO_ANSWER), _both(0.05),
        at_most=True),
    Row("one effect: its id first, or in a set of two", _of_kind("single"), _is(*GOOD),
        {"oscillator": 0.95, "vo2": 0.90}),
    Row("one effect: a single wrong name claimed alone", _of_kind("single"), wrong_alone, _both(0.01), at_most=True),
    Row("two effects: both and only both", _of_kind("pair"), _is(*GOOD), _both(0.85)),
    Row("outside the catalogue: nothing false named", _of_kind("outside"), _is("right"), _both(0.90)),
    Row("outside the catalogue: said to be `unexplained`", _of_kind("outside"),
        lambda line: line["verdict"] == "unexplained", {}, of_program_only=True),
    Row(f"seen where the re-fitted nominal model misses by {SEEN:g} of the noise or more",
        lambda line: line["kind"] != "null" and line["miss_over_noise"] >= SEEN,
        lambda line: line["verdict"] not in ("adequate", *NO_ANSWER), _both(0.95)),
)  # fmt: skip


def figures(lines: Sequence[Line], ambiguous: Sequence[Line]) -> str:
    """Target beside measured, by plant; the baselines on the oscillators."""
    rows = []
    for row in ROWS:
        for plant in ("oscillator", "vo2"):
            cases = [line for line in lines if line["plant"] == plant and row.cases(line)]
            if not cases and plant not in row.reach:
                continue
            measured = rate(cases, row.hit)
            rows.append((
                f"{row.name} ({plant})", _target(row, plant), str(measured), _reached(row, plant, measured),
                *(("", "") if row.of_program_only else (_baseline(cases, row, name) for name in ("bic", "sindy"))),
            ))  # fmt: skip
    rows += [*_errors(lines), *_next(ambiguous), *_time(lines)]
    return markdown(
        ("", "to reach", "rtctl diagnose", "reached", "lowest BIC alone", "discrepancy-SINDy"), rows
    )


def as_baseline(line: Line, name: str) -> Line:
    """The line as that way of diagnosing would have it."""
    other = line | line[name]
    return other | {"judgement": judged(other)}


def _baseline(cases: Sequence[Line], row: Row, name: str) -> str:
    return str(rate([as_baseline(line, name) for line in cases if name in line], row.hit))


def _target(row: Row, plant: str) -> str:
    if plant not in row.reach:
        return ""
    return f"at {'most' if row.at_most else 'least'} {100 * row.reach[plant]:g} %"


def _reached(row: Row, plant: str, measured: Rate) -> str:
    if plant not in row.reach or not measured.total:
        return ""
    return _yes(measured.share <= row.reach[plant] if row.at_most else measured.share >= row.reach[plant])


def _yes(reached: bool) -> str:
    return "yes" if reached else "no"


def _errors(lines: Sequence[Line]) -> list[tuple[str, ...]]:
    rows = []
    for plant in ("oscillator", "vo2"):
        errors = [
            line["test_error_over_noise"] for line in lines
            if line["plant"] == plant and line["verdict"] == "explained" and line.get("test_error_over_noise")
        ]  # fmt: skip
        if errors:
            low, middle, high = np.percentile(errors, [25, 50, 75])
            text = f"{middle:.3f} (middle half {low:.3f} to {high:.3f}, {len(errors)} cases)"
            name = f"test error after extension over the noise, median ({plant})"
            rows.append((name, "at most 1.1", text, _yes(middle <= 1.1), "", ""))
    return rows


def _next(ambiguous: Sequence[Line]) -> list[tuple[str, ...]]:
    cases = [line for line in ambiguous if "proposed" in line.get("next", {}) and separable(line)]
    said = [line for line in cases if line["next"].get("decides")]
    rows = []
    for name, chosen, holds, goal in (
        ("the next experiment resolves an ambiguous case", cases, resolved, "at least 95 %"),
        ("the same, where it is said to decide", said, resolved, "at least 95 %"),
        ("it leaves nothing but the same law by construction", cases, resolved_but_for_equivalents, ""),
    ):
        if not chosen:
            rows.append((name, goal, "-", "", "", ""))
            continue
        measured, chance = (
            rate(chosen, lambda line, which=which, holds=holds: holds(line, which))
            for which in ("proposed", "random")
        )
        text = f"{measured}; as many random records of its menu {chance}"
        rows.append((name, goal, text, _yes(measured.share >= 0.95) if goal else "", "", ""))
    return rows


def separable(line: Line) -> bool:
    """Whether the truth is among what is left and something else than its equivalents by construction is."""
    names, truth = set(line["next"]["names"]), set(line["truth"])
    return truth <= names and bool(names - truth - set(line["equivalent"]))


def _time(lines: Sequence[Line]) -> list[tuple[str, ...]]:
    rows = []
    for name, wanted in (("of full size", True), ("of all cases", False)):
        for plant in ("oscillator", "vo2"):
            chosen = [x["cpu_s"] for x in lines if x["plant"] == plant and "cpu_s" in x
                      and (not wanted or (plant == "oscillator" and x["samples"] >= FULL))]  # fmt: skip
            if not chosen:
                continue
            middle, worst = float(np.median(chosen)), max(chosen)
            late = sum(x["verdict"] == "timeout" for x in lines if x["plant"] == plant)
            text = f"{middle:.1f} s, {worst:.1f} s ({len(chosen)} cases)"
            text += f", {late} over their time" if late else ""
            report = wanted or plant == "vo2"
            rows.append((
                f"processor time {name}, median and worst ({plant})", "30 s, 90 s" if report else "", text,
                _yes(middle <= 30.0 and worst <= 90.0 and not late) if report else "", "", "",
            ))  # fmt: skip
    return rows


def known(line: Line) -> dict[str, Any]:
    """A line of a case that died, as one that the tables can read."""
    died = line.get("died")
    if died is None:
        return line
    if line.get("judgement") is not None:  # the diagnosis was done; what came after it was not
        return line
    verdict = {"verdict": died, "causes": [], "judgement": died}
    return line | verdict if "kind" in line else line | verdict | {"kind": "not generated", "truth": []}
