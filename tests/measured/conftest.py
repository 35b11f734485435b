"""A small vo2 or oscillator dataset in a folder, written as a user would, and changed piece by piece."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

OSCILLATOR = """
[dataset]
name = "shaker run 7"
plant = "oscillator"

[signals.drive]
role = "input"
unit = "m/s^2"

[signals.displacement]
role = "output"
unit = "mm"
column = "x_tip"

[[records]]
file = "r00.csv"
sample_rate_hz = 1000.0
"""

VO2 = """
[dataset]
name = "staircase"
plant = "vo2"

[signals.current]
role = "input"
unit = "A"
hold = "zero"

[signals.resistance]
role = "output"
unit = "kohm"

[signals.deflection]
role = "output"
unit = "mm"

[[records]]
file = "r00.csv"
sample_rate_hz = 1000.0
use = "identify"
"""

Columns = dict[str, NDArray[np.float64]]


def write_csv(path: Path, columns: Columns) -> None:
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(repr(float(value)) for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture
def shaker() -> Columns:
    k = np.arange(200)
    return {"drive": np.sin(0.1 * k), "x_tip": 0.3 * np.cos(0.1 * k)}


@pytest.fixture
def staircase() -> Columns:
    k = np.arange(60)
    return {"current": 4e-3 + 1e-4 * (k // 10), "resistance": 120.0 - k, "deflection": 1e-3 * k}


@pytest.fixture
def oscillator(tmp_path: Path, shaker: Columns) -> Callable[..., Path]:
    """`oscillator(("old", "new"), x_tip=...)`: its manifest and columns with pieces replaced."""

    def write(*changes: tuple[str, str], **columns: NDArray[np.float64]) -> Path:
        write_csv(tmp_path / "r00.csv", shaker | columns)
        return _manifest(tmp_path, OSCILLATOR, changes)

    return write


@pytest.fixture
def vo2(tmp_path: Path, staircase: Columns) -> Callable[..., Path]:
    def write(*changes: tuple[str, str], **columns: NDArray[np.float64]) -> Path:
        write_csv(tmp_path / "r00.csv", staircase | columns)
        return _manifest(tmp_path, VO2, changes)

    return write


def _manifest(folder: Path, text: str, changes: tuple[tuple[str, str], ...]) -> Path:
    for old, new in changes:
        assert old in text, f"the manifest has no {old!r} to replace"
        text = text.replace(old, new, 1)
    path = folder / "dataset.toml"
    path.write_text(text)
    return path
