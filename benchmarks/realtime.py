"""The loop against the machine: wake-up lateness beside cyclictest's, the recorder's cost, missed periods.

Rounds are interleaved, ours and cyclictest's by turns, so that the machine's moods strike both; what is reported is the
median of the rounds' ratios. Nothing is asserted on maxima.

    python benchmarks/realtime.py [recording] [wakeup] [busy] [stalls] [--rounds 5] [--seconds 5] [--priority 80]

Ten minutes of the loop over Modbus TCP beside a busy Python thread, ten without it and ten of cyclictest beside it:
`busy --compiled --rounds 10 --seconds 60`.
"""

from __future__ import annotations

import argparse
import statistics
import struct
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
from ratio import Ratio

from rtctl.border.arrays import IntArray
from rtctl.border.kernels import background_kernel
from rtctl.border.wire.compiled_clock import clock_ns
from rtctl.recording.mapped import Keeper, MappedRecorder
from rtctl.recording.rows import Recorder
from rtctl.session.latency import cyclictest, latency_scenario, measure_period, served_device
from rtctl.timing.histogram import Histogram
from rtctl.timing.realtime import RealTime, real_time

SIGNALS = 20
STEPS = 200_000
LENIENT = {"watchdog": "5 s", "timeout": "2 s"}
"""Clock of rounds that a stalled machine is not to end."""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", default=["recording", "wakeup", "busy", "stalls"])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=5.0, help="of a round of ours and of cyclictest's")
    parser.add_argument("--priority", type=int, default=80)
    parser.add_argument("--compiled", action="store_true", help="no rounds of the loop in Python")
    arguments = parser.parse_args()
    if "recording" in arguments.parts:
        recording(arguments.rounds)
    if "wakeup" in arguments.parts:
        for period_s, spin in ((1e-3, False), (1e-3, True), (1e-4, False), (1e-4, True)):
            wakeup(period_s, spin, arguments.rounds, arguments.seconds, arguments.priority)
    if "busy" in arguments.parts:
        busy(arguments.rounds, arguments.seconds, arguments.priority, arguments.compiled)
    if "stalls" in arguments.parts:
        stalls(arguments.rounds * arguments.seconds)


class RecordingCost(NamedTuple):
    """Nanoseconds an append of 20 signals of each round, of the loop's own thread."""

    mapped: list[float]
    memory: list[float]
    bare: list[float]
    """`struct.pack_into` of the same row."""


def ratios(rounds: int) -> list[Ratio]:
    """A recorded step beside a bare pack of its row, wake-ups at 1 kHz beside cyclictest's."""
    cost = costs_of_recording(min(rounds, 5))
    found = [
        Ratio(
            f"recording a step of {SIGNALS} signals", "struct.pack_into of the row",
            statistics.median(cost.mapped), statistics.median(cost.bare), "ns",
        )
    ]  # fmt: skip
    for spin in (False, True):
        late = lateness(1e-3, spin, min(rounds, 3), 2.0, 80)
        if late is None:
            continue
        ours, theirs = (statistics.median(values["p99"]) for values in (late.ours_us, late.theirs_us))
        name = f"lateness at 1 kHz {'with' if spin else 'without'} spin, p99"
        found.append(Ratio(name, "cyclictest", ours, theirs, "us", statistics.median(late.ratios("p99"))))
    return found


def costs_of_recording(rounds: int) -> RecordingCost:
    """Mapped, in memory, and a bare pack, interleaved."""
    columns = [(f"c{k}", "") for k in range(SIGNALS)]
    row = tuple(0.1 * k for k in range(SIGNALS))
    cost = RecordingCost([], [], [])
    pack, room = struct.Struct(f"{SIGNALS}dQ").pack_into, bytearray(8 * (SIGNALS + 1))
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            recorder = MappedRecorder(Path(folder) / "signals.rec", columns, {}, Keeper())
            cost.mapped.append(cost_ns(recorder.append, row))
            recorder.close()
        cost.memory.append(cost_ns(Recorder(columns).append, row))
        cost.bare.append(cost_ns(lambda values: pack(room, 0, *values, 1), row))
    return cost


def recording(rounds: int) -> None:
    """Print what it costs to record a step."""
    mapped, memory, bare = costs_of_recording(rounds)
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


class Lateness(NamedTuple):
    """Of rounds of ours and of cyclictest by turns, p50 and p99."""

    ours_us: dict[str, list[float]]
    theirs_us: dict[str, list[float]]
    missed: int
    steps: int

    def ratios(self, name: str) -> list[float]:
        """Of the rounds."""
        pairs = zip(self.ours_us[name], self.theirs_us[name], strict=True)
        return [ours / theirs for ours, theirs in pairs]


def lateness(period_s: float, spin: bool, rounds: int, seconds: float, priority: int) -> Lateness | None:
    """The shipped loop (in-process plant, recording on) and cyclictest; None where that is not installed."""
    ours: dict[str, list[float]] = {"p50": [], "p99": []}
    theirs: dict[str, list[float]] = {"p50": [], "p99": []}
    clock = {"priority": priority, "lock_memory": True, **({} if spin else {"spin": "0 s"})}
    scenario = latency_scenario({"kind": "inprocess"}, clock, period_s)
    missed = steps = 0
    for _ in range(rounds):
        peer = cyclictest(period_s, seconds, priority)
        if peer is None:
            return None
        rung = measure_period(scenario, seconds, lambda: False)
        if rung.fault is not None:
            print(f"a round ended early by {rung.fault}: {rung.message}")
        missed, steps = missed + rung.timing.overruns, steps + rung.periods
        for name in ours:
            ours[name].append(rung.timing.lateness.summary_us()[name])
            theirs[name].append(peer.summary_us()[name])
    return Lateness(ours, theirs, missed, steps)


