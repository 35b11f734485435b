"""Lateness, round trip and compute time of a recording in histograms that grow with it, and the missed periods."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.live_page.recorded.decimation import ROWS_OF_A_READ
from rtctl.live_page.recorded.timing_rows import TimingRows

EDGES_US = np.concatenate([[0.0], *(decade * np.array([1.0, 2.0, 5.0]) for decade in 10.0 ** np.arange(6))])
"""Edges of the bins [us], as a run's summary has them; the last bin has no end."""
QUANTILES = {"p50": 0.5, "p99": 0.99}
NEWEST_ROWS = 1000
"""Rows of which quantiles are told while a run lasts."""


class TimingHistograms:
    """The histograms of the run in one folder."""

    def __init__(self, folder: Path) -> None:
        self._rows = TimingRows(folder)
        self._done = 0
        self._counts: dict[str, np.ndarray[Any, np.dtype[np.int64]]] = {}
        self._largest: dict[str, float] = {}
        self._newest: dict[str, FloatArray] = {}

    def look(self) -> dict[str, Any] | None:
        """Count the new rows; return edges [us], counts, quantiles of the newest rows and the largest value, by name.

        None: this recording has no timing.
        """
        with suppress(InputError, OSError):
            while self._done < (count := self._rows.count()):
                last = min(count, self._done + ROWS_OF_A_READ)
                self._add(self._rows.read(self._done, last))
                self._done = last
        if not self._counts:
            return None
        return {
            "edges_us": EDGES_US.tolist(),
            "counts": {name: counts.tolist() for name, counts in self._counts.items()},
            "largest_us": self._largest,
            "newest_us": {name: _quantiles(values) for name, values in self._newest.items()},
        }

    def close(self) -> None:
        """Close the file."""
        self._rows.close()

    def _add(self, table: Mapping[str, FloatArray]) -> None:
        for name, values in table.items():
            counts = np.histogram(np.maximum(values, 0.0), np.append(EDGES_US, np.inf))[0]
            self._counts[name] = self._counts.get(name, 0) + counts
            self._largest[name] = max(self._largest.get(name, 0.0), float(np.max(values, initial=0.0)))
            self._newest[name] = np.concatenate([self._newest.get(name, values[:0]), values])[-NEWEST_ROWS:]


def _quantiles(values: FloatArray) -> dict[str, float]:
    return {name: float(np.quantile(values, share)) for name, share in QUANTILES.items()}
