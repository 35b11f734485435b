"""A long run in lockstep: does its memory grow, does a step take longer, do its errors drift?

    python benchmarks/long_run.py --hours 2 --model model.toml [--device vo2_a] [--out out/long]

The run records into files as any other. Memory of the process (resident, private: not the mapped recording) is read
every second; the first and the last quarter of the run are compared. The rows lie in --out afterwards, for `rtctl
doubt`.
"""

from __future__ import annotations

import argparse
import threading
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

import rtctl

EVERY_S = 1.0
START_S = 2.0
"""Of the run, the way from the cold device: no part of a comparison [s]."""


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
    seen: list[tuple[float, int, float]] = []
    ended = threading.Event()
    watcher = threading.Thread(target=watch, args=(arguments.out / "timing.rec", seen, ended), daemon=True)
    watcher.start()
    settings = [
        f"driver.device={arguments.device}", "driver.seed=7900", f"scenario.duration={60.0 * arguments.hours} min",
    ]  # fmt: skip
    run = rtctl.run(
        arguments.scenario, model=arguments.model, settings=settings, out=arguments.out, plot=False
    )
    ended.set()
    watcher.join()
    assert run.fault is None, run.message
    memory = np.array([megabytes for _, _, megabytes in seen])
    print(f"private memory [MB]: {quarters(memory)} (first and last quarter of the run, median)")
    table = pq.read_table(
        arguments.out / "signals.parquet", columns=["index", "setpoint", "estimate", "deflection"]
    )
    index, setpoint, estimate, deflection = (table[name].to_numpy() for name in table.column_names)
    print(f"{len(index)} steps, {arguments.hours:g} h simulated")
    late = index * run.scenario.scenario.period_s > START_S
    for name, off in (("tracking", setpoint - deflection), ("self-sensing", estimate - deflection)):
        print(f"{name} error, mean absolute [um]: {quarters(np.abs(off[late]), np.mean)}")
    compute = pq.read_table(arguments.out / "timing.parquet", columns=["compute"])["compute"].to_numpy()
    print(f"compute, median of a step [us]: {quarters(compute)}")


def quarters(values: np.ndarray, of: object = np.median) -> str:
    """The first and the last quarter of something."""
    quarter = max(len(values) // 4, 1)
    first, last = (float(of(part)) for part in (values[:quarter], values[-quarter:]))  # type: ignore[operator]
    return f"{first:.5g} -> {last:.5g}"


def watch(recording: Path, seen: list[tuple[float, int, float]], ended: threading.Event) -> None:
    """Note time, size of the recording and private memory [MB] while the loop runs."""
    while not ended.wait(EVERY_S):
        if recording.is_file():
            text = Path("/proc/self/status").read_text(encoding="utf-8")
            private_kB = int(
                next(line for line in text.splitlines() if line.startswith("RssAnon")).split()[1]
            )
            seen.append((time.monotonic(), recording.stat().st_size, 1e-3 * private_kB))


if __name__ == "__main__":
    main()
