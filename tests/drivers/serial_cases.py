"""The transcripts of docs/serial-protocol.md, and the reference device that stands beside it."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import NamedTuple

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"


class Exchange(NamedTuple):
    """One request and its answer on the page."""

    what: str
    request: bytes
    reply: bytes


def sessions() -> list[list[Exchange]]:
    """Those of the page, in its order."""
    page = (DOCS / "serial-protocol.md").read_text(encoding="utf-8")
    found = []
    for block in re.findall(r"```transcript\n(.*?)```", page, flags=re.DOTALL):
        lines = block.splitlines()
        found.append(
            [
                Exchange(what, bytes.fromhex(there[2:]), bytes.fromhex(back[2:]))
                for what, there, back in zip(lines[::3], lines[1::3], lines[2::3], strict=True)
                if there[0] == ">" and back[0] == "<"
            ]
        )
    return found


def reference_device(folder: Path) -> Path:
    """The compiled program; skips the test where there is no gcc."""
    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("there is no gcc here")
    program = folder / "reference_device"
    source = DOCS / "serial" / "reference_device.c"
    warnings = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror"]
    subprocess.run([compiler, "-O2", *warnings, "-o", str(program), str(source), "-lm"], check=True)
    return program
