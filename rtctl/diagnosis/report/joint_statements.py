"""Statements on two causes together: dry friction beside a constant force depends on the direction.

z'' + ... = gain (u + offset) - level sign z':   level - gain offset opposes motion forwards, level + gain offset
motion backwards.
"""

from __future__ import annotations

from typing import NamedTuple

from rtctl.border.simulation import Simulation


class Friction(NamedTuple):
    """Dry friction by the direction of the motion."""

    forwards: float
    backwards: float
    unit: str


def joint_statements(simulation: Simulation) -> dict[str, list[str]]:
    """Return sentences by the id of the cause that they belong to."""
    friction = friction_by_direction(simulation)
    if friction is None:
        return {}
    forwards, backwards = (
        f"{level:.4g} {friction.unit}" for level in (friction.forwards, friction.backwards)
    )
    return {
        "friction.coulomb": [
            "With the constant force that drive.offset stands for, it depends on the direction: "
            f"{forwards} against motion forwards, {backwards} against motion backwards."
        ]
    }


def friction_by_direction(simulation: Simulation) -> Friction | None:
    """Return the friction by direction of a simulation with dry friction and an offset of the drive; else None."""
    values = {parameter.name: parameter.value for parameter in simulation.parameters}
    units = {parameter.name: parameter.unit for parameter in simulation.parameters}
    level, offset = values.get("friction.coulomb.level"), values.get("drive.offset.offset")
    gain = values.get("drive_gain")
    if level is None or offset is None or gain is None or offset * gain == 0.0:
        return None
    push = gain * offset
    return Friction(level - push, level + push, units["friction.coulomb.level"])
