"""Laws that look alike about another zero of the displacement: a constant force on a cubic spring, and a quadratic one.

About the place z0 to which a constant force moves the device, the force of the spring is k' y + 3 k3 z0 y^2 + k3 y^3.
"""

from collections.abc import Callable

from plant_sim.oscillator.mechanism import Values

SHOW_THE_PLACE = frozenset({
    "damping.nonlinear", "stiffness.quintic", "stiffness.parametric", "stiffness.drift", "stiffness.gravity",
    "stiffness.clearance", "stop.one_sided", "stop.two_sided",
    "drive.saturation", "drive.deadband", "drive.harmonics", "input.gain_drift", "actuator.backlash",
    "actuator.hysteresis",
})  # fmt: skip
"""Mechanisms that act by the displacement itself, or on the whole drive: beside them the two are not alike."""


def alike_about_another_zero(other: str) -> Callable[[Values], tuple[str, ...]]:
    """Return the function that names `other` for a model's parameters by name, where nothing in it shows the place."""

    def alike(p: Values) -> tuple[str, ...]:
        acting = {name.rpartition(".")[0] for name in p}
        return (other,) if p.get("stiffness_cubic") and not acting & SHOW_THE_PLACE else ()

    return alike
