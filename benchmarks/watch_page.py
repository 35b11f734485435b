"""The live page: how often a browser redraws it, what it holds, and what viewers cost the loop that they watch.

    python benchmarks/watch_page.py page [--seconds 600]                    # 1 kHz, ten charts, Chromium
    python benchmarks/watch_page.py lateness [--rounds 7] [--seconds 10]    # a loop with and without three viewers

`page` needs selenium, chromium and chromium-driver. `lateness` takes rounds of the loop by turns without and with a
server and three viewers that take every row; with `--browsers` the viewers are windows of Chromium on this machine,
whose drawing takes processor time that a viewer elsewhere does not; with `--streams` the server has no viewers, and
feeds an MCAP file, EPICS process variables and PlotJuggler.
"""

from __future__ import annotations

import argparse
import http.client
import math
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from rtctl.loop.supervisor import TIMING_COLUMNS
from rtctl.session.latency import latency_scenario
from rtctl.session.loop_setup import open_driver
from rtctl.session.open_loop import play
from rtctl.session.run_folder import RunFolder
from rtctl.wiring import build_driver

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "live_page"))
from browser_cases import chromium, counters

VIEWERS = 3
PERIOD_S = 1e-3
UNITS = ("V", "mA", "ohm", "um", "N", "K", "Hz", "T", "Pa", "W")
"""Of the ten channels: each has a chart of its own."""
TICKS_A_SECOND = os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("part", choices=("page", "lateness"))
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, help="of the page (600), of each round (10)")
    parser.add_argument("--priority", type=int, default=80, help="SCHED_FIFO of the loop; 0: none")
    viewers = parser.add_mutually_exclusive_group()
    viewers.add_argument(
        "--browsers", dest="viewers", action="store_const", const="browsers", default="readers"
    )
    viewers.add_argument("--streams", dest="viewers", action="store_const", const="streams")
    arguments = parser.parse_args()
    if arguments.part == "page":
        page(arguments.seconds or 600.0)
    else:
        lateness(arguments.rounds, arguments.seconds or 10.0, arguments.priority, arguments.viewers)


def page(seconds: float) -> None:
    """Redraws a second, memory of page and server, rows lost and doubled."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="rtctl-")))
        stack.enter_context(written(folder / "run"))
        server, address = stack.enter_context(served(folder / "run"))
        browser = stack.enter_context(chromium(folder / "profile", 1400, 1200))
        browser.get(address)
        time.sleep(5.0)
        first, used_s, begun = counters(browser), processor_s(server.pid), time.monotonic()
        memory = [held(browser, server.pid)]
        while (left := seconds - (time.monotonic() - begun)) > 0.0:
            time.sleep(min(left, 30.0))
            memory.append(held(browser, server.pid))
        last, passed = counters(browser), time.monotonic() - begun
        used_s = processor_s(server.pid) - used_s
        charts = len(browser.find_elements("css selector", ".chart:not([hidden])"))
    drawn = last["redraws"] - first["redraws"]
    print(
        f"{charts} charts, {(last['rows'] - first['rows']) / passed:.0f} rows/s for {passed:.0f} s: ", end=""
    )
    print(f"{drawn / passed:.1f} redraws/s, {(last['drawing_ms'] - first['drawing_ms']) / drawn:.1f} ms each")
    print(f"rows lost {last['lost']}, doubled {last['doubled']}, skipped {last['skipped']}")
    print(f"server: {1e3 * used_s / passed:.0f} ms of processor time a second")
    for name, values in zip(("page's heap", "server's memory"), zip(*memory, strict=True), strict=True):
        print(
            f"{name}: {values[0]:.1f} MB at first, {max(values):.1f} MB at most, {values[-1]:.1f} MB at last"
        )


def lateness(rounds: int, seconds: float, priority: int, viewers: str) -> None:
    """Ratio of the loop's lateness with viewers to that without, rounds by turns."""
    figures: dict[bool, list[float]] = {False: [], True: []}
    missed = {False: 0, True: 0}
    for _ in range(rounds):
        for watched in (False, True):
            p99_us, overruns = loop_round(seconds, priority, viewers if watched else "")
            figures[watched].append(p99_us)
            missed[watched] += overruns
    ratios = [with_them / without for without, with_them in zip(figures[False], figures[True], strict=True)]
    for watched, name in ((False, "alone"), (True, f"with {viewers}")):
        print(f"{name}: p99 {statistics.median(figures[watched]):.1f} us (median), missed {missed[watched]}")
    print(f"ratio of p99, median of {rounds} pairs of rounds: {statistics.median(ratios):.2f} ", end="")
    print(f"({', '.join(f'{one:.2f}' for one in sorted(ratios))})")


