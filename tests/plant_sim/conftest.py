"""Devices for the tests: bundled ones, with single keys replaced."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from numpy.typing import NDArray

from plant_sim.catalogue import bundled_plant
from plant_sim.vo2.device_file import DeviceFile
from plant_sim.vo2.plant import Vo2Plant
from rtctl.border.units.quantities import check, read_toml

settings.register_profile("compiled", deadline=None)  # the first example of a kernel compiles it
settings.load_profile("compiled")

MakeDevice = Callable[..., Vo2Plant]

SILENT = {
    "sensing.white": "0 V",
    "sensing.flicker": "0 1/Hz^0.5",
    "sensing.converter_bits": 0,
    "sensing.reference": "0 um",
}


@pytest.fixture(scope="session")
def make_device() -> MakeDevice:
    """`make_device("vo2_a", {"hysteresis.coupling": "0 K"}, seed=3)`."""

    def make(name: str = "vo2_a", keys: dict[str, Any] | None = None, seed: int | None = None) -> Vo2Plant:
        tables = read_toml(bundled_plant(name))
        for key, value in (keys or {}).items():
            *path, last = key.split(".")
            table = tables
            for part in path:
                table = table[part]
            table[last] = value
        return Vo2Plant(check(DeviceFile, tables, name), seed)

    return make


@pytest.fixture(scope="session")
def silent() -> dict[str, Any]:
    """Keys that switch every imperfection of the instruments off."""
    return SILENT


def _quasi_static(device: Vo2Plant, currents_mA: NDArray[np.float64]) -> NDArray[np.float64]:
    rows = []
    for current in currents_mA:
        device.advance((float(current),), 0.01)
        rows.append((device.resistance_ohm, device.deflection_um))
    return np.array(rows).T


@pytest.fixture(scope="session")
def quasi_static() -> Callable[[Vo2Plant, NDArray[np.float64]], NDArray[np.float64]]:
    """True resistance [ohm] and deflection [um] at the end of 10 ms holds, as the paper measures them."""
    return _quasi_static
