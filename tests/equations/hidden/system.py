"""A system whose equations are written here again, with places where an effect may act: no code of the program."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from rtctl.border.arrays import FloatArray

SHIPPED = Path(__file__).resolve().parents[3] / "scenarios" / "models" / "equations"
Values = Mapping[str, float | FloatArray]


@dataclass(frozen=True, kw_only=True)
class HiddenSystem:
    """A system: x (states, records), u (records,), all in the units of its model file unless SI is said."""

    model: str
    rates: Callable[[FloatArray, FloatArray, Values], list[FloatArray]]
    output: Callable[[FloatArray, FloatArray, Values], FloatArray]
    parameters: dict[str, float]
    start: tuple[float, ...]
    period_s: float
    input: tuple[str, str, float, float]
    """Name, unit, mean and largest departure from it."""
    reading: tuple[str, str]
    states: tuple[str, ...]
    hold_samples: int
    """Samples for which the shortest level of the input is held."""
    references: tuple[float, ...]
    """Values from which the states are counted."""
    known: tuple[str, ...] = ()
    """Parameters whose values in the model file are right."""
    follows: tuple[str, ...] = ()
    """Effects that the fitted parameters take over, so that they are none."""
    folder: Path = SHIPPED
    """Where the model file lies."""

    @property
    def path(self) -> Path:
        return self.folder / f"{self.model}.toml"
