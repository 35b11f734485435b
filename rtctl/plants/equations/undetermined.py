"""Note on the parameters of a user's equations that the records cannot tell: a fit leaves them where they are."""

from __future__ import annotations

from typing import Any

HELD = (
    "these data cannot tell {} from the other parameters: {} and the others are right for that; fix a parameter that "
    "you know, or measure a further output, to choose which"
)


def describe_held(simulation: Any) -> list[str]:
    """Return a note on the parameters that a simulation of equations holds, although its file leaves them free."""
    own = zip(simulation.system.parameters, simulation.parameters, strict=False)
    held = [one for declared, one in own if one.fixed and not declared.fixed]
    if not held:
        return []
    values = " and ".join(f"{one.name} stays at {one.value:.4g} {one.unit}" for one in held)
    return [HELD.format(" and ".join(one.name for one in held), values)]
