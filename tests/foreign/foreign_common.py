"""What the foreign generators of all kinds share: draws, flicker noise, the search for an effect's size, files."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from math import inf, log, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TRIALS = 12  # of a size
CLOSE = 0.1  # log of a share over the wished one that ends the search


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number with its logarithm uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def flicker(samples: int, rng: np.random.Generator) -> Array:
    """Noise with power 1/f and unit variance over its record."""
    spectrum = np.fft.rfft(rng.normal(size=samples))
    spectrum[1:] /= np.sqrt(np.arange(1, spectrum.size))
    spectrum[0] = 0.0
    noise = np.fft.irfft(spectrum, samples)
    return noise / noise.std()


def search_size(
    reached: Callable[[float], float], start: float, low: float, high: float, wanted: float
) -> float:
    """The size from `low` to `high` whose share `reached(size)` is nearest to `wanted`."""
    best_miss, best, size = inf, start, start
    small, large = low, high  # bounds that the trials narrow
    for _ in range(TRIALS):
        share = reached(size)
        miss = abs(log(max(share, 1e-6) / wanted))
        if miss < best_miss:
            best_miss, best = miss, size
        if miss < CLOSE:
            break
        if share < wanted:
            small = size
        else:
            large = size
        guess = size * min(max(wanted / max(share, 1e-6), 0.1), 10.0)
        size = guess if small * 1.02 < guess < large / 1.02 else sqrt(small * large)
    return best


def record_lines(
    file: str, period_s: float, use: str, rows: Sequence[int] = (), time: tuple[str, str] | None = None
) -> list[str]:
    """A record's lines of a manifest; `rows`: its part of the file; `time`: column and unit, if it has its own."""
    lines = ["[[records]]", f'file = "{file}"']
    lines += [f'time = "{time[0]}"', f'time_unit = "{time[1]}"'] if time else []
    lines += [] if time else [f"sample_rate_hz = {1.0 / period_s:.9g}"]
    lines += [f"rows = {list(rows)}"] if rows else []
    lines += [f'use = "{use}"'] if use else []
    return [*lines, ""]


def write_tdms(path: Path, group: str, period_s: float, columns: dict[str, Array]) -> None:
    """Write the columns as channels of one group, sampled every `period_s`."""
    from nptdms import ChannelObject, TdmsWriter  # an extra of the program; only these files need it

    properties = {"wf_increment": period_s, "wf_start_offset": 0.0}
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject(group, name, x, properties) for name, x in columns.items()])


def write_truth(folder: Path, truth: dict[str, object]) -> None:
    """Write what was hidden, for the judge."""
    (folder / "truth.json").write_text(json.dumps(truth, indent=2) + "\n", encoding="utf-8")
