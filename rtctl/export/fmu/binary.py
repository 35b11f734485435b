"""Compiling the sources of a unit for this machine."""

from __future__ import annotations

import platform
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

from rtctl.border.errors import RunError

COMPILERS = ("gcc", "cc", "clang")
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden")
"""No a*b + c as one operation: the same sources then compute the same on all machines with IEEE arithmetic."""
FOLDERS = {"3.0": "x86_64-linux", "2.0": "linux64"}
"""Folder of a 64-bit Linux binary within `binaries` by version of FMI."""
LONGEST_S = 300.0


def can_compile_for(version: str) -> str | None:
    """Return the folder of binaries that this machine runs; None where units get sources alone."""
    if platform.system() == "Linux" and platform.machine() == "x86_64":
        return FOLDERS[version]
    return None


def find_compiler() -> str | None:
    """Return the C compiler of this machine; None where there is none."""
    return next((found for name in COMPILERS if (found := shutil.which(name))), None)


def compile_unit(
    files: Mapping[str, str], sources: Sequence[str], identifier: str, folder: Path, compiler: str
) -> bytes:
    """Return the shared library of a unit.

    Args:
        files: All source files and headers by name.
        sources: Names of those that are compiled.
        identifier: Name of the library without its suffix.
        folder: Folder to work in.
        compiler: The compiler.

    Raises:
        RunError: The compiler fails; it tells the first lines of what it says.
    """
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    library = folder / f"{identifier}.so"
    command = [compiler, *FLAGS, "-o", str(library), *sources, "-lm"]
    try:
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=LONGEST_S, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RunError(f"{compiler} does not compile the unit: {error}") from None
    if done.returncode != 0:
        said = "\n".join(done.stderr.splitlines()[:6])
        raise RunError(
            f"{compiler} does not compile the unit (exit code {done.returncode}):\n{said}\n"
            "write the sources alone with --sources-only, and compile them where it works"
        )
    return library.read_bytes()
