"""Every ratio of the benchmarks, three times, beside the last committed table: what got worse by a tenth fails.

    python benchmarks/ratios.py [--only NAME ...] [--repeats 3] [--rounds 15] [--judge]

Each ratio is ours over a peer's of the same run (C, another client, our own nominal model), so a slow machine slows
both. The repeats of a benchmark are spread over the whole run: one of each benchmark, then the next of each. Medians
go to docs/speed.json and into the table of docs/speed.md, to be committed; with `--only`, or `--judge`, nothing is
written. A ratio got worse if it exceeds the one of the last commit by more than a tenth, and by more than its repeats
differ, then or now: one sentence each, and exit 1.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

from ratio import Ratio

ROOT = Path(__file__).resolve().parents[1]
FILE, PAGE = "docs/speed.json", "docs/speed.md"
BEGIN, END = "<!-- ratios -->", "<!-- end of the ratios -->"
BENCHMARKS = (
    "estimator_vs_c", "oscillator_vs_c", "preisach_rows", "equations_vs_builtin", "transactions", "wire_ratios",
    "realtime", "sweep_scaling",
)  # fmt: skip
"""Modules beside this file that have `ratios(rounds)`."""
WORSE = 0.1


@dataclass(frozen=True, kw_only=True)
class Row:
    """A ratio and its repeats."""

    name: str
    peer: str
    by: str
    """The benchmark that measures it."""
    repeats: list[float]
    cost: float
    """Median of ours [unit]."""
    peer_cost: float
    unit: str

    @property
    def ratio(self) -> float:
        """Return the median."""
        return median(self.repeats)

    @property
    def spread(self) -> float:
        """Return by how much the repeats differ."""
        return max(self.repeats) - min(self.repeats)


@dataclass(frozen=True, kw_only=True)
class Table:
    """A run: where, when, and what it found."""

    commit: str
    date: str
    command: str
    machine: dict[str, Any]
    """Cores, processor, and the load average of a minute, at the beginning and at the end."""
    rows: list[Row]
    left_out: list[str] = field(default_factory=list)
    """Benchmarks that could not run, each with its reason."""

    @classmethod
    def read(cls, text: str) -> Table:
        """Of a file's text."""
        content = json.loads(text)
        rows = [Row(**{k: v for k, v in row.items() if k != "ratio"}) for row in content.pop("rows")]
        return cls(rows=rows, **content)

    def text(self) -> str:
        """Return the file's text."""
        rows = [{"ratio": round(row.ratio, 4), **asdict(row)} for row in self.rows]
        return json.dumps(asdict(self) | {"rows": rows}, indent=1, ensure_ascii=False) + "\n"

    def markdown(self) -> str:
        """Return the table for the page."""
        loads = " to ".join(f"{load:.1f}" for load in self.machine["load"])
        lines = [
            f"`{self.command}`, {self.date}, commit {self.commit}; {self.machine['cores']} cores "
            f"({self.machine['processor']}), load {loads}.",
            "",
            "| what | beside | ours | peer | ratio | repeats |",
            "|---|---|---|---|---|---|",
        ]
        lines += [
            f"| {row.name} | {row.peer} | {row.cost:.3g} {row.unit} | {row.peer_cost:.3g} {row.unit} | "
            f"{row.ratio:.2f} | {min(row.repeats):.2f} to {max(row.repeats):.2f} |"
            for row in self.rows
        ]
        return "\n".join([*lines, *(f"\nNot measured: {text}." for text in self.left_out)])


def worse(now: Table, before: Table) -> list[str]:
    """A sentence for each ratio that got worse by more than a tenth and by more than its repeats differ."""
    known = {(row.name, row.peer): row for row in before.rows}
    found = []
    for row in now.rows:
        was = known.get((row.name, row.peer))
        if was is None or row.ratio <= (1.0 + WORSE) * was.ratio:
            continue
        spread = max(row.spread, was.spread)
        if row.ratio - was.ratio > spread:
            found.append(
                f"{row.name}: {row.ratio:.3g} x {row.peer} instead of {was.ratio:.3g} x at {before.commit} "
                f"({before.date}), worse by {row.ratio / was.ratio - 1.0:.0%}; repeats differ by {spread:.2g} "
                f"(benchmarks/{row.by}.py)."
            )
    return found


