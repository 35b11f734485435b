"""Parts of a law: an exported function with the constants and the memory that it needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.hysteresis.preisach.model import MAX_EXTREMA
from rtctl.translation.memory import Memory


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """An estimator or a feedforward."""

    name: str
    function: Callable[..., Any]
    constants: Mapping[str, Any]
    """NamedTuples by the names under which the function reads them."""
    memory: tuple[Memory, ...]
    sources: Mapping[str, str] = field(default_factory=dict)
    """Where constants come from, by `part.field` or `part`."""
    swings: bool = False
    """Whether the memory has a `swing`, the part of the estimate that the controller is not shown."""


class Rest(NamedTuple):
    """Where a part starts, and how large its memory may be."""

    level: float
    """The level at which the device is at rest [mA]."""
    extrema: int
    """Turning points that a Preisach memory keeps."""
    period_s: float
    """Sample period [s]."""


class Fit(NamedTuple):
    """Errors of the identified model."""

    error: float
    """Standard deviation of the deflection on its data [um]."""
    reading: float
    """How the error of a reading reaches the deflection; see the estimator."""


def shortened(stack: FloatArray, extrema: int) -> FloatArray:
    """Return a Preisach memory with room for fewer turning points: k, s_0 ..., H_0 ..."""
    return np.concatenate(
        (stack[:1], stack[1 : 1 + extrema], stack[1 + MAX_EXTREMA : 1 + MAX_EXTREMA + extrema])
    )


def preisach_sources(constant: str, model_key: str) -> dict[str, str]:
    """Return the sources of a Preisach model's parameters."""
    key = f"model.hysteresis.{model_key}"
    return {
        constant: key,
        f"{constant}.grid": f"{key}.grid",
        f"{constant}.nodes": f"Everett table of {key}.mu: row after row, left of the diagonal",
    }
