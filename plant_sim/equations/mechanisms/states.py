"""Mechanisms of a state: terms of its rate, in the language of the equations.

x counts from zero; of a temperature it counts from the state's start. Friction is written without tanh and exp, which
took ten times as long in a kernel of all terms: x / sqrt(x^2 + width^2) for the sign, and of the forms by which the
excess of break-away friction fades the algebraic one (Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994)
1083, section 3).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from plant_sim.equations.mechanisms.mechanism import (
    RATES,
    SLOW,
    EquationsMechanism,
    coefficient,
    place,
    shape,
)
from plant_sim.equations.mechanisms.sizes import QUANTILES, Size
from plant_sim.equations.mechanisms.words import Names, counted, reference_of
from plant_sim.equations.system import State
from rtctl.border.mechanisms import Parameter

WIDTH = 0.05
"""Share of a state's size over which the sign of its friction changes."""
STEEP = 10.0
"""Rate of a limit, over that of the state's motion, at which the limit is nearly hard."""


class StateLaw(NamedTuple):
    """A law of a state; its texts have {d} for the state, {w} for a companion and its parameters by name."""

    statement: str
    parameters: Callable[[str, Size], tuple[Parameter, ...]]
    """Return the declarations from the state's unit and sizes."""
    rate: str
    """Added to the rate of the state."""
    forms: Mapping[str, str] = {}
    companion: str = ""
    """Rate of a further state; "" where the law has none."""


def _friction(unit: str, size: Size) -> tuple[Parameter, ...]:
    return (
        coefficient("level", f"({unit})/s", "of the friction", size.rate, low=0.0, kinked=True),
        shape(
            "excess", "dimensionless", "of the friction at break-away, over its level", lambda s: 1.0,
            default=0.0, simplest=0.0, shape_range=(0.3, 3.0), grid=2,
        ),
        shape(
            "film", unit, "over which the excess fades", lambda s: size.rms, default=0.3 * size.rms, low=1e-300,
        ),
        shape(
            "width", unit, "over which its sign changes", lambda s: size.rms, default=WIDTH * size.rms,
            low=1e-300, redundant=True,
        ),
    )  # fmt: skip


def _quadratic(unit: str, size: Size) -> tuple[Parameter, ...]:
    most = size.rate / size.rms**2
    return (
        coefficient("even", f"1/(({unit})*s)", "of the square", most, default=0.0),
        coefficient("odd", f"1/(({unit})*s)", "of the square with the sign of the state", most, default=0.0),
    )


def _cubic(unit: str, size: Size) -> tuple[Parameter, ...]:
    return (coefficient("cubic", f"1/(({unit})^2*s)", "of the cube", size.rate / size.rms**3),)


def _leak(unit: str, size: Size) -> tuple[Parameter, ...]:
    return (coefficient("rate", "1/s", "of the decay", size.rate / size.rms),)


def _limit(unit: str, size: Size) -> tuple[Parameter, ...]:
    most = STEEP * size.rate / size.deviation
    at = dict(zip(QUANTILES, size.quantiles, strict=True))
    span = at[0.98] - at[0.02]
    high, low = (at[0.9], at[0.98], at[0.75]), (at[0.1], at[0.02], at[0.25])
    return (
        coefficient("above", "1/s", "at which the state goes back below its upper limit", most,
                    low=0.0, default=0.0),
        coefficient("below", "1/s", "at which the state goes back above its lower limit", most,
                    low=0.0, default=0.0),
        place("upper", unit, "upper limit", high, of_form="above", low=at[0.5], high=at[0.98] + 0.5 * span),
        place("lower", unit, "lower limit", low, of_form="below", low=at[0.02] - 0.5 * span, high=at[0.5]),
    )  # fmt: skip


def _slow(unit: str, size: Size) -> tuple[Parameter, ...]:
    return (
        coefficient("rate", "1/s", "of the exchange", size.rate / size.deviation, low=0.0),
        shape("time", "s", "time constant of the slow part", lambda s: 10.0 / s.rate, low=1e-300,
              shape_range=(0.1, 30.0), grid=3),
    )  # fmt: skip


def _input(unit: str, size: Size) -> tuple[Parameter, ...]:
    return (coefficient("constant", f"({unit})/s", "of the rate", size.rate),)


LAWS: dict[str, StateLaw] = {
    "friction": StateLaw(
        "Dry friction of {level} acts on the {s}.",
        _friction,
        "-{level}*(1 + {excess}*{film}^2/({film}^2 + {d}^2))*{d}/sqrt({d}^2 + {width}^2)",
        {"excess": "Friction of {level} acts on the {s}, {excess} of it more at break-away, which fades over {film} "
                   "(Stribeck)."},
    ),
    "quadratic": StateLaw(
        "The rate of the {s} has a quadratic term: {even} times its square, {odd} times it with its sign, are lost.",
        _quadratic,
        "-{even}*{d}^2 - {odd}*{d}*abs({d})",
        {"even": "The rate of the {s} has a quadratic term: {even} times its square is lost.",
         "odd": "The rate of the {s} has a quadratic term that opposes it: {odd} times its square is lost."},
    ),
    "cubic": StateLaw(
        "The rate of the {s} has a cubic term: {cubic} times its cube is lost.", _cubic, "-{cubic}*{d}^3"
    ),
    "leak": StateLaw("The {s} leaks at a rate of {rate}.", _leak, "-{rate}*{d}"),
    "limit": StateLaw(
        "The {s} is limited to {lower} ... {upper} (at {below} and {above}).",
        _limit,
        "-{above}*max({x} - {upper}, 0) + {below}*max({lower} - {x}, 0)",
        {"above": "The {s} is limited to {upper}: what is above goes back at a rate of {above}.",
         "below": "The {s} is limited to {lower}: what is below goes back at a rate of {below}."},
    ),
    "slow": StateLaw(
        "The {s} exchanges with a slow part of itself, at a rate of {rate} and with a time constant of {time}.",
        _slow,
        "-{rate}*({x} - {w})",
        companion="({x} - {w})/{time}",
    ),
    "input": StateLaw(
        "A constant input that was not measured adds {constant} to the rate of the {s}.", _input, "{constant}"
    ),
}  # fmt: skip
IDLE = {"time": 1e30, "excess": 0.0}
"""Values [SI] of shapes while their law does not act: a slow part that does not move; others are 1."""


def state_mechanisms(state: State, size: Size, names: Names) -> list[EquationsMechanism]:
    """Return the mechanisms of a state, in its unit."""
    words, reference = f"state {state.name} [{state.unit}]", reference_of(state)
    referred = {state.name: names.new(f"{state.name}_reference")} if reference else {}
    found = []
    for key, law in LAWS.items():
        parameters = law.parameters(state.unit, size)
        own = {one.name: names.new(f"{state.name}_{key}_{one.name}") for one in parameters}
        companion = names.new(f"{state.name}_{key}") if law.companion else ""
        filled = own | {"x": state.name, "d": counted(state.name, referred), "w": companion}
        found.append(
            EquationsMechanism(
                id=f"state.{state.name}.{key}",
                statement=law.statement.replace("{s}", words),
                forms={name: text.replace("{s}", words) for name, text in law.forms.items()},
                parameters=parameters,
                family=SLOW if law.companion else RATES,
                names=own,
                target=state.name,
                text=law.rate.format(**filled),
                companion=companion,
                companion_rate=law.companion.format(**filled) if law.companion else "",
                references=dict.fromkeys(referred.values(), (state.unit, reference)),
            )
        )
    return found
