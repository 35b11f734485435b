"""Every kind of fault on every wire, at two strengths: what the device did, what the loop said, how it came back.

    python benchmarks/fault_campaign.py [--count 34] [--rounds 1] [--wires serial,modbus-rtu] [--kinds drop,stall]
                                        [--minutes 60] [--out out/faults] [--page PAGE.md]

Each kind on a wire is a file in --out once it is done, so a campaign goes on where it was stopped; further rounds have
seeds of their own. `several` strikes with three kinds at once, drawn anew in each round.
A served VO2 actuator in a process of its own keeps a journal of what reached the plant; a second process is the faulty
line; a third runs the loop, live, and opens the driver again after each fault. Safe means, by the device's journal
alone: every level is off, the device's own safe one or inside the host's limits, came by a command that the host sent
as it is, and was held no longer than its lease. Exit 1: something unsafe, unnamed, lost or wrongly believed.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import statistics
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from fault_cells import PERIOD_S, TIMEOUT_S, WATCHDOG_S, Cell

WIRES = ("serial", "modbus-rtu", "modbus-tcp")
WEAK, STRONG = (0.02, 0.0), (0.25, 0.6)
"""Rate a burst, and the quiet time [s] after a fault."""
KINDS: dict[str, tuple[float, float]] = {
    "delay": (0.02, 0.15),
    "jitter": (0.04, 0.25),
    "drop": (0.0, 0.0),
    "duplicate": (0.0, 0.0),
    "reorder": (0.02, 0.15),
    "bit_flip": (0.0, 0.0),
    "truncate": (0.0, 0.0),
    "stall": (0.05, 0.3),
    "disconnect": (0.02, 0.3),
    "device_reboot": (0.0, 0.0),
    "host_pause": (0.05, 0.4),
}
"""Durations [s]: shorter than the timeout, and longer than timeout or watchdog."""
NOT_OF_TCP = ("bit_flip", "truncate")
SEVERAL, AT_ONCE = "several", 3
NONE = "none"
ROWS = (NONE, *KINDS, SEVERAL)
BEGIN, END = "<!-- fault campaign -->", "<!-- end of the fault campaign -->"


class Batch(NamedTuple):
    """A kind of fault on a wire in a round: what is done or not done as a whole."""

    wire: str
    kind: str
    turn: int

    def cells(self, count: int) -> list[Cell]:
        """Weakly and strongly; of the machine alone two runs."""
        if self.kind == NONE:
            return [Cell(wire=self.wire, kind=NONE, struck=(), quiet_s=0.0, count=2, seed=self.turn)]
        return [
            Cell(
                wire=self.wire, kind=self.kind, struck=self._struck(rate, strength), quiet_s=quiet_s, count=count,
                seed=2 * self.turn + strength,
            )
            for strength, (rate, quiet_s) in enumerate((WEAK, STRONG))
        ]  # fmt: skip

    def _struck(self, rate: float, strength: int) -> tuple[tuple[str, float, float], ...]:
        if self.kind != SEVERAL:
            return ((self.kind, rate, KINDS[self.kind][strength]),)
        known = [kind for kind in KINDS if self.wire != "modbus-tcp" or kind not in NOT_OF_TCP]
        drawn = random.Random(f"{self.wire} {self.turn} {strength}").sample(known, AT_ONCE)
        return tuple((kind, rate / AT_ONCE, KINDS[kind][strength]) for kind in drawn)

    @property
    def file(self) -> str:
        """Where what came of it is kept."""
        return f"{self.wire}-{self.kind}-{self.turn}.json"


def batches_of(wire: str, kinds: list[str], rounds: int) -> list[Batch]:
    """All batches of a wire, round by round, the machine alone first."""
    fitting = [kind for kind in kinds if wire != "modbus-tcp" or kind not in NOT_OF_TCP]
    return [Batch(wire, kind, turn) for turn in range(rounds) for kind in (NONE, *fitting)]


def main() -> int:
    """Run, print, and write the table into a page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=34, help="faults of each kind, strength, wire and round")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--wires", default=",".join(WIRES))
    parser.add_argument("--kinds", default=",".join((*KINDS, SEVERAL)))
    parser.add_argument("--together", type=int, default=len(WIRES), help="wires at the same time")
    parser.add_argument("--minutes", type=float, default=math.inf, help="begin nothing new after that")
    parser.add_argument("--out", type=Path, default=Path("out/faults"), help="what is done lies here")
    parser.add_argument("--page", type=Path, help="write the table between its marks")
    arguments = parser.parse_args()
    wires, end_s = arguments.wires.split(","), time.monotonic() + 60.0 * arguments.minutes
    arguments.out.mkdir(parents=True, exist_ok=True)
    done: list[dict[str, Any]] = []

    def run(wire: str) -> None:
        for batch in batches_of(wire, arguments.kinds.split(","), arguments.rounds):
            file = arguments.out / batch.file
            if not file.is_file():
                if time.monotonic() > end_s:
                    return
                run_batch(batch, arguments.count, file)
            done.append(json.loads(file.read_text(encoding="utf-8")))

    with ThreadPoolExecutor(arguments.together) as pool:  # they wait most of the time
        list(pool.map(run, wires))
    table = table_of(done)
    print(table)
    if arguments.page is not None:
        write_table(arguments.page, table)
    bad = sum(len(r["unnamed"]) + abs(r["rows_lost"]) for one in done for r in one["results"])
    bad += sum(len(one["verdict"]["unsafe"]) + one["verdict"]["believed_wrong"] for one in done)
    return 1 if bad else 0


