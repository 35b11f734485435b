"""Every kind of fault on every wire, at two strengths: what the device did, what the loop said, how it came back.

    python benchmarks/fault_campaign.py [--count 34] [--wires serial,modbus-rtu] [--kinds drop,stall] [--page PAGE.md]

A served VO2 actuator in a process of its own keeps a journal of what reached the plant; a second process is the faulty
line; a third runs the loop, live, and opens the driver again after each fault. Safe means, by the device's journal
alone: every level is off, the device's own safe one or inside the host's limits, came by a command that the host sent
as it is, and was held no longer than its lease. Exit 1: something unsafe, unnamed, lost or wrongly believed.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

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
BEGIN, END = "<!-- fault campaign -->", "<!-- end of the fault campaign -->"


def cells_of(wire: str, kinds: list[str], count: int) -> list[Cell]:
    """The machine alone first, then each kind weakly and strongly."""
    cells = [Cell(wire=wire, kind="none", rate=0.0, duration_s=0.0, quiet_s=0.0, count=2, seed=0)]
    for kind in kinds:
        if wire == "modbus-tcp" and kind in NOT_OF_TCP:
            continue
        for seed, ((rate, quiet_s), duration_s) in enumerate(zip((WEAK, STRONG), KINDS[kind], strict=True)):
            cells.append(
                Cell(
                    wire=wire, kind=kind, rate=rate, duration_s=duration_s, quiet_s=quiet_s, count=count, seed=seed
                )
            )  # fmt: skip
    return cells


def main() -> int:
    """Run, print, and write the table into a page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=34, help="faults of each kind, strength and wire")
    parser.add_argument("--wires", default=",".join(WIRES))
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--together", type=int, default=len(WIRES), help="wires at the same time")
    parser.add_argument("--page", type=Path, help="write the table between its marks")
    arguments = parser.parse_args()
    wires = arguments.wires.split(",")
    results: list[tuple[Cell, dict[str, Any]]] = []
    verdicts: dict[str, Any] = {}

    def run(wire: str) -> None:
        cells = cells_of(wire, arguments.kinds.split(","), arguments.count)
        for cell, result in zip([*cells, None], run_wire(cells), strict=True):
            if cell is None:
                verdicts[wire] = result
                print(verdict_line(wire, result), flush=True)
            else:
                results.append((cell, result))
                print(progress_line(cell, result), flush=True)

    with ThreadPoolExecutor(arguments.together) as pool:  # they wait most of the time
        list(pool.map(run, wires))
    table = table_of(results, verdicts)
    print(table)
    if arguments.page is not None:
        write_table(arguments.page, table)
    bad = sum(len(r["unnamed"]) + abs(r["rows_lost"]) for _, r in results)
    bad += sum(len(v["unsafe"]) + v["believed_wrong"] for v in verdicts.values())
    return 1 if bad else 0


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
    return (
        f"{cell.wire:12}{cell.kind:14}rate {cell.rate:<5g}injected {result['injected']:<4}runs {result['runs']:<4}"
        f"named {result['named']} refused {result['refused']} back after {back} rows {result['rows']} "
        f"lost {result['rows_lost']} unnamed {len(result['unnamed'])} in {result['seconds']:.0f} s"
    )


def table_of(results: list[tuple[Cell, dict[str, Any]]], verdicts: dict[str, Any]) -> str:
    """The page's table: a row a kind, all wires together; then the totals."""
    rows = [
        "| fault | injected | runs ended by it, as | openings refused | back after, median / longest |",
        "|---|---|---|---|---|",
    ]
    for kind in ["none", *KINDS]:
        found = [result for cell, result in results if cell.kind == kind]
        if not found:
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
        name = "none (the machine alone)" if kind == "none" else kind
        rows.append(f"| {name} | {injected} | {ends} | {sum(refused.values())} | {back} |")
    total = {key: sum(result[key] for _, result in results) for key in ("injected", "rows", "rows_lost")}
    unnamed = sum(len(result["unnamed"]) for _, result in results)
    unsafe = sum(len(verdict["unsafe"]) for verdict in verdicts.values())
    wrong = sum(verdict["believed_wrong"] for verdict in verdicts.values())
    commands = sum(verdict["commands"] for verdict in verdicts.values())
    return "\n".join(
        [
            *rows,
            "",
            f"{total['injected']} faults on {', '.join(verdicts)}; {commands} commands came into force. Unsafe "
            f"currents at the device: {unsafe}. Faults without a name: {unnamed}. Readings believed that the device "
            f"never made: {wrong}. Records lost: {total['rows_lost']} of {total['rows']}. "
            f"Period {1e3 * PERIOD_S:g} ms, timeout "
            f"{1e3 * TIMEOUT_S:g} ms, watchdog {1e3 * WATCHDOG_S:g} ms.",
        ]
    )


def write_table(page: Path, table: str) -> None:
    """Between the marks of the page."""
    text = page.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n{table}\n{END}{rest.split(END)[1]}", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
