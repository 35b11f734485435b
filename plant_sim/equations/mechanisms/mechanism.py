"""A mechanism of a system of equations: a law on a signal's course, or terms added to the equations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from plant_sim.oscillator.mechanism import OscillatorMechanism
from rtctl.border.mechanisms import Mechanism, Parameter

RATES, SLOW, PARAMETERS = "rates", "slow", "parameters"
"""Families of mechanisms whose terms stand in the equations; each is compiled together."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EquationsMechanism(Mechanism):
    """A mechanism with its place in a system."""

    signal: str = ""
    """Input or output on which `law` acts; "" for terms of equations."""
    law: OscillatorMechanism | None = None
    """What it does to the course of `signal`; the declared parameters are those of this mechanism, not of the law."""
    family: str = ""
    """Family of its terms; "" where it acts on a signal."""
    names: Mapping[str, str] = field(default_factory=dict)
    """Name in the equations of each parameter of its terms."""
    target: str = ""
    """State whose rate, or parameter whose value, its terms change."""
    text: str = ""
    """What is added to the rate of `target`, or to the 1 by which a parameter is multiplied."""
    companion: str = ""
    """Name of a further state; "" where it has none. It begins where `target` begins."""
    companion_rate: str = ""
    references: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    """Values from which courses are counted, with their units, by name in the equations."""

    @property
    def acts_on_input(self) -> bool:
        """Whether it changes the inputs before they reach the equations: lanes with other values cannot share them."""
        return self.law is not None and (self.law.input is not None or self.law.drive is not None)


def coefficient(name: str, unit: str, meaning: str, size: float, **more: Any) -> Parameter:
    """Return a parameter that switches its mechanism off at zero; at `size` it matters as much as all else."""
    return Parameter(name=name, unit=unit, meaning=meaning, scale=lambda scales: size, neutral=0.0, **more)


def place(name: str, unit: str, meaning: str, places: tuple[float, ...], **more: Any) -> Parameter:
    """Return a shape that is a place of the motion: a search tries each of `places`."""
    return Parameter(
        name=name, unit=unit, meaning=meaning, scale=lambda scales: abs(places[0]) or 1.0, neutral=None,
        default=places[0], also=places[1:], **more,
    )  # fmt: skip


def shape(name: str, unit: str, meaning: str, scale: Callable[[Any], float], **more: Any) -> Parameter:
    """Return a positive parameter for how a mechanism acts."""
    return Parameter(
        name=name, unit=unit, meaning=meaning, scale=scale, neutral=None, **({"low": 0.0} | more)
    )


def in_unit(declared: Parameter, unit: str) -> Parameter:
    """Return a parameter of a law on a signal in the signal's `unit`."""
    return replace(declared, unit=declared.unit_in(z=unit, u=unit, y=unit))