def run_batch(batch: Batch, count: int, file: Path) -> None:
    """Run the cells of a batch, tell them, and keep what came of them, whole or not at all."""
    cells = batch.cells(count)
    *results, verdict = run_wire(cells)
    for cell, result in zip(cells, results, strict=True):
        print(progress_line(cell, result), flush=True)
    print(verdict_line(batch.wire, verdict), flush=True)
    kept = {
        **batch._asdict(),
        "cells": [asdict(cell) for cell in cells],
        "results": results,
        "verdict": verdict,
    }
    partial = file.with_suffix(".partial")
    partial.write_text(json.dumps(kept), encoding="utf-8")
    partial.replace(file)


def run_wire(cells: list[Cell]) -> Any:
    """Yields a result a cell, then the verdict; the host's process is another one, for it will be stopped."""
    worker = Path(__file__).with_name("fault_cells.py")
    with subprocess.Popen(
        [sys.executable, str(worker)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps([asdict(cell) for cell in cells]))
        process.stdin.close()
        for line in process.stdout:
            yield json.loads(line)


def verdict_line(wire: str, verdict: dict[str, Any]) -> str:
    """What the journal says; the first unsafe entries in full."""
    return "\n".join(
        [
            f"{wire:12}journal: unsafe {len(verdict['unsafe'])}, believed wrongly {verdict['believed_wrong']} of "
            f"{verdict['readings']} readings, {verdict['commands']} commands",
            *verdict["unsafe"][:5],
        ]
    )


def progress_line(cell: Cell, result: dict[str, Any]) -> str:
    """One cell in one line."""
    recovery = result["recovery_s"]
    back = f"{1e3 * statistics.median(recovery):.0f} ms" if recovery else "-"
    kinds = "+".join(kind for kind, *_ in cell.struck) or NONE
    return (
        f"{cell.wire:12}{kinds:14} injected {result['injected']:<4}runs {result['runs']:<4}"
        f"named {result['named']} refused {result['refused']} back after {back} rows {result['rows']} "
        f"lost {result['rows_lost']} unnamed {len(result['unnamed'])} in {result['seconds']:.0f} s"
    )


def table_of(done: list[dict[str, Any]]) -> str:
    """The page's table: a row a kind, all wires together; then the totals."""
    rows = [
        "| fault | injected | runs ended by it, as | openings refused | back after, median / longest |",
        "|---|---|---|---|---|",
    ]
    for kind in ROWS:
        if not (found := [result for one in done if one["kind"] == kind for result in one["results"]]):
            continue
        named, refused = Counter[str](), Counter[str]()
        recovery: list[float] = []
        for result in found:
            named.update(result["named"])
            refused.update(result["refused"])
            recovery += result["recovery_s"]
        ends = ", ".join(f"{name} {count}" for name, count in named.most_common()) or "–"
        back = f"{1e3 * statistics.median(recovery):.0f} / {1e3 * max(recovery):.0f} ms" if recovery else "–"
        injected = sum(result["injected"] for result in found)
        name = {NONE: "none (the machine alone)", SEVERAL: f"{AT_ONCE} kinds at once"}.get(kind, kind)
        rows.append(f"| {name} | {injected} | {ends} | {sum(refused.values())} | {back} |")
    return "\n".join([*rows, "", totals_of(done)])


def totals_of(done: list[dict[str, Any]]) -> str:
    """What must be 0, and of how many."""
    results = [result for one in done for result in one["results"]]
    verdicts = [one["verdict"] for one in done]
    total = {key: sum(result[key] for result in results) for key in ("injected", "runs", "rows", "rows_lost")}
    unnamed = sum(len(result["unnamed"]) for result in results)
    unsafe = sum(len(verdict["unsafe"]) for verdict in verdicts)
    wrong = sum(verdict["believed_wrong"] for verdict in verdicts)
    commands, readings = (sum(verdict[key] for verdict in verdicts) for key in ("commands", "readings"))
    wires = ", ".join(sorted({one["wire"] for one in done}))
    return (
        f"{total['injected']} faults in {total['runs']} runs on {wires}; {commands} commands came into force. Unsafe "
        f"currents at the device: {unsafe}. Faults without a name: {unnamed}. Readings believed that the device "
        f"never made: {wrong} of {readings}. Records lost: {total['rows_lost']} of {total['rows']}. "
        f"Period {1e3 * PERIOD_S:g} ms, timeout {1e3 * TIMEOUT_S:g} ms, watchdog {1e3 * WATCHDOG_S:g} ms."
    )


def write_table(page: Path, table: str) -> None:
    """Between the marks of the page."""
    text = page.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n{table}\n{END}{rest.split(END)[1]}", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
