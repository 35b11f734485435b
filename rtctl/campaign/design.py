"""Positions of the trajectories in the ranges of their factors: grid, Latin hypercube or random.

Every point is a function of its index alone, so that a task of a thousand trajectories of a billion needs neither the
other points nor an order of computation. A Latin hypercube's permutations are a keyed Feistel network walked until it
lands inside the range (J. Black, P. Rogaway, CT-RSA 2002); random numbers come from one generator for each
block of indices.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray

WordArray = NDArray[np.uint64]
_BLOCK = 4096
_ROUNDS = 6


class Axis(NamedTuple):
    """One factor, in the units of the data."""

    name: str
    unit: str
    low: float
    high: float
    values: tuple[float, ...] = ()
    """Values of a grid; empty: the interval itself."""
    logarithmic: bool = False

    def at(self, share: FloatArray) -> FloatArray:
        """Return the values at shares 0 to 1 of the interval."""
        if self.logarithmic:
            return np.asarray(np.exp(math.log(self.low) + share * math.log(self.high / self.low)))
        return np.asarray(self.low + share * (self.high - self.low))


class Design(NamedTuple):
    """All points of a campaign."""

    kind: str
    """Kind of design: "grid", "latin-hypercube" or "random"."""
    axes: tuple[Axis, ...]
    samples: int
    seed: int

    def points(self, first: int, last: int) -> FloatArray:
        """Return the points (last - first, factors) of these indices; a grid's last factor changes fastest."""
        index = np.arange(first, last, dtype=np.int64)
        if self.kind == "grid":
            return _grid(self.axes, index)
        shares = _random(self.seed, len(self.axes), first, last)
        if self.kind == "latin-hypercube":
            for k in range(len(self.axes)):
                shares[:, k] = (permuted(index, self.samples, (self.seed, k)) + shares[:, k]) / self.samples
        return np.column_stack([axis.at(shares[:, k]) for k, axis in enumerate(self.axes)])


def grid_size(axes: Sequence[Axis]) -> int:
    """Return the number of a grid's points."""
    return math.prod(len(axis.values) for axis in axes)


def _grid(axes: Sequence[Axis], index: NDArray[np.int64]) -> FloatArray:
    columns, left = [], index
    for axis in reversed(axes):
        left, digit = np.divmod(left, len(axis.values))
        columns.append(np.asarray(axis.values)[digit])
    return np.column_stack(columns[::-1])


def _random(seed: int, factors: int, first: int, last: int) -> FloatArray:
    """Return uniform shares of 0 to 1 for these indices."""
    blocks = range(first // _BLOCK, (last - 1) // _BLOCK + 1)
    drawn = [np.random.default_rng([seed, block]).random((_BLOCK, factors)) for block in blocks]
    begin = first - blocks[0] * _BLOCK
    return np.concatenate(drawn)[begin : begin + last - first]


def permuted(index: NDArray[np.int64], size: int, key: tuple[int, int]) -> NDArray[np.int64]:
    """Return the image of each index under the permutation of 0 to size - 1 that belongs to `key`."""
    half = max(1, math.ceil(math.log2(max(size, 2)) / 2.0))
    keys = np.random.default_rng(list(key)).integers(0, 2**63, _ROUNDS, dtype=np.uint64)
    found = _feistel(index.astype(np.uint64), half, keys)
    outside = found >= size
    while outside.any():
        found[outside] = _feistel(found[outside], half, keys)
        outside = found >= size
    return found.astype(np.int64)


def _feistel(word: WordArray, half: int, keys: WordArray) -> WordArray:
    """Permute words of 2 `half` bits."""
    mask = np.uint64((1 << half) - 1)
    left, right = word >> np.uint64(half), word & mask
    for key in keys:
        left, right = right, left ^ (_mixed(right ^ key) & mask)
    joined: WordArray = (left << np.uint64(half)) | right
    return joined


def _mixed(word: WordArray) -> WordArray:
    """Apply SplitMix64's finaliser."""
    word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    mixed: WordArray = word ^ (word >> np.uint64(31))
    return mixed
