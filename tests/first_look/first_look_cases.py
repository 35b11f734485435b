"""One record of an oscillator by SciPy, and the files in which people keep such records."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.signal import StateSpace, butter, lsim, sosfilt

SIGNALS = """
[signals.drive]
role = "input"
unit = "V"
column = "u"
[signals.displacement]
role = "output"
unit = "mm"
column = "COLUMN"
"""
"""Tables of a manifest of a user's own; `COLUMN` stands for the column of the displacement."""


class Motion(NamedTuple):
    """x'' + 8 x' + (2 pi 15)^2 x = 300 u, u in V, x in mm."""

    t: np.ndarray
    u: np.ndarray
    x: np.ndarray
    v: np.ndarray
    a: np.ndarray


@cache
def motion(samples: int = 3000, rate_hz: float = 1000.0, seed: int = 0) -> Motion:
    rng = np.random.default_rng(seed)
    t = np.arange(samples) / rate_hz
    u = sosfilt(butter(4, 0.1 * rate_hz, fs=rate_hz, output="sos"), rng.normal(size=samples))
    u /= u.std()
    stiffness = (2.0 * np.pi * 15.0) ** 2
    plant = StateSpace(
        [[0.0, 1.0], [-stiffness, -8.0]],
        [[0.0], [300.0]],
        [[1.0, 0.0], [0.0, 1.0], [-stiffness, -8.0]],
        [[0.0], [0.0], [300.0]],
    )
    _, states, _ = lsim(plant, u, t, interp=True)
    x = states[:, 0] + 2e-4 * states[:, 0].std() * rng.normal(size=samples)
    return Motion(t, u, x, states[:, 1], states[:, 2])


def write_text(
    path: Path,
    head: str,
    *columns: np.ndarray,
    separator: str = ",",
    comma: bool = False,
    encoding: str = "utf-8",
) -> Path:
    lines = []
    for row in zip(*columns, strict=True):
        cells = [value if isinstance(value, str) else f"{value:.7g}" for value in row]
        lines.append(separator.join(cell.replace(".", ",") if comma else cell for cell in cells))
    path.write_text(head + "\n".join(lines) + "\n", encoding=encoding)
    return path
