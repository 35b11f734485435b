"""The loop against the machine: wake-up lateness beside cyclictest's, the recorder's cost, missed periods.

Rounds are interleaved, ours and cyclictest's by turns, so that the machine's moods strike both; what is reported is the
median of the rounds' ratios. Nothing is asserted on maxima.

    python benchmarks/realtime.py [recording] [wakeup] [busy] [--rounds 5] [--seconds 5] [--priority 80]
"""

from __future__ import annotations

import argparse
import statistics
import struct
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

from rtctl.histogram import Histogram
from rtctl.latency import cyclictest, latency_scenario, measure_period, served_device
from rtctl.recording.mapped import Keeper, MappedRecorder
from rtctl.recording.rows import Recorder

SIGNALS = 20
STEPS = 200_000


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", default=["recording", "wakeup", "busy"])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=5.0, help="of a round of ours and of cyclictest's")
    parser.add_argument("--priority", type=int, default=80)
    arguments = parser.parse_args()
    if "recording" in arguments.parts:
        recording(arguments.rounds)
    if "wakeup" in arguments.parts:
        for period_s, spin in ((1e-3, False), (1e-3, True), (1e-4, False), (1e-4, True)):
            wakeup(period_s, spin, arguments.rounds, arguments.seconds, arguments.priority)
    if "busy" in arguments.parts:
        busy(arguments.rounds * arguments.seconds, arguments.priority)


def recording(rounds: int) -> None:
    """Nanoseconds an append of 20 signals, mapped and in memory, interleaved; of the loop's own thread."""
    columns = [(f"c{k}", "") for k in range(SIGNALS)]
    row = tuple(0.1 * k for k in range(SIGNALS))
    mapped, memory, bare = [], [], []
    pack, room = struct.Struct(f"{SIGNALS}dQ").pack_into, bytearray(8 * (SIGNALS + 1))
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            recorder = MappedRecorder(Path(folder) / "signals.rec", columns, {}, Keeper())
            mapped.append(cost_ns(recorder.append, row))
            recorder.close()
        memory.append(cost_ns(Recorder(columns).append, row))
        bare.append(cost_ns(lambda values: pack(room, 0, *values, 1), row))
    print(
        f"recording a step of {SIGNALS} signals: mapped {statistics.median(mapped):.0f} ns "
        f"(best {min(mapped):.0f} ns), in memory {statistics.median(memory):.0f} ns, a bare pack of the same row "
        f"{statistics.median(bare):.0f} ns"
    )


def cost_ns(append: Callable[[tuple[float, ...]], None], row: tuple[float, ...]) -> float:
    """CPU time of this thread an append [ns]: what it costs the loop, whoever else computes."""
    begun = time.thread_time_ns()
    for _ in range(STEPS):
        append(row)
    return (time.thread_time_ns() - begun) / STEPS


def wakeup(period_s: float, spin: bool, rounds: int, seconds: float, priority: int) -> None:
    """Lateness of the shipped loop (in-process plant, recording on) over cyclictest's, p50 and p99."""
    ratios: dict[str, list[float]] = {"p50": [], "p99": []}
    ours_us: dict[str, list[float]] = {"p50": [], "p99": []}
    clock = {"priority": priority, "lock_memory": True, **({} if spin else {"spin": "0 s"})}
    scenario = latency_scenario({"kind": "inprocess"}, clock, period_s)
    missed = steps = 0
    for _ in range(rounds):
        theirs = cyclictest(period_s, seconds, priority)
        if theirs is None:
            print("cyclictest is not installed (Debian package rt-tests): no ratio")
            return
        rung = measure_period(scenario, seconds, lambda: False)
        if rung.fault is not None:
            print(f"a round ended early by {rung.fault}: {rung.message}")
        missed, steps = missed + rung.timing.overruns, steps + rung.periods
        for name in ratios:
            ours = rung.timing.lateness.summary_us()[name]
            ours_us[name].append(ours)
            ratios[name].append(ours / theirs.summary_us()[name])
    shown = ", ".join(
        f"{name} {statistics.median(ours_us[name]):.1f} us, {statistics.median(ratios[name]):.2f} of cyclictest's"
        for name in ratios
    )
    how = "with spin" if spin else "without spin"
    print(f"lateness at {1e-3 / period_s:g} kHz {how}: {shown}; {missed} of {steps} periods missed")


def busy(seconds: float, priority: int) -> None:
    """Missed periods at 1 kHz over Modbus TCP while a Python thread computes, beyond cyclictest's own."""
    stop = threading.Event()

    def compute() -> None:
        k = 0
        while not stop.is_set():
            k = (k * 31 + 7) % 1_000_003

    with served_device("modbus-tcp", {}, priority) as (driver, _):
        scenario = latency_scenario(driver, {"priority": priority, "lock_memory": True}, 1e-3)
        thread = threading.Thread(target=compute, daemon=True)
        thread.start()
        rung = measure_period(scenario, seconds, lambda: False)
        stop.set()
        thread.join()
    theirs = cyclictest(1e-3, min(seconds, 60.0), priority) or Histogram()
    late = theirs.share_above(1e6) if theirs.count else float("nan")
    share = rung.timing.overruns / rung.periods
    if rung.fault is not None:
        print(f"ended by {rung.fault}: {rung.message}")
    print(
        f"1 kHz over Modbus TCP, a busy Python thread beside: {rung.timing.overruns} of {rung.periods} periods missed "
        f"({share:.2e}); cyclictest later than a period: {late:.2e}"
    )


if __name__ == "__main__":
    main()
