"""Two programs on the same blind cases: rates and times in one table, and every case that they answer otherwise.

python tests/blind/compare.py before/cases.jsonl after/cases.jsonl
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from figures import FULL, ROWS
from rates import Line, markdown, rate

PLANTS = ("oscillator", "vo2")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables of the cases that both have."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("before", type=Path, help="cases.jsonl of a campaign")
    parser.add_argument("after", type=Path, help="cases.jsonl of another program on the same seeds")
    asked = parser.parse_args(arguments)
    print(compare(read_cases(asked.before), read_cases(asked.after)))
    return 0


def read_cases(path: Path) -> dict[tuple[str, int], Line]:
    """The last line of each plant and seed."""
    from campaign import read

    return {(line["plant"], line["seed"]): line for line in read(path) if line["sort"] == "main"}


def compare(before: dict[tuple[str, int], Line], after: dict[tuple[str, int], Line]) -> str:
    """Rates of the cases that both have, and how many of them are answered alike."""
    common = sorted(before.keys() & after.keys())
    pairs = [(before[key], after[key]) for key in common]
    rows = []
    for plant in PLANTS:
        own = [pair for pair in pairs if pair[0]["plant"] == plant]
        for row in ROWS:
            shown = [[line for line in lines if row.cases(line)] for lines in zip(*own, strict=True)]
            if shown and any(shown):
                rows.append((f"{row.name} ({plant})", *(str(rate(lines, row.hit)) for lines in shown)))
        rows += _times(own, plant)
    return "\n\n".join([
        f"{len(common)} cases that both programs have answered: {_commits(before)} before, {_commits(after)} after.",
        markdown(("", "before", "after"), rows),
        _differences(pairs),
    ])  # fmt: skip


def _times(pairs: Sequence[tuple[Line, Line]], plant: str) -> list[tuple[str, ...]]:
    found = []
    sizes = {"all cases": lambda line: True, "full size": lambda line: line["samples"] >= FULL}
    for name, belongs in sizes.items():
        times = [[line["cpu_s"] for line in pair] for pair in pairs if belongs(pair[0]) and _timed(pair)]
        if times and (name == "all cases" or plant == "oscillator"):
            cells = [
                f"{np.median(one):.1f} s, {max(one):.1f} s ({len(one)} cases)"
                for one in zip(*times, strict=True)
            ]
            found.append((f"processor time, {name}, median and worst ({plant})", *cells))
    return found


def _timed(pair: tuple[Line, Line]) -> bool:
    return all("cpu_s" in line for line in pair)


def _answer(line: Line) -> str:
    causes = " + ".join(" or ".join([cause["id"], *cause["or"]]) for cause in line.get("causes", ()))
    return f"{line['verdict']}{': ' if causes else ''}{causes}"


def _differences(pairs: Sequence[tuple[Line, Line]]) -> str:
    others = [pair for pair in pairs if _answer(pair[0]) != _answer(pair[1])]
    alike = f"Verdict and causes are the same in {len(pairs) - len(others)} of {len(pairs)}."
    rows = [
        (
            f"{one['plant']} {one['seed']}", " + ".join(one["truth"]) or one["kind"],
            *(f"{_answer(line)} ({line['judgement']})" for line in (one, other)),
        )
        for one, other in others
    ]  # fmt: skip
    return alike + ("\n\n" + markdown(("case", "hidden", "before", "after"), rows) if rows else "")


def _commits(lines: dict[tuple[str, int], Line]) -> str:
    return ", ".join(sorted({line["commit"] for line in lines.values()})) or "nothing"


if __name__ == "__main__":
    raise SystemExit(main())
