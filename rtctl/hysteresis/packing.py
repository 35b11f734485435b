"""Parameters and states of a kernel in one float64 array, because a call from Python pays for every argument.

numba takes 50 ns to unwrap an array, and half a microsecond more to unwrap a NamedTuple of them, several times
what the kernels here compute. So code that steps once a sample from Python keeps all it needs in one memory, and a
kernel takes views of it; the kernels behind it stay `(state, input, params)`.

Layout: the offsets o_0 ... o_m, then the parts, part k at [o_k, o_{k+1}). A number is a part of one entry, a
NamedTuple is its fields one after the other. Views write through: states advance in the memory.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.hysteresis.egpi import EgpiParams
from rtctl.hysteresis.gap_free import GapFreeParams
from rtctl.hysteresis.gpi_inverse import GpiInverseParams
from rtctl.hysteresis.preisach.model import PreisachParams


def pack(*values: Any) -> FloatArray:
    """Return a memory of copies of `values`: numbers, arrays and NamedTuples of them, in this order."""
    parts = _parts(values)
    offsets = np.cumsum([len(parts) + 1, *(part.size for part in parts)])
    return np.concatenate([offsets.astype(np.float64), *parts])


def _parts(value: Any) -> list[FloatArray]:
    if isinstance(value, tuple):
        return [part for entry in value for part in _parts(entry)]
    return [np.ravel(np.asarray(value, dtype=np.float64))]


@kernel
def array_at(memory: FloatArray, k: int) -> FloatArray:
    """Return a view of part k."""
    return memory[int(memory[k]) : int(memory[k + 1])]


@kernel
def number_at(memory: FloatArray, k: int) -> float:
    """Return part k, which is a number."""
    return float(memory[int(memory[k])])


@kernel
def egpi_at(memory: FloatArray, k: int) -> EgpiParams:
    """Return the EGPI parameters whose first field is part k."""
    return EgpiParams(
        array_at(memory, k), array_at(memory, k + 1), array_at(memory, k + 2), array_at(memory, k + 3),
        array_at(memory, k + 4), array_at(memory, k + 5),
        number_at(memory, k + 6), number_at(memory, k + 7), number_at(memory, k + 8),
    )  # fmt: skip


@kernel
def gpi_inverse_at(memory: FloatArray, k: int) -> GpiInverseParams:
    """Return the parameters of an inverse GPI whose first field is part k."""
    return GpiInverseParams(
        array_at(memory, k), array_at(memory, k + 1),
        number_at(memory, k + 2), number_at(memory, k + 3), number_at(memory, k + 4), number_at(memory, k + 5),
        number_at(memory, k + 6), number_at(memory, k + 7), number_at(memory, k + 8),
        number_at(memory, k + 9), number_at(memory, k + 10), number_at(memory, k + 11),
    )  # fmt: skip


@kernel
def gap_free_at(memory: FloatArray, k: int) -> GapFreeParams:
    """Return the gap-free parameters whose first field, an EGPI's nine, starts at part k."""
    return GapFreeParams(
        egpi_at(memory, k),
        number_at(memory, k + 9), number_at(memory, k + 10), number_at(memory, k + 11), number_at(memory, k + 12),
    )  # fmt: skip


@kernel
def preisach_at(memory: FloatArray, k: int) -> PreisachParams:
    """Return the Preisach parameters whose first field is part k."""
    grid = array_at(memory, k)
    return PreisachParams(
        grid, array_at(memory, k + 1).reshape((grid.size, grid.size)),
        number_at(memory, k + 2), number_at(memory, k + 3), number_at(memory, k + 4), number_at(memory, k + 5),
    )  # fmt: skip
