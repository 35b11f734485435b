"""The drive between its samples: what really acts on the device at each node of each integration step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
HOLDS = ("linear", "zero", "band-limited")
NODES = np.array([0.0, 1 / 3, 2 / 3, 1.0])
STEPS_A_PERIOD = 64


class Grid(NamedTuple):
    """Integration steps within one sample, in fractions of the sample."""

    begin: FloatArray
    length: FloatArray


def sample_grid(samples_a_period: float, delay_samples: float = 0.0, finer: int = 1) -> Grid:
    """At least 64 steps a period, times `finer`; a step ends wherever a delayed drive may jump or bend."""
    count = int(np.ceil(finer * STEPS_A_PERIOD / samples_a_period))
    edges = np.linspace(0.0, 1.0, count + 1)
    bend = delay_samples % 1.0
    if np.abs(edges - bend).min() > 1e-9:
        edges = np.sort(np.append(edges, bend))
    return Grid(edges[:-1], np.diff(edges))


def drive_at_nodes(u: FloatArray, hold: str, grid: Grid, delay_samples: float = 0.0) -> FloatArray:
    """Drive (samples - 1, steps a sample, 4) at the nodes of each step; before its first sample the drive is 0.

    linear: straight between samples. zero: a DAC, u[k] from t_k on. band-limited: sum of sinc over the samples.
    """
    places = grid.begin[:, None] + grid.length[:, None] * NODES - delay_samples
    if hold == "band-limited":
        return _sinc(u, places)
    # one piece a step, named by its middle: a node on a border belongs to the piece that the step is in
    middle = grid.begin + 0.5 * grid.length - delay_samples
    piece = np.arange(u.size - 1)[:, None] + np.floor(middle).astype(int)[None, :]
    inside = (piece >= 0)[:, :, None]
    left = u[np.maximum(piece, 0)][:, :, None]
    if hold == "zero":
        return np.where(inside, np.broadcast_to(left, (*piece.shape, 4)), 0.0)
    right = u[np.minimum(np.maximum(piece, 0) + 1, u.size - 1)][:, :, None]
    within = places - np.floor(middle)[:, None]
    return np.where(inside, left + (right - left) * within[None], 0.0)


def _sinc(u: FloatArray, places: FloatArray) -> FloatArray:
    """Shift by fractions of a sample in the spectrum, between zeros long enough not to wrap what matters."""
    size = 1 << int(np.ceil(np.log2(u.size + 2048)))
    spectrum = np.fft.rfft(u, size)
    spectrum[-1] = 0.0
    frequency = np.fft.rfftfreq(size)
    nodes = np.empty((u.size - 1, *places.shape))
    known: dict[float, FloatArray] = {}
    for index, place in np.ndenumerate(places):
        key = round(float(place), 12)
        if key not in known:
            known[key] = np.fft.irfft(spectrum * np.exp(2j * np.pi * frequency * key), size)[: u.size - 1]
        nodes[(slice(None), *index)] = known[key]
    return nodes