def loop_round(seconds: float, priority: int, viewers: str) -> tuple[float, int]:
    """One round of the loop at 1 kHz in this process; p99 of its lateness [us], missed periods."""
    clock: dict[str, Any] = {"watchdog": "5 s", "timeout": "2 s", "spin": "0 s"}  # raw wake-ups
    if priority:
        clock |= {"priority": priority, "lock_memory": True}
    scenario = latency_scenario({"kind": "inprocess"}, clock, PERIOD_S)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="rtctl-")))
        (folder / "run").mkdir()
        if viewers:
            fed = ["--mcap", str(folder / "run.mcap"), "--epics", "BENCH:", "--plotjuggler", "localhost:9870"]
            _, address = stack.enter_context(served(folder / "run", *(fed if viewers == "streams" else ())))
            for number in range(0 if viewers == "streams" else VIEWERS):
                browses = viewers == "browsers"
                stack.enter_context(
                    window(address, folder / f"profile-{number}") if browses else reader(address)
                )
            time.sleep(2.0)
        driver = build_driver(scenario, Path())
        first = open_driver(driver, scenario)
        levels = np.full(round(seconds / PERIOD_S), scenario.limits.safe_level)
        place = RunFolder(path=folder / "run", metadata={"title": "latency", "period_s": "0.001"}, model=None)
        run = play(scenario, driver, levels, first, lambda: False, place)
    return float(run.timing.lateness.summary_us()["p99"]), run.timing.overruns


@contextmanager
def written(folder: Path) -> Iterator[None]:
    """Record ten channels at 1 kHz until the end of the block."""
    metadata = {"title": "ten channels at 1 kHz", "period_s": repr(PERIOD_S)}
    columns = [("index", ""), *((f"channel_{k}", unit) for k, unit in enumerate(UNITS))]
    recording = RunFolder(path=folder, metadata=metadata, model=None).record(columns, TIMING_COLUMNS)
    ended = threading.Event()

    def write() -> None:
        begun, row = time.monotonic(), 0
        while not ended.wait(0.01):
            while row < (time.monotonic() - begun) / PERIOD_S:
                swing = [math.sin(1e-2 * row * (k + 1)) for k in range(len(UNITS))]
                recording.signals.append((float(row), *swing))
                row += 1

    thread = threading.Thread(target=write, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        recording.close()


@contextmanager
def served(folder: Path, *options: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Serve the page as a user does; yield the process and the address."""
    command = [sys.executable, "-m", "rtctl", "watch", str(folder), "--port", "0", "--quiet", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process, process.stdout.readline().strip()
        finally:
            process.terminate()


@contextmanager
def window(address: str, profile: Path) -> Iterator[None]:
    """A window of Chromium that shows the page."""
    with chromium(profile) as browser:
        browser.get(address)
        yield


@contextmanager
def reader(address: str) -> Iterator[None]:
    """A viewer, in a process of its own, that takes everything and draws nothing."""
    url = urlsplit(address)
    process = subprocess.Popen([sys.executable, __file__, "--read", url.netloc, url.path])
    try:
        yield
    finally:
        process.terminate()
        process.wait()


def read(place: str, path: str) -> None:
    """Take the stream of a page until the end."""
    connection = http.client.HTTPConnection(place)
    connection.request("GET", f"{path}stream")
    answer = connection.getresponse()
    while answer.read1(1 << 16):
        pass


def held(browser: Any, server: int) -> tuple[float, float]:
    """Memory of the page's scripts and of the server [MB]."""
    heap = browser.execute_script("return performance.memory.usedJSHeapSize")
    lines = Path(f"/proc/{server}/status").read_text(encoding="ascii").splitlines()
    resident = next(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))
    return 1e-6 * float(heap), 1e-3 * resident


def processor_s(process: int) -> float:
    """Processor time that a process has used [s]."""
    words = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / TICKS_A_SECOND


if __name__ == "__main__":
    if sys.argv[1:2] == ["--read"]:
        read(*sys.argv[2:4])
    else:
        main()
