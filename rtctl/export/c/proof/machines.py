"""Machines that compute an exported loop: this computer by gcc and clang, an emulated Cortex-M4F and RISC-V."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.errors import InputError
from rtctl.export.c.proof.recorded import Rows

LONGEST_S = 900.0
"""Time after which an emulated processor is taken for stuck [s]."""


@dataclass(frozen=True, slots=True)
class Machine:
    """How a program is made and run."""

    name: str
    title: str
    target: str
    """Of the Makefile."""
    tools: tuple[str, ...]
    """Programs that it needs."""
    packages: str
    """Debian packages that have them."""
    variables: tuple[str, ...] = ()
    emulator: tuple[str, ...] = ()
    precisions: tuple[str, ...] = ("float", "double")


EMULATED = (
    "-display", "none", "-monitor", "none", "-serial", "none", "-semihosting-config", "enable=on,target=native",
)  # fmt: skip
MACHINES = {
    machine.name: machine
    for machine in (
        Machine("gcc", "this computer, gcc", "host", ("gcc",), "gcc", ("HOST_CC=gcc",)),
        Machine("clang", "this computer, clang", "host", ("clang",), "clang", ("HOST_CC=clang",)),
        Machine(
            "m4f", "Cortex-M4F, emulated", "m4f", ("arm-none-eabi-gcc", "qemu-system-arm"),
            "gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm",
            emulator=("qemu-system-arm", "-machine", "mps2-an386"), precisions=("float",),
        ),
        Machine(
            "riscv", "RISC-V (rv64gc), emulated", "riscv", ("riscv64-unknown-elf-gcc", "qemu-system-riscv64"),
            "gcc-riscv64-unknown-elf qemu-system-misc",
            emulator=("qemu-system-riscv64", "-machine", "virt", "-bios", "none"),
        ),
    )
}  # fmt: skip
"""In double precision a Cortex-M4F computes in software, and the `1.0 - y` of libgcc 12 is not always rounded as IEEE
754 demands (docs/export-c.md)."""
REALS: dict[str, Any] = {"float": np.float32, "double": np.float64}


def missing(machine: Machine) -> str:
    """Return what to install for a machine; "": nothing."""
    lacking = [tool for tool in ("make", *machine.tools) if shutil.which(tool) is None]
    if not lacking:
        return ""
    return f"{', '.join(lacking)} not found (Debian: apt-get install make {machine.packages})"


def build(folder: Path, machine: Machine, precision: str) -> Path:
    """Compile an exported folder; return the program.

    Raises:
        InputError: a tool is missing, or the compiler refuses the sources.
    """
    if lack := missing(machine):
        raise InputError(f"{machine.title}: {lack}")
    place = f"build/{machine.name}-{precision}"
    done = subprocess.run(
        ["make", "-s", "-C", str(folder), machine.target, f"PRECISION={precision}", f"BUILD={place}",
         *machine.variables],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise InputError(f"{folder}: {machine.title}: the compiler says\n{done.stderr.strip()}")
    return folder / place / {"host": "host", "m4f": "m4f.elf", "riscv": "riscv.elf"}[machine.target]


def run(program: Path, machine: Machine, rows: Rows, output: np.dtype[Any]) -> Rows:
    """Return the outputs (n,) of a program for inputs (n,). Raises InputError if it ends early."""
    if machine.emulator:
        (program.parent / "in.bin").write_bytes(rows.tobytes())
        command = [*machine.emulator, *EMULATED, "-kernel", program.name]
        raw = emulated(command, program.parent / "out.bin", machine.title)
    else:
        raw = subprocess.run(
            [str(program.resolve())], input=rows.tobytes(), capture_output=True, check=False
        ).stdout
    found = np.frombuffer(raw, dtype=output)
    if len(found) != len(rows):
        raise InputError(f"{machine.title}: the program gave {len(found)} outputs for {len(rows)} inputs")
    return found


def emulated(command: Sequence[str], written: Path, title: str) -> bytes:
    """Run an emulator in the folder of a file, and return what it has written there; what stood there before is gone.

    Raises:
        InputError: It did not end, or wrote nothing; it names the machine by its `title`.
    """
    written.unlink(missing_ok=True)
    try:
        ran = subprocess.run(
            command, cwd=written.parent, capture_output=True, text=True, timeout=LONGEST_S, check=False
        )
    except subprocess.TimeoutExpired:
        raise InputError(f"{title}: the emulator was stopped after {LONGEST_S:g} s") from None
    if not written.is_file() or not (found := written.read_bytes()):
        raise InputError(
            f"{title}: the emulator computed nothing (exit {ran.returncode}): {ran.stderr.strip()}"
        )
    return found
