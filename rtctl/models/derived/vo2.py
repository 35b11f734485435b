"""A VO2 actuator in the terms of those who drive it: how fast, how far, how many ohm, where it switches.

The corner frequency of the heating is 1 / (2 pi tau). A switching current is that at which the major loop of the steady
deflection passes its middle, while the current rises or falls; their difference is the width of the hysteresis.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from rtctl.models.derived.quantity import Derived, Estimated, derive
from rtctl.models.vo2 import Vo2Model

CURRENTS = 400
"""Currents along each branch of the major loop."""


def derive_vo2(
    model: Vo2Model, estimates: Mapping[str, Mapping[str, Estimated]], units: Mapping[str, str]
) -> tuple[Derived, ...]:
    """Return what follows from a model and its estimated time constant.

    Args:
        model: The identified model, or the extended one.
        estimates: Fitted parameters by mechanism ("": the nominal model) and name.
        units: Unit of each signal of the data; not used, the model has units of its own.
    """
    tau = estimates.get("", {}).get("time_constant")
    ohm, um = model.resistance, model.deflection
    return (
        *derive("time constant of the heating", "s", lambda s: s, tau),
        *derive("corner frequency of the heating", "Hz", lambda s: 1.0 / (2.0 * math.pi * s), tau),
        _plain("range of the deflection", um.width, "um"),
        _plain("resistance of the cold film", ohm.high, "ohm"),
        _plain("resistance of the hot film", ohm.low, "ohm"),
        *_switching(model),
    )  # fmt: skip


def _switching(model: Vo2Model) -> list[Derived]:
    """Return the switching currents and the width of the loop; none where the loop does not pass its middle."""
    rising = np.linspace(model.current.low, model.current.high, CURRENTS)
    path = np.concatenate((rising, rising[::-1]))
    deflection = model.deflection_preisach.simulate(path)
    middle = 0.5 * (float(deflection.min()) + float(deflection.max()))
    heating, cooling = deflection[:CURRENTS], deflection[CURRENTS:][::-1]
    found = []
    for branch in (heating, cooling):
        beyond = np.flatnonzero((branch - middle) * (branch[-1] - middle) > 0.0)
        if not len(beyond) or beyond[0] == 0:
            return []
        found.append(float(rising[beyond[0]]))
    return [
        _plain("switching current, heating", found[0], "mA"),
        _plain("switching current, cooling", found[1], "mA"),
        _plain("width of the hysteresis", found[0] - found[1], "mA"),
    ]


def _plain(name: str, value: float, unit: str) -> Derived:
    """Return a quantity whose error is not known."""
    return Derived(name, value, math.nan, math.nan, unit)