def wakeup(period_s: float, spin: bool, rounds: int, seconds: float, priority: int) -> None:
    """Print lateness over cyclictest's."""
    late = lateness(period_s, spin, rounds, seconds, priority)
    if late is None:
        print("cyclictest is not installed (Debian package rt-tests): no ratio")
        return
    shown = ", ".join(
        f"{name} {statistics.median(late.ours_us[name]):.1f} us, "
        f"{statistics.median(late.ratios(name)):.2f} of cyclictest's"
        for name in late.ours_us
    )
    how = "with spin" if spin else "without spin"
    print(f"lateness at {1e-3 / period_s:g} kHz {how}: {shown}; {late.missed} of {late.steps} periods missed")


def busy(rounds: int, seconds: float, priority: int, compiled: bool) -> None:
    """Missed periods at 1 kHz over Modbus TCP, recorder on, while a Python thread computes; beside cyclictest's own.

    Rounds by turns: compiled blocks with the busy thread, without it, the loop in Python with it (unless `compiled`),
    cyclictest beside the same thread. Watchdog and timeout are long enough for a stalled machine not to end a round.
    """
    kinds = {"compiled, busy thread": (True, True), "compiled, no thread": (True, False)}
    if not compiled:
        kinds["Python, busy thread"] = (False, True)
    missed, late, periods = Counter[str](), Counter[str](), Counter[str]()
    own = Histogram()
    with served_device("modbus-tcp", {}, priority) as (driver, _):
        for _ in range(rounds):
            for kind, (unlocked, is_busy) in kinds.items():
                clock = {**LENIENT, "priority": priority, "lock_memory": True, "unlocked": unlocked}
                scenario = latency_scenario(driver, clock, 1e-3)
                with computing(is_busy):
                    rung = measure_period(scenario, seconds, lambda: False)
                if rung.fault is not None:
                    print(f"{kind}: a round ended early by {rung.fault}: {rung.message}")
                timing = rung.timing
                missed[kind] += timing.overruns
                periods[kind] += rung.periods
                late[kind] += beyond(timing.lateness, 1e6) + beyond(timing.round_trip, 1e6)
            with computing(True):
                theirs = cyclictest(1e-3, seconds, priority)
            if theirs is not None:
                for low, high, count in theirs.buckets():
                    own.record_many((low + high) // 2, count)
    print(
        "1 kHz over Modbus TCP, recorder on: periods missed; steps that woke or were answered more than 1 ms late"
    )
    for kind in kinds:
        print(
            f"  {kind}: {missed[kind]} of {periods[kind]} ({missed[kind] / periods[kind]:.1e}); {late[kind]}"
        )
    if own.count:
        whole = sum(count * (low // 1_000_000) for low, _, count in own.buckets())
        of = own.count + whole
        print(f"  cyclictest, busy thread: {whole} of {of} ({whole / of:.1e}); {beyond(own, 1e6)}")


def beyond(histogram: Histogram, duration_ns: float) -> int:
    """How many durations are in buckets beyond that one."""
    return sum(count for low, _, count in histogram.buckets() if low > duration_ns)


@contextmanager
def computing(really: bool) -> Iterator[None]:
    """A Python thread that computes all the time, in this process."""
    stop = threading.Event()

    def compute() -> None:
        k = 0
        while not stop.is_set():
            k = (k * 31 + 7) % 1_000_003

    thread = threading.Thread(target=compute, daemon=True)
    if really:
        thread.start()
    try:
        yield
    finally:
        stop.set()
        if really:
            thread.join()


def stalls(seconds: float) -> None:
    """Gaps in a loop that does nothing but read the clock, three tenths of each second: the machine's own stalls.

    No task of this system interrupts SCHED_FIFO at the highest priority, and three tenths are far from where the kernel
    throttles it; what is missing was taken by the hypervisor, which counts it as stolen.
    """
    gaps, stolen = Histogram(), stolen_ticks()
    with real_time(RealTime(priority=99, lock_memory=True)):
        end_s = time.monotonic() + seconds
        spun_s = 0.0
        while time.monotonic() < end_s:
            found = np.zeros(100_000, dtype=np.int64)
            count = spin(found, np.zeros(2, dtype=np.int64), 300_000_000)
            for gap_ns in found[:count].tolist():
                gaps.record(gap_ns)
            spun_s += 0.3
            time.sleep(0.7)
    counts = ", ".join(f"{beyond(gaps, 1e6 * ms)} above {ms} ms" for ms in (1, 5, 20, 50))
    print(
        f"a spin of {spun_s:.1f} s at SCHED_FIFO 99 had gaps: {counts}, the longest {1e-6 * gaps.largest_ns:.1f} ms; "
        f"the system counts {stolen_ticks() - stolen} ticks of 10 ms stolen meanwhile"
    )


def stolen_ticks() -> int:
    """Time that the hypervisor gave to others [10 ms], of all CPUs."""
    return int(Path("/proc/stat").read_text(encoding="ascii").split()[8])


@background_kernel
def spin(gaps: IntArray, scratch: IntArray, duration_ns: int) -> int:
    """Read the clock for so long; gaps [ns] of more than 0.1 ms, and how many there were."""
    count, begun = 0, clock_ns(scratch, 0)
    last = begun
    while last - begun < duration_ns:
        now = clock_ns(scratch, 0)
        if now - last > 100_000 and count < gaps.size:
            gaps[count] = now - last
            count += 1
        last = now
    return count


if __name__ == "__main__":
    main()
