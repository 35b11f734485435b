"""A plant as C source: what crosses from a kind of plant, which writes it, to an export, which wraps and compiles it.

The source defines three functions of `plant`, a plain structure of doubles whose sizes follow from the record (see
`rtctl/border/exported/plant.h`): all memory of the plant is in it, so a copy of the structure is a copy of the state.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from rtctl.border.errors import InputError
from rtctl.border.simulation import Stimulus


@dataclass(frozen=True, slots=True, kw_only=True)
class CRequest:
    """What an export asks of a plant."""

    step_s: float | None = None
    """Time between two communication points [s]; None: the kind of plant proposes one."""
    stimuli: tuple[Stimulus, ...] = ()
    """Records that the plant's integration must resolve as their simulation does; the first sets the step."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Units of the signals of the records."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CVariable:
    """An input, output, state or parameter."""

    name: str
    unit: str
    value: float = 0.0
    """Value at the start; of an output it is computed."""
    meaning: str = ""
    low: float | None = None
    """Lower bound; None: there is none."""
    high: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CPlant:
    """A plant as C source."""

    kind: str
    inputs: tuple[CVariable, ...]
    outputs: tuple[CVariable, ...]
    states: tuple[CVariable, ...]
    """States that a user sees; `value` is that at the start."""
    parameters: tuple[CVariable, ...]
    memory: int
    """Numbers that the plant keeps besides, `plant.memory`."""
    step_s: float
    """Proposed time between two communication points [s]."""
    longest_step_s: float
    """Longest step of the integrator [s] unless it is set."""
    method: str
    """Method of the integrator, in words."""
    source: str
    """C99: definitions of plant_start, plant_advance, plant_read; it may include <math.h> and <string.h>."""
    direct: tuple[tuple[str, ...], ...]
    """Inputs on which each output depends without delay."""
    mechanisms: tuple[str, ...] = ()
    """Ids of the mechanisms in it."""


LEAST_KEPT, MOST_KEPT = 256, 65536
"""Communication steps that are remembered of an input that is delayed."""


def steps_kept(delay_s: float, step_s: float, what: str) -> int:
    """Return how many communication steps of `step_s` [s] are remembered: 16 times those that a delay holds.

    An importer may cut the proposed step into shorter ones.

    Args:
        delay_s: The delay [s].
        step_s: Proposed communication step [s].
        what: Source and mechanism, for the message.

    Raises:
        InputError: The delay holds more than can be remembered.
    """
    held = math.ceil(delay_s / step_s)
    if held > MOST_KEPT:
        raise InputError(
            f"{what} of {delay_s:g} s holds {delay_s / step_s:.3g} communication steps of {step_s:g} s; "
            f"a unit remembers {MOST_KEPT}: ask for a longer step "
            "(--step), or put the delay before the unit in the simulator"
        )
    return min(max(16 * held, LEAST_KEPT), MOST_KEPT)


HEADER = Path(__file__).with_name("plant.h")
"""The structure and the three functions, for all plants."""


def sizes(plant: CPlant) -> dict[str, int]:
    """Return the sizes that `plant.h` needs, by their names in C."""
    return {
        "PLANT_INPUTS": len(plant.inputs),
        "PLANT_OUTPUTS": len(plant.outputs),
        "PLANT_STATES": len(plant.states),
        "PLANT_PARAMETERS": len(plant.parameters),
        "PLANT_MEMORY": plant.memory,
    }
