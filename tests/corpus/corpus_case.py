"""A situation of the corpus: a file of a known record, what the user says of it, and what must come of it."""

from __future__ import annotations

import gzip
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from first_look_cases import SIGNALS, motion

ROWS, RATE_HZ = 600, 1000.0
T, U, X, V, A = motion(ROWS)
"""The truth: time [s], drive [V], displacement [mm], velocity [mm/s], acceleration [mm/s^2], (600,) each."""
UNITS = {"drive": "V", "displacement": "mm", "velocity": "mm/s", "acceleration": "mm/s^2"}
TRUTH = {"drive": U, "displacement": X, "velocity": V, "acceleration": A}

_RISING = np.linspace(95.0, 106.0, 45)
_F = np.concatenate([_RISING, _RISING[::-1]])
SWEEP = (_F, np.repeat([0.1, 0.4], 45), np.repeat([0.1, 0.4], 45) * 2.5e3 / (100.0**2 - _F**2 + 2.5j * _F))
"""The truth of sweeps: frequency [Hz], peak drive [V] and complex amplitude [um] of a resonator, rising and falling."""

MANIFEST = (
    '[dataset]\nname = "r"\nplant = "oscillator"'
    + SIGNALS.replace("COLUMN", "x")
    + """[[records]]
file = "FILE"
sample_rate_hz = 1000.0
"""
)
"""A manifest of a user's own: drive `u` [V], displacement `x` [mm]; `FILE` stands for the file's name."""

Write = Callable[[Path], Path]
"""Writes the file into a folder and returns its path."""


class Right(NamedTuple):
    """Read, and every number is the truth's, in its unit and at its rate."""

    remark: str = ""
    """Words that a user must be told."""
    rate_hz: float = RATE_HZ
    rows: int = ROWS
    """Rows of the file; those that no record has are gaps."""
    fewest: int = ROWS
    """Rows that the records must have together."""
    within: float = 2e-4
    """Largest error, as a share of a signal's largest value."""
    lost: np.ndarray | None = None
    """Rows of the truth that the file has; None: all."""
    units: Mapping[str, str] = UNITS
    """Units of the truth where a file cannot have those above."""


class RightSweep(NamedTuple):
    """Read as sweeps, and every complex amplitude is the truth's."""

    remark: str = ""
    """Words that a user must be told."""


class Refused(NamedTuple):
    """Refused, in one message with these words: what is wrong where, and what to do."""

    words: tuple[str, ...]


class Situation(NamedTuple):
    """One row of the corpus."""

    name: str
    write: Write
    expected: Right | RightSweep | Refused
    said: Mapping[str, Any] = {}
    """Options of `rtctl.init`; with `manifest` a manifest is written instead."""


RIGHT = Right()


def refused(*words: str) -> Refused:
    return Refused(words)


def table(
    *columns: np.ndarray | Sequence[str], separator: str = ",", comma: bool = False, form: str = "{:.8g}",
    end: str = "\n", quoted: bool = False, last: str = "",
) -> str:  # fmt: skip
    """Lines of numbers (or words), with a decimal comma if asked for; `last` ends each of them."""
    lines = []
    for row in zip(*columns, strict=True):
        cells = [one if isinstance(one, str) else form.format(one) for one in row]
        cells = [one.replace(".", ",") for one in cells] if comma else cells
        lines.append(separator.join(f'"{one}"' if quoted else one for one in cells) + last + end)
    return "".join(lines)


def text(content: str, name: str = "r.csv", encoding: str = "utf-8", before: bytes = b"") -> Write:
    """A text file."""

    def write(folder: Path) -> Path:
        path = folder / name
        raw = before + content.encode(encoding)
        path.write_bytes(gzip.compress(raw, mtime=0) if name.endswith(".gz") else raw)
        return path

    return write


def raw(content: bytes, name: str) -> Write:
    def write(folder: Path) -> Path:
        (folder / name).write_bytes(content)
        return folder / name

    return write
