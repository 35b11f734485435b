"""Round trips of one exchange (function 23, write 3, read 10) against a served VO2 device: ours beside
pymodbus.

Both clients talk to the same server process by turns, a block each, so that the machine's moods strike
both. The absolute numbers belong to the machine; the ratios are what a change of the code may be judged by.

    python benchmarks/transactions.py [--count 2000]
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from ratio import Ratio

from drivers.inprocess import InProcessDriver
from drivers.modbus import ModbusRtuDriver, ModbusTcpDriver
from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from plant_sim.wire.serve import Wires, serve
from rtctl.border.records import VO2, Driver
from rtctl.border.wire.registers import COMMAND, ENABLE, READING, READING_COUNT, float32_words
from rtctl.wiring import load_plant

BLOCKS = 10
CURRENT_MA = 5.0
PERIOD_US = 1000
TIMEOUT_S = 1.0

Exchange = Callable[[int], object]
"""One transaction with the sequence number."""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=2000, help="transactions of each client on each wire")
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.serve is not None:
        serve(load_plant(bundled_plant("vo2_a")), Wires(rtu_path=arguments.serve, tcp="127.0.0.1:0"))
        return
    print(f"{'':24}{'p50 [us]':>10}{'p99 [us]':>10}")
    report("in-process", measure_in_process(arguments.count))
    with served_process() as (path, port):
        for wire, (driver, client) in clients(path, port).items():
            ours, stock = blocks_by_turns(driver, client, arguments.count)
            p_ours, p_stock = report(f"{wire}, ours", ours), report(f"{wire}, pymodbus", stock)
            print(f"{wire + ', ratio':24}{p_stock[0] / p_ours[0]:>10.2f}{p_stock[1] / p_ours[1]:>10.2f}")


def ratios(rounds: int) -> list[Ratio]:
    """Medians of both wires beside pymodbus; a round is a hundred transactions of each client."""
    found = []
    with served_process() as (path, port):
        for wire, (driver, client) in clients(path, port).items():
            p50 = [
                float(np.median(np.concatenate(blocks)))
                for blocks in blocks_by_turns(driver, client, 100 * rounds)
            ]
            found.append(Ratio(f"Modbus, {wire}, round trip", "pymodbus", *p50, "us"))
    return found


def clients(path: Path, port: int) -> dict[str, tuple[Driver, ModbusSerialClient | ModbusTcpClient]]:
    """Ours and pymodbus's on each wire of a served device."""
    rtu = ModbusRtuDriver(port=str(path), baud=115200, unit=1, profile=VO2)
    tcp = ModbusTcpDriver(host="127.0.0.1", port=port, unit=1, profile=VO2)
    return {
        "RTU on a pty": (rtu, ModbusSerialClient(str(path), baudrate=115200)),
        "TCP": (tcp, ModbusTcpClient("127.0.0.1", port=port)),
    }


@contextmanager
def served_process() -> Iterator[tuple[Path, int]]:
    """A served device in a process of its own: the serial port's path and the TCP port."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "port"
        command = [sys.executable, __file__, "--serve", str(path)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            try:
                yield path, int(process.stdout.readline().split()[4].rpartition(":")[2])
            finally:
                process.terminate()


def blocks_by_turns(
    driver: Driver, client: ModbusSerialClient | ModbusTcpClient, count: int
) -> tuple[list[list[float]], list[list[float]]]:
    """Round trips [us] of ours and of pymodbus, each block with its own connection (a serial port has one user)."""
    ours, stock = [], []
    for _ in range(BLOCKS):
        driver.open(lockstep_period_us=PERIOD_US, watchdog_ms=0, timeout_s=TIMEOUT_S)
        ours.append(timed(lambda _: driver.exchange((CURRENT_MA,)), count // BLOCKS))
        driver.close((0.0,))
        client.connect()
        client.write_register(ENABLE, 1)
        stock.append(timed(stock_exchange(client), count // BLOCKS))
        client.close()
    return ours, stock


def stock_exchange(client: ModbusSerialClient | ModbusTcpClient) -> Exchange:
    """The same transaction with pymodbus as it comes."""
    words = float32_words(CURRENT_MA)

    def exchange(sequence: int) -> object:
        return client.readwrite_registers(
            read_address=READING,
            read_count=READING_COUNT,
            write_address=COMMAND,
            values=[*words, sequence & 0xFFFF],
        )

    return exchange


def measure_in_process(count: int) -> list[list[float]]:
    """The same exchange without a wire."""
    driver = InProcessDriver(SimulatedDevice(load_plant(bundled_plant("vo2_a"))))
    driver.open(lockstep_period_us=PERIOD_US, watchdog_ms=0, timeout_s=TIMEOUT_S)
    driver.exchange((CURRENT_MA,))  # compiles the plant
    return [timed(lambda _: driver.exchange((CURRENT_MA,)), count)]


def timed(exchange: Exchange, count: int) -> list[float]:
    """Round trips [us]."""
    times_us = []
    for sequence in range(count):
        begun_ns = time.perf_counter_ns()
        exchange(sequence)
        times_us.append((time.perf_counter_ns() - begun_ns) * 1e-3)
    return times_us


def report(name: str, blocks: list[list[float]]) -> tuple[float, float]:
    """Print and return p50 and p99 [us]."""
    p50, p99 = np.percentile(np.concatenate(blocks), [50, 99])
    print(f"{name:24}{p50:>10.1f}{p99:>10.1f}")
    return float(p50), float(p99)


if __name__ == "__main__":
    main()
