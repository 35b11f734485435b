"""A model's laws as sources for who estimates its states: `law(x, u, p, out) -> 0`, all in SI base units at t = 0.

Rates are 0 where a state is at a limit that they point beyond. What the functions of the language (`exp`, `power`, ...)
stand for is the estimator's: it need not compute them as the simulation does.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from plant_sim.equations.compiled.own_functions import functions_in
from plant_sim.equations.compiled.source import PYTHON, law_source, numbers_source
from plant_sim.equations.language.tree import Number, Operation, Tree
from plant_sim.equations.system import System
from rtctl.border.equations.controlled import LawSources

ESTIMATORS = PYTHON._replace(parameter="p[{k}]", power="power({base}, {exponent})")
"""The dialect: parameters of one device, powers by a function."""


def estimator_sources(system: System) -> LawSources:
    """Return the sources of rates (states,), outputs (outputs,) in their units, and of what events watch and set."""
    states = range(len(system.states))
    rates = law_source(system, "", _tail(states, "rates"), limited=True, dialect=ESTIMATORS)
    found = {
        "rates": rates,
        "outputs": _numbers(system, [_in_unit(one.value, one.factor) for one in system.outputs]),
        "guards": _numbers(system, [one.when for one in system.events]),
        "resets": _numbers(
            system, [tree for _, tree in system.settings], [place for place, _ in system.settings]
        ),
    }
    whole = {name: _headed(name, body) for name, body in found.items()}
    return LawSources(**whole, own=functions_in("".join(whole.values())))


def _in_unit(value: Tree, factor: float) -> Tree:
    return value if factor == 1.0 else Operation("/", value, Number(factor))


def _numbers(system: System, trees: Sequence[Tree], places: Sequence[int] | None = None) -> str:
    return numbers_source(
        system,
        tuple(trees),
        "",
        _tail(range(len(trees)) if places is None else places, "numbers"),
        ESTIMATORS,
    )


def _tail(places: Sequence[int], word: str) -> str:
    """Return the last lines of a law, with `{word}` in the place of a list of numbers."""
    if not places:
        return "return 0"
    return f"{''.join(f'out[{place}], ' for place in places)}= {{{word}}},\n    return 0"


def _headed(name: str, body: str) -> str:
    """Return the function of a body, which takes from the arrays what it uses."""
    used = set(re.findall(r"\b[xu]\d+\b|\bt\b", body))
    lines = [
        f"{one} = {one[0]}[{one[1:]}]" for one in sorted(used - {"t"}, key=lambda one: (one[0], int(one[1:])))
    ]
    if "t" in used:
        lines.append("t = 0.0")
    return f"def {name}(x, u, p, out):\n{''.join(f'    {line}' + chr(10) for line in lines)}{body}"
