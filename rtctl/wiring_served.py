"""The part of the wiring that serves simulated devices to hosts: on wires, on a test bench, as firmware."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from rtctl.scenario.serving import ServedAt, ServedFaults
from rtctl.wiring import build_device, find_plant

if TYPE_CHECKING:
    from plant_sim.bench.under_way import Bench


def serve_plant(name: str, seed: int | None, where: ServedAt) -> None:
    """Serve a plant file or bundled plant until interrupted. Raises InputError."""
    from plant_sim.wire.serve import Wires, serve

    serve(build_device(name, Path(), seed), Wires(**where.wires()), where.journal)


def is_journal(path: Path) -> bool:
    """Return whether a file is the journal of a simulated device, or empty."""
    from plant_sim.journal import is_journal

    return is_journal(path)


def build_bench(
    name: str, seed: int | None, faults: ServedFaults, *, has_journal: bool, is_inspected: bool
) -> Bench:
    """Return a device on a test bench; `is_inspected`: what it really does is told. Raises InputError."""
    from drivers.served_line import ServedLine
    from plant_sim.bench.device import BenchDevice, JournalledBenchDevice
    from plant_sim.bench.under_way import Bench, PlannedFault

    make = JournalledBenchDevice if has_journal else BenchDevice
    device = make(build_device(name, Path(), seed), is_inspected=is_inspected)
    found = faults.faults
    struck = [(one.kind, one.rate, one.duration_s, one.way) for one in found if one.rate is not None]
    planned = [PlannedFault(one.at_s, one.kind, one.duration_s) for one in found if one.at_s is not None]
    return Bench(device, ServedLine(struck, faults.seed), planned)


def serve_bench(bench: Bench, where: ServedAt) -> None:
    """Serve a device on a test bench until interrupted. Raises InputError."""
    from plant_sim.wire.serve import Wires
    from plant_sim.wire.serve import serve_bench as serve

    serve(bench, Wires(**where.wires()), where.journal)


def write_firmware(film: str, folder: Path) -> str:
    """Write the firmware's sources with the film of a VO2 device file or bundled device into `folder`; its name.

    Raises:
        InputError: there is no such device, or the firmware cannot simulate it.
    """
    from drivers.firmware import write_firmware as write
    from plant_sim.vo2.c_source.film_tables import film_tables
    from plant_sim.vo2.device_file import read_device

    path = find_plant(film, Path())
    device = read_device(path)
    write(folder, film_tables(device, path))
    return device.plant.name


FOR_LOOPS = {
    "boards/mps2_an386": ("startup.c", "memory.ld", "mps2_an386.c", "mps2_an386.h"),
    "boards/freestanding": ("string.c", "string.h"),
    "src": ("rtctl_serial.h", "rtctl_board.h"),
}
"""Files of the firmware that an exported loop needs too, by folder."""


def write_boards(folder: Path) -> None:
    """Write start-up, memory map and serial line of the emulated board, and the serial protocol, beside a loop in C."""
    from drivers.firmware import SOURCES

    for place, names in FOR_LOOPS.items():
        target = folder / ("boards" if place == "src" else place)
        target.mkdir(parents=True, exist_ok=True)
        for name in names:
            shutil.copyfile(SOURCES / place / name, target / name)
