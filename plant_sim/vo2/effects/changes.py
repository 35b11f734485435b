"""Changes of a VO2 device while it runs: `[[changes]]` of its file, each from a time after power-up on.

    [[changes]]
    at = "40 s"
    delay = "3 ms"          # any key of [effects]; what is not named stays as it is

A device that changes runs on the kernels with effects from power-up on, so that nothing but the effect begins then.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from plant_sim.vo2.effects.inspection import UNITS
from plant_sim.vo2.effects.table import Effects
from rtctl.border.units.quantities import Quantity


class Change(Effects):
    """One `[[changes]]` table."""

    at: Annotated[float, Quantity("s"), Field(ge=0.0)]
    """Time after power-up from which on it acts [s]."""

    def named(self) -> dict[str, float]:
        """Return the effects that the table names."""
        return {name: getattr(self, name) for name in UNITS if name in self.model_fields_set}


class Stage(NamedTuple):
    """The effects in force from a time on."""

    at_s: float
    effects: Effects


def ordered(begin: Effects, changes: Sequence[Change]) -> tuple[Stage, ...]:
    """Return what is in force after each change. Raises ValueError on one that is late, empty or impossible.

    Args:
        begin: the effects from power-up on.
        changes: in the order of the file.
    """
    stages: list[Stage] = []
    now = {name: getattr(begin, name) for name in UNITS if name in begin.model_fields_set}
    for number, change in enumerate(changes):
        if stages and not change.at > stages[-1].at_s:
            raise ValueError(
                f"changes.{number}.at ({change.at:g} s) must be later than that of the change before "
                f"({stages[-1].at_s:g} s)"
            )
        if not change.named():
            raise ValueError(f'changes.{number} names no effect; name one, such as delay = "3 ms"')
        now |= change.named()
        stages.append(Stage(change.at, Effects.model_validate(_quantities(now))))
    return tuple(stages)


def _quantities(numbers: dict[str, float]) -> dict[str, Any]:
    """Return numbers as a file has them."""
    return {name: {"value": number, "unit": UNITS[name]} for name, number in numbers.items()}
