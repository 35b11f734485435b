"""Each driver beside the same exchange in C, against the same served device: ratios of medians, block by block.

    python benchmarks/wire_ratios.py [--rounds 15] [--count 200] [--page docs/realtime.md]

Blocks of ours and of C take turns, so that the machine's moods strike both; the figure is the median of the rounds'
ratios, with their quartiles. Modbus in C is libmodbus (left out where it is not installed), the serial protocol in C is
the header that devices use. Needs gcc.
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from ratio import Ratio

from drivers.modbus import ModbusRtuDriver, ModbusTcpDriver
from drivers.serial_frames import SerialDriver
from plant_sim.catalogue import bundled_plant
from plant_sim.wire.serve import Wires, serve
from rtctl.border.records import VO2, Driver
from rtctl.wiring import load_plant

LEVEL_MA = 5.0
REACH = {"modbus-tcp": 1.4, "modbus-rtu": 1.8, "serial": 1.4}
BEGIN, END = "<!-- wire ratios -->", "<!-- end of the wire ratios -->"
LIBMODBUS = Path("/usr/include/modbus")


def main() -> None:
    """Measure, print, write into a page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--count", type=int, default=200, help="exchanges of a block")
    parser.add_argument("--page", type=Path, help="write the table between its marks")
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.serve is not None:
        wires = Wires(
            rtu_path=arguments.serve / "rtu", serial_path=arguments.serve / "serial", tcp="127.0.0.1:0"
        )
        serve(load_plant(bundled_plant("vo2_a")), wires)
        return
    rows = ["| wire | ours p50 [us] | C p50 [us] | ratio (quartiles) | reach |", "|---|---|---|---|---|"]
    for wire, one in compared(arguments.rounds, arguments.count):
        low, middle, high = one.quartiles
        rows.append(
            f"| {wire} | {one.ours_us:.0f} | {one.theirs_us:.0f} | "
            f"{middle:.2f} ({low:.2f} to {high:.2f}) | {REACH[wire]} |"
        )
        print(rows[-1], flush=True)
    if arguments.page is not None:
        text = arguments.page.read_text(encoding="utf-8")
        before, rest = text.split(BEGIN)
        table = "\n".join(rows)
        arguments.page.write_text(f"{before}{BEGIN}\n{table}\n{END}{rest.split(END)[1]}", encoding="utf-8")


def tcp_driver(address: str) -> Driver:
    """Of HOST:PORT."""
    host, _, port = address.rpartition(":")
    return ModbusTcpDriver(host=host, port=int(port), unit=1, profile=VO2)


class Compared(NamedTuple):
    """Medians of a wire [us], and the quartiles of the rounds' ratios."""

    ours_us: float
    theirs_us: float
    quartiles: tuple[float, float, float]


def ratios(rounds: int) -> list[Ratio]:
    """Each wire beside C."""
    return [
        Ratio(
            f"{wire}, round trip", "libmodbus in C" if wire != "serial" else "the devices' header in C",
            one.ours_us, one.theirs_us, "us", one.quartiles[1],
        )
        for wire, one in compared(rounds, 200)
    ]  # fmt: skip


def compared(rounds: int, count: int) -> Iterator[tuple[str, Compared]]:
    """Each wire whose program in C can be had, in `rounds` pairs of blocks of `count` exchanges."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        peer = compiled(folder)
        with served(folder) as (rtu, serial, address):
            drivers: dict[str, tuple[Driver, list[str]]] = {
                "modbus-tcp": (tcp_driver(address), ["tcp", *address.split(":")]),
                "modbus-rtu": (ModbusRtuDriver(port=rtu, baud=115200, unit=1, profile=VO2), ["rtu", rtu]),
                "serial": (SerialDriver(port=serial, baud=115200, profile=VO2), ["serial", serial]),
            }
            for wire, (driver, words) in drivers.items():
                if wire == "serial" or LIBMODBUS.is_dir():
                    yield wire, of_wire(driver, [str(peer), *words], rounds, count)


def of_wire(driver: Driver, command: list[str], rounds: int, count: int) -> Compared:
    """Blocks of ours and of C by turns."""
    ours, theirs = [], []
    for _ in range(rounds):
        ours.append(statistics.median(block(driver, count)))
        done = subprocess.run([*command, str(count)], capture_output=True, text=True, check=True)
        theirs.append(statistics.median(1e-3 * int(line) for line in done.stdout.split()))
    ratios_of_rounds = [a / b for a, b in zip(ours, theirs, strict=True)]
    low, middle, high = statistics.quantiles(ratios_of_rounds, n=4)
    return Compared(statistics.median(ours), statistics.median(theirs), (low, middle, high))


def block(driver: Driver, count: int) -> list[float]:
    """Round trips [us] of one opening."""
    driver.open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=5.0)
    times_us = []
    for _ in range(count):
        begun_ns = time.perf_counter_ns()
        driver.exchange((LEVEL_MA,))
        times_us.append(1e-3 * (time.perf_counter_ns() - begun_ns))
    driver.close((0.0,))
    return times_us


def compiled(folder: Path) -> Path:
    """The program in C."""
    gcc = shutil.which("gcc")
    if gcc is None:
        sys.exit("benchmarks/wire_ratios.py: needs gcc")
    program = folder / "wire_peer"
    with_modbus = ["-DWITH_LIBMODBUS", f"-I{LIBMODBUS}", "-lmodbus"] if LIBMODBUS.is_dir() else []
    source = Path(__file__).with_name("wire_peer.c")
    subprocess.run([gcc, "-O2", "-o", str(program), str(source), *with_modbus], check=True)
    return program


@contextmanager
def served(folder: Path) -> Iterator[tuple[str, str, str]]:
    """A served device in a process of its own: ports of RTU and serial, address of TCP."""
    command = [sys.executable, __file__, "--serve", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            words = process.stdout.readline().split()
            yield words[2], words[4], words[6]
        finally:
            process.terminate()


if __name__ == "__main__":
    main()
