"""A small VO2 model with wide and few cells, made by hand, and currents that drive it through its transition."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from rtctl.border.model_file import MechanismTable, Value
from rtctl.border.simulation import Stimulus
from rtctl.hysteresis.egpi import EgpiModel
from rtctl.hysteresis.gap_free import GapFreeModel
from rtctl.hysteresis.gpi import GpiModel
from rtctl.hysteresis.preisach.model import PreisachModel
from rtctl.models.span import Span
from rtctl.models.vo2 import FitQuality, Vo2Model
from rtctl.simulations.vo2 import Vo2Simulation, vo2_simulation

UNITS = {"current": "mA", "resistance": "ohm", "deflection": "um"}
PERIOD_S = 1e-3
TAU_S = 1.8e-3
QUALITY = (
    "resistance_gpi", "composite", "gap_free_composite", "resistance_gap_free", "resistance_preisach",
    "deflection_egpi", "deflection_preisach", "direct_preisach", "direct_egpi",
)  # fmt: skip


def preisach(total: float, c: float, c1: float, sign: float = 1.0, cells: int = 12) -> PreisachModel:
    """Relays with up-thresholds about 7 mA and down-thresholds about 6.2 mA, `total` together."""
    grid = np.linspace(3.0, 9.5, cells + 1)
    centres = 0.5 * (grid[1:] + grid[:-1])
    up, down = np.meshgrid(centres, centres, indexing="ij")
    mass = np.exp(-(((up - 7.0) / 0.7) ** 2) - ((down - 6.2) / 0.7) ** 2)[np.tril_indices(cells)]
    return PreisachModel(grid=grid, mu=total * mass / mass.sum(), c=c, c1=c1, sign=sign)


def small_model() -> Vo2Model:
    """-ln R from -11.8 to about -9.3, deflection from about 0 to 55 um with a thermal bending against it."""
    plays = {
        "p": np.array([10.0, 1.0]), "r": np.array([0.0, 0.5]), "v_low": 3.7, "v_high": 8.5,
        "a_R": np.full(2, 1.5), "b_R": np.full(2, -10.0), "a_L": np.full(2, 1.5), "b_L": np.full(2, -9.6),
    }  # fmt: skip
    egpi = EgpiModel(**plays, c2=-1.0, c3=60.0)
    gpi = GpiModel(
        p=np.array([40.0, 1.0]), r=np.array([0.0, 0.5]), a_R=1.6, b_R=-11.4, a_L=1.6, b_L=-10.3, c=-70.0,
        v_low=3.7, v_high=8.5,
    )  # fmt: skip
    return Vo2Model(
        identity="small", time_constant_s=TAU_S, time_constant_error_s=1e-6,
        current=Span(3.7, 8.5), resistance=Span(11.2e3, 130.0e3), deflection=Span(-2.0, 56.0),
        reading_error=1e-3, deflection_error=0.05, resistance_gpi=gpi, composite_egpi=egpi,
        resistance_gap_free=GapFreeModel(**plays, q1=0.1, c=1.0), gap_free_egpi=egpi, deflection_egpi=egpi,
        resistance_preisach=preisach(2.0, -12.2, 0.1), deflection_preisach=preisach(62.0, 3.0, -0.8),
        direct_preisach=preisach(2.0, 0.0, 0.0), direct_egpi=egpi,
        quality=dict.fromkeys(QUALITY, FitQuality(0.1, 1.0, 0.5, "um", 57.0)),
    )  # fmt: skip


def simulation(**mechanisms: Mapping[str, float]) -> Vo2Simulation:
    """Of the small model with mechanisms by id (`__` for the dot) and their values in the units declared."""
    from rtctl.simulations.vo2 import MECHANISMS

    tables = []
    for name, values in mechanisms.items():
        one = MECHANISMS[name.replace("__", ".", 1)]
        units = {declared.name: declared.unit for declared in one.parameters}
        parameters = {key: Value(value=value, unit=units[key]) for key, value in values.items()}
        tables.append(MechanismTable(id=one.id, parameters=parameters))
    return vo2_simulation(dataclasses.replace(small_model(), mechanisms=tuple(tables)), UNITS, "case")


def telegraph(samples: int = 600, seed: int = 1) -> np.ndarray:
    """Levels [mA] that last 1 to 20 samples; the first one is the lowest."""
    rng = np.random.default_rng(seed)
    levels = np.repeat(rng.uniform(4.0, 8.4, samples), rng.integers(1, 20, samples))[:samples]
    levels[:5] = 3.8
    return levels


def stimulus(current: np.ndarray, hold: str = "zero", period_s: float = PERIOD_S) -> Stimulus:
    return Stimulus(inputs={"current": current}, holds={"current": hold}, period_s=period_s)


def predict(made: Vo2Simulation, given: Stimulus, refine: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Resistance and deflection of its own values."""
    values = np.array([one.value for one in made.parameters])
    found = made.predict(given, values, refine=refine)
    assert found.diverged_at[0] == -1
    return found.outputs["resistance"][0], found.outputs["deflection"][0]
