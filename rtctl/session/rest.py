"""Whether a loop begins at rest, from where every model starts."""

from __future__ import annotations

from typing import Any

from rtctl.output.readable_units import readable
from rtctl.scenario.schema import Scenario

TIME_CONSTANTS_AT_REST = 5.0
"""Of the model's heating: after so many a step is over to 0.7 %."""
ADVISED_TIME_CONSTANTS = 10.0


def begins_too_early(scenario: Scenario, model: Any) -> str:
    """Return what to know of a hold before the first sample that is too short for the model; "": it is not."""
    time_constant_s = getattr(model, "time_constant_s", 0.0)
    settle_s = scenario.clock.settle_s
    if settle_s >= TIME_CONSTANTS_AT_REST * time_constant_s:
        return ""
    advised = readable(ADVISED_TIME_CONSTANTS * time_constant_s, "s", 3)
    return (
        f"the loop begins before the device is at rest, and its estimate will be off: clock.settle = "
        f"{readable(settle_s, 's', 2)}, the time constant of the model is {readable(time_constant_s, 's', 2)}; "
        f'--set clock.settle="{advised}"'
    )
