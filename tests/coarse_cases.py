"""A film with three domains that switch as one each, or none: its staircases, its records, and an identified model."""

from __future__ import annotations

import dataclasses
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits
from vo2_model_cases import PERIOD_S, TAU_S, UNITS, small_model

from rtctl.identification.vo2.heating import simulate_heating
from rtctl.identification.vo2.preisach_fit import fit_preisach
from rtctl.identification.vo2.staircase import extract_steady_states, simulate_hold_ends
from rtctl.measured.dataset import Dataset, Record
from rtctl.models.span import Span
from rtctl.models.vo2 import Vo2Model

FloatArray = NDArray[np.float64]
LOW, HIGH, CELLS = 3.7, 8.5, 48
HOLD = 20
DOMAINS = ((6.93, 6.02), (7.31, 6.48), (6.55, 5.71))
"""mA, up and down."""
STROKE_UM, NOISE = 60.0, {"deflection": 0.03, "resistance": 1e-3}


def on(v: FloatArray, up: FloatArray, down: FloatArray) -> FloatArray:
    """Share of the relays that are on along v (n,), all off at first."""
    state, found = np.zeros(len(up), bool), np.empty(len(v))
    for k, x in enumerate(v.tolist()):
        state = (x >= up) | (state & (x > down))
        found[k] = state.mean()
    return found


def readings(v: FloatArray, share: float, seed: int) -> dict[str, FloatArray]:
    """Of a film of which the domains are `share`, with noise."""
    draw = np.random.default_rng(5)
    centre, half = draw.normal(6.2, 0.45, 3000), 0.5 * np.abs(draw.normal(0.7, 0.2, 3000))
    up, down = np.array(DOMAINS).T
    phase = (1.0 - share) * on(v, centre + half, centre - half) + share * on(v, up, down)
    draw = np.random.default_rng(seed)
    noise = {name: size * draw.normal(size=len(v)) for name, size in NOISE.items()}
    return {
        "resistance": np.exp(12.0 - 2.0 * phase - 0.1 * v + noise["resistance"]),
        "deflection": STROKE_UM * phase - 0.8 * v + noise["deflection"],
    }


def dataset(share: float, steps: int = 97) -> Dataset:
    """A staircase of first-order reversal curves on so many levels, three records to fit and one to test."""
    levels = np.linspace(LOW, HIGH, steps)
    parts = [levels, levels[::-1]]
    for last in range(round(0.31 * steps), steps - 2, max(1, round(steps / 24))):
        parts += [levels[: last + 1 : 2], levels[last::-1]]
    staircase = np.concatenate(parts)
    inputs = [("identify", np.repeat(staircase[np.r_[True, np.diff(staircase) != 0.0]], HOLD))]
    for seed in range(4):
        draw = np.random.default_rng(100 + seed)
        turns = draw.uniform(4.5, 8.4, 60)
        inputs.append(("test" if seed == 3 else "fit", np.repeat(np.r_[LOW, turns], 25)))
    records = []
    for number, (use, current) in enumerate(inputs):
        v = simulate_heating(current, PERIOD_S, TAU_S)
        signals = {"current": current, **readings(v, share, seed=number)}
        records.append(
            Record(name=f"r{number}", file=f"r{number}.csv", use=use, period_s=PERIOD_S, signals=signals)
        )
    return Dataset(
        path=Path("dataset.toml"), name="film", plant="vo2", units=UNITS, holds={"current": "zero"},
        records=tuple(records),
    )  # fmt: skip


def identified(data: Dataset, cells: int = CELLS) -> Vo2Model:
    """As `rtctl identify` has its fine models, where the heating is known."""
    ends = extract_steady_states(data)
    v = simulate_hold_ends(data, TAU_S)
    u = -np.log(ends.resistance_ohm)
    with threadpool_limits(1, "blas"):
        film = fit_preisach(v, u, ends.scored, cells=cells)
        beam = fit_preisach(v, ends.deflection_um, ends.scored, cells=cells)
    scored = ends.scored
    return dataclasses.replace(
        small_model(), current=Span(LOW, HIGH),
        resistance=Span(float(ends.resistance_ohm[scored].min()), float(ends.resistance_ohm[scored].max())),
        deflection=Span(float(ends.deflection_um[scored].min()), float(ends.deflection_um[scored].max())),
        resistance_preisach=film.model, reading_error=float(film.residual.std()),
        deflection_preisach=beam.model, deflection_error=float(beam.residual.std()),
    )  # fmt: skip


@cache
def stepped_film() -> tuple[Dataset, Vo2Model]:
    """One of which the domains are three tenths, and its model."""
    data = dataset(share=0.3)
    return data, identified(data)
