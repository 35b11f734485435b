"""The campaign whose figures are reported: 120 oscillators and 60 VO2 actuators, at one commit, by seeds never seen.

python tests/foreign/foreign_final.py --out DIR [--workers 2]     (a stopped campaign continues)
python tests/foreign/foreign_final.py --out DIR --table           (the tables of what is done)

Styles take turns, so that what a stopped campaign has done is of all of them. A third of the oscillators and half of
the actuators are of styles that were kept back: nobody who works on the program has looked at a case of them.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from foreign_campaign import read_results, run_case, wilson

Found = dict[str, Any]


class Part(NamedTuple):
    """Cases of one style."""

    kind: str
    style: str
    first: int
    cases: int

    def name(self, done: Sequence[Found]) -> str:
        """The style, with the first and the last seed that is done."""
        seeds = [case["seed"] for case in done]
        return f"`{self.style}` {min(seeds)} to {max(seeds)}"


PARTS = (
    Part("oscillator", "torsion_balance", 63, 40),
    Part("vo2", "sputtered_cantilever", 47, 30),
    Part("oscillator", "mems", 664, 27),
    Part("oscillator", "afm_cantilever", 673, 27),
    Part("oscillator", "aerospace_panel", 634, 26),
    Part("vo2", "nanoribbon", 662, 15),
    Part("vo2", "buckled_bridge", 603, 15),
)
KEPT_BACK = ("torsion_balance", "sputtered_cantilever")
KINDS = {"oscillator": "oscillators", "vo2": "VO2 actuators"}
HEADS = (
    "", "cases", "nothing hidden: `adequate`", "one effect: its id first or in a set of two", "a wrong name alone",
    "two effects exactly; in sets of two; one of them", "identify and diagnose, median and worst [s]",
)  # fmt: skip
BINS = (0.0, 0.5, 0.8, 0.95, 0.99, 1.0)


def order(parts: Sequence[Part] = PARTS) -> Iterator[tuple[Part, int]]:
    """Parts and seeds in the order in which they are run: each part in proportion to its cases."""
    places = [((k + 0.5) / part.cases, part, part.first + k) for part in parts for k in range(part.cases)]
    for _, part, seed in sorted(places):
        yield part, seed


def row(name: str, cases: Sequence[Found]) -> list[str]:
    """Cells of a row of the table."""
    hidden = [(case["effect"] is not None) + bool(case["second"]) for case in cases]
    nulls, singles, pairs = (
        [case["outcome"] for case, count in zip(cases, hidden, strict=True) if count == wanted]
        for wanted in range(3)
    )
    seconds = [case["identify_s"] + case["diagnose_s"] for case in cases]
    both = "; ".join([share(pairs, "right"), str(pairs.count("in sets")), str(pairs.count("partly"))])
    cells = [
        name,
        str(len(cases)),
        share(nulls, "right"),
        share(singles, "right"),
        share(nulls + singles, "wrong"),
    ]
    return [*cells, both if pairs else "–", f"{median(seconds):.0f}, {max(seconds):.0f}"]


def share(outcomes: Sequence[str], wanted: str) -> str:
    """How many of how many, with the 95 % interval."""
    hits = outcomes.count(wanted)
    low, high = wilson(hits, len(outcomes))
    return f"{hits} of {len(outcomes)} ({100 * low:.0f} to {100 * high:.0f} %)" if outcomes else "–"


def tables(cases: Sequence[Found]) -> str:
    """The rows by style, kind, kept-back styles and convention, then how often stated probabilities are true."""
    kind_of = {part.style: part.kind for part in PARTS}
    rows: list[list[str]] = []
    for part in PARTS:
        mine = [case for case in cases if case["style"] == part.style]
        rows += [row(part.name(mine), mine)] if mine else []
    for kind, name in KINDS.items():
        of_kind = [case for case in cases if kind_of[case["style"]] == kind]
        kept = [case for case in of_kind if case["style"] in KEPT_BACK]
        groups = {group for case in of_kind for group in case["groups"] if group.startswith("read at")}
        rows += [row(f"**{name}**", of_kind)] if of_kind else []
        rows += [row(f"{name}, kept back", kept)] if kept else []
        rows += [
            row(f"{name}, {group}", [case for case in of_kind if group in case["groups"]])
            for group in sorted(groups)
        ]
    lines = ["| " + " | ".join(HEADS) + " |", "|" + "---|" * len(HEADS)]
    lines += ["| " + " | ".join(cells) + " |" for cells in rows]
    return "\n".join([*lines, "", *calibration(cases), ""])


def calibration(cases: Sequence[Found]) -> list[str]:
    """Of the probabilities that were stated, by bins, which share was of a true answer."""
    lines = ["| stated probability | answers | right |", "|---|---|---|"]
    for low, high in zip(BINS[:-1], BINS[1:], strict=True):
        mine = [
            case for case in cases if case["probability"] is not None and low < case["probability"] <= high
        ]
        if mine:
            mean = sum(case["probability"] for case in mine) / len(mine)
            true = ["right" if case["outcome"] in ("right", "in sets", "partly") else "" for case in mine]
            lines.append(f"| {low:g} to {high:g}, mean {mean:.3f} | {len(mine)} | {share(true, 'right')} |")
    return lines


def main() -> None:
    """Run the cases that are not done yet, then print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument(
        "--table", action="store_true", help="print the tables of what is done, and run nothing"
    )
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    results = given.out / "results.jsonl"
    cases = read_results(results)
    done = {(case["style"], case["seed"]) for case in cases}
    wanted = [] if given.table else [(part, seed) for part, seed in order() if (part.style, seed) not in done]
    with ThreadPoolExecutor(given.workers) as pool:
        runs = [
            pool.submit(run_case, part.style, seed, given.out / f"{part.style}-{seed}", part.kind, "all")
            for part, seed in wanted
        ]
        for run in as_completed(runs):
            case = asdict(run.result())
            cases.append(case)
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(case) + "\n")
            print(f"{len(cases)}: {case['style']} {case['seed']}: {case['outcome']}", flush=True)
    print(tables([case for case in cases if case["effect"] != "?"]))  # which could not be drawn


if __name__ == "__main__":
    main()
