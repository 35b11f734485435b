"""A long run in lockstep: does its memory grow, does a step take longer, do its errors drift?

    python benchmarks/long_run.py --hours 48 --model model.toml [--device vo2_a] [--out out/long]

The loop alone: it records into mapped files as any other run, which are read here a part at a time and not made a
table of. Memory of the process (resident, private: not the mapped recording) is read every second while it lasts; the
first and the last quarter are compared. An hour takes some 10 s, 120 MB of files and 200 MB of memory for its plan.
"""

from __future__ import annotations

import argparse
import shutil
import threading
import time
from pathlib import Path

import numpy as np

from rtctl.plant_control.lookup import support_of
from rtctl.recording.tail import Tail
from rtctl.scenario.schema import load_scenario
from rtctl.session.closed_loop import track
from rtctl.session.run_folder import RunFolder, run_metadata
from rtctl.wiring import build_driver

ROOT = Path(__file__).resolve().parent.parent
EVERY_S = 1.0
START_S = 2.0
"""Of the run, the way from the cold device: no part of a comparison [s]."""
PART = 2_000_000
"""Rows that are read at once."""


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--device", default="vo2_a")
    parser.add_argument("--scenario", default="multisine_1_10hz")
    parser.add_argument("--out", type=Path, default=Path("out/long"))
    arguments = parser.parse_args()
    shutil.rmtree(arguments.out, ignore_errors=True)
    arguments.out.mkdir(parents=True)
    settings = [
        f"driver.device={arguments.device}", "driver.seed=7900", f"scenario.duration={60.0 * arguments.hours} min",
    ]  # fmt: skip
    scenario, tables = load_scenario(ROOT / "scenarios" / f"{arguments.scenario}.toml", settings)
    place = RunFolder(path=arguments.out, metadata=run_metadata(tables), model=arguments.model)
    model = support_of("vo2").read_model(arguments.model)
    seen: list[float] = []
    ended = threading.Event()
    watcher = threading.Thread(target=watch, args=(arguments.out / "signals.rec", seen, ended), daemon=True)
    watcher.start()
    begun = time.monotonic()
    _, outcome = track(scenario, model, build_driver(scenario, arguments.out), lambda: False, place)
    ended.set()
    watcher.join()
    assert outcome.fault is None, outcome.message
    print(f"{arguments.hours:g} h simulated in {time.monotonic() - begun:.0f} s")
    print(f"private memory [MB]: {quarters(np.array(seen))} (first and last quarter of the run, median)")
    tell_errors(arguments.out / "signals.rec", scenario.scenario.period_s)


def tell_errors(path: Path, period_s: float) -> None:
    """Print the errors of the first and the last quarter of a recording."""
    tail = Tail(path)
    whole = tail.look()
    quarter = whole // 4
    found = []
    for begin, end in ((round(START_S / period_s), quarter), (whole - quarter, whole)):
        sums = np.zeros(3)
        for first in range(begin, end, PART):
            rows = tail.read(first, min(first + PART, end))
            off = [np.abs(rows[name] - rows["deflection"]) for name in ("setpoint", "estimate")]
            sums += [len(off[0]), float(np.sum(off[0])), float(np.sum(off[1]))]
        found.append(sums[1:] / sums[0])
    tail.close()
    print(f"{whole} steps")
    for name, first, last in zip(("tracking", "self-sensing"), *found, strict=True):
        print(f"{name} error, mean absolute [um]: {first:.5g} -> {last:.5g}")


def quarters(values: np.ndarray, of: object = np.median) -> str:
    """The first and the last quarter of something."""
    quarter = max(len(values) // 4, 1)
    first, last = (float(of(part)) for part in (values[:quarter], values[-quarter:]))  # type: ignore[operator]
    return f"{first:.5g} -> {last:.5g}"


def watch(recording: Path, seen: list[float], ended: threading.Event) -> None:
    """Note the private memory [MB] each second in which rows were recorded."""
    before = 0
    while not ended.wait(EVERY_S):
        if not recording.is_file():
            continue
        tail = Tail(recording)
        rows = tail.look()
        tail.close()
        if rows > before:
            text = Path("/proc/self/status").read_text(encoding="utf-8")
            private_kB = int(
                next(line for line in text.splitlines() if line.startswith("RssAnon")).split()[1]
            )
            seen.append(1e-3 * private_kB)
        before = rows


if __name__ == "__main__":
    main()