def measured(names: Sequence[str], repeats: int, rounds: int) -> tuple[list[Row], list[str]]:
    """The rows, and what could not run; one repeat of each benchmark, then the next of each."""
    found: dict[tuple[str, Ratio], list[Ratio]] = defaultdict(list)
    failed: dict[str, str] = {}
    for turn in range(repeats):
        for name in names:
            if name in failed:
                continue
            print(f"{name}, {turn + 1} of {repeats}", file=sys.stderr, flush=True)
            try:
                for one in importlib.import_module(name).ratios(rounds):
                    key = one._replace(cost=0.0, peer_cost=1.0, of_rounds=None)
                    found[name, key].append(one)
            except (Exception, SystemExit) as error:  # the others are measured all the same
                failed[name] = f"{name}: {type(error).__name__}: {error}"
    rows = [
        Row(
            name=key.name, peer=key.peer, by=name, unit=key.unit,
            repeats=[round(one.value, 4) for one in values],
            cost=median(one.cost for one in values), peer_cost=median(one.peer_cost for one in values),
        )
        for (name, key), values in found.items()
    ]  # fmt: skip
    return sorted(rows, key=lambda row: names.index(row.by)), list(failed.values())


def last_committed() -> Table | None:
    """The table of the last commit; None where there is none."""
    done = _git("show", f"HEAD:{FILE}")
    return Table.read(done) if done else None


def commit() -> str:
    """Name of the commit, with `+` where files were changed since."""
    name = _git("rev-parse", "--short", "HEAD") or "unknown"
    return name + ("+" if _git("status", "--porcelain", "--untracked-files=no") else "")


def machine(load_before: float) -> dict[str, Any]:
    """Cores, processor, load."""
    about = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    names = [line.partition(":")[2].strip() for line in about if line.startswith("model name")]
    loads = [round(load_before, 1), round(os.getloadavg()[0], 1)]
    return {"cores": os.cpu_count(), "processor": names[0] if names else "unknown", "load": loads}


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, write, compare."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", choices=BENCHMARKS, help="these benchmarks; writes nothing")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--rounds", type=int, default=15, help="of a repeat, ours and the peer's by turns")
    parser.add_argument("--judge", action="store_true", help="compare, and write nothing")
    asked = parser.parse_args(arguments)
    load, program = os.getloadavg()[0], commit()
    rows, left_out = measured(asked.only or BENCHMARKS, asked.repeats, asked.rounds)
    words = ["python benchmarks/ratios.py", *(["--only", *asked.only] if asked.only else [])]
    for name in ("repeats", "rounds"):
        if getattr(asked, name) != parser.get_default(name):
            words.append(f"--{name} {getattr(asked, name)}")
    now = Table(
        commit=program, date=time.strftime("%Y-%m-%d"), command=" ".join(words), machine=machine(load),
        rows=rows, left_out=left_out,
    )  # fmt: skip
    print(now.markdown())
    before = last_committed()
    if not (asked.only or asked.judge):
        write(now)
    if before is None:
        print(f"there is no {FILE} in the last commit: nothing to compare with")
        return 0
    found = worse(now, before)
    print("\n".join(found) or f"no ratio is worse than at {before.commit} ({before.date})")
    return 1 if found else 0


def write(table: Table) -> None:
    """The file, and the table between its marks in the page."""
    (ROOT / FILE).write_text(table.text(), encoding="utf-8")
    before, rest = (ROOT / PAGE).read_text(encoding="utf-8").split(BEGIN)
    page = f"{before}{BEGIN}\n{table.markdown()}\n{END}{rest.split(END)[1]}"
    (ROOT / PAGE).write_text(page, encoding="utf-8")


def _git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else ""


if __name__ == "__main__":
    sys.exit(main())
