"""What the normal equations of Preisach masses cost: from weights of nodes, against dense rows of shares.

Rounds are interleaved, medians given, processor time.

    python benchmarks/preisach_rows.py [--rounds 5] [--cells 80] [--samples 8000]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from statistics import median

import numpy as np
from numpy.typing import NDArray
from ratio import Ratio
from threadpoolctl import threadpool_limits

from rtctl.hysteresis.preisach.corners import corner_rows
from rtctl.hysteresis.preisach.regressors import preisach_regressors

FloatArray = NDArray[np.float64]
LEVELS = 300
SAME = 1e-9
"""Of the largest product."""


def main() -> None:
    """Print both times and their ratio."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--cells", type=int, default=80)
    parser.add_argument("--samples", type=int, default=8000)
    args = parser.parse_args()
    rows, nodes = costs(args.rounds, args.cells, args.samples)
    print(f"{args.samples} samples, {args.cells} cells along each field")
    print(f"dense rows {rows:.2f} s, weights of nodes {nodes:.2f} s: {rows / nodes:.1f} times")


def ratios(rounds: int) -> list[Ratio]:
    """Weights of nodes beside dense rows."""
    rows, nodes = costs(rounds, 80, 8000)
    return [Ratio("normal equations of Preisach masses, 80 cells", "dense rows, BLAS", nodes, rows, "s")]


def costs(count: int, cells: int, samples: int) -> tuple[float, float]:
    """Processor time [s] of dense rows and of weights of nodes, medians of so many rounds."""
    levels = np.append(0.0, np.random.default_rng(0).uniform(0.0, 10.0, LEVELS))
    v = np.interp(np.linspace(0.0, LEVELS, samples), np.arange(LEVELS + 1), levels)
    grid, wanted = np.linspace(0.0, 10.0, cells + 1), np.ones(samples, dtype=bool)

    def dense() -> FloatArray:
        rows = preisach_regressors(v, grid)
        return rows.T @ rows

    def sparse() -> FloatArray:
        return corner_rows(v, grid, wanted).gram()

    with threadpool_limits(1, "blas"):
        one, other = dense(), sparse()  # compiled, too
        worst = np.abs(one - other).max() / np.abs(one).max()
        if worst > SAME:
            raise SystemExit(f"the two differ by {worst:.2g} of the largest product")
        rounds = [(_time_s(dense), _time_s(sparse)) for _ in range(count)]
    rows, nodes = (median(column) for column in zip(*rounds, strict=True))
    return rows, nodes


def _time_s(made: Callable[[], FloatArray]) -> float:
    begin = time.process_time()
    made()
    return time.process_time() - begin


if __name__ == "__main__":
    main()
