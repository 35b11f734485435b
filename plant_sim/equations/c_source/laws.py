"""The laws of a model as C functions: rates, outputs, what its events watch and set; all in SI base units."""

from __future__ import annotations

import math
from collections.abc import Iterable

from plant_sim.equations.compiled.source import Dialect, law_source, numbers_source
from plant_sim.equations.language.tree import Tree
from plant_sim.equations.system import System

C = Dialect(
    line="const double {variable} = {value};",
    parameter="p[{k}]",
    power="pow({base}, {exponent})",
    choice="({condition}) ? {one} : {other}",
    either=" || ",
    both=" && ",
    negation="!{of}",
    unequal="!=",
    also="&&",
)
ARGUMENTS = "(const double *x, const double *u, double t, const double *p, double *out)"


def laws(system: System, *, plain: bool, limited: bool) -> str:
    """Return the C of the laws.

    Args:
        system: The equations.
        plain: Whether `rates` is needed.
        limited: Whether `limited_rates` is, which are 0 where a state is at a limit that its rate points beyond.
    """
    tail = _tail(range(len(system.states)), "rates")
    parts = [
        law_source(system, _head(system, name), tail, limited=name == "limited_rates", dialect=C)
        for name, wanted in (("rates", plain), ("limited_rates", limited))
        if wanted
    ]
    parts.append(_numbers(system, "outputs", tuple(one.value for one in system.outputs)))
    if system.events:
        parts.append(_numbers(system, "guards", tuple(one.when for one in system.events)))
        parts.append(
            _numbers(
                system,
                "resets",
                tuple(tree for _, tree in system.settings),
                [place for place, _ in system.settings],
            )
        )
    return "\n".join(part + "}\n" for part in parts)


def numbers(name: str, values: Iterable[float], zero: str = "0.0") -> str:
    """Return the definition of a table of constants."""
    listed = ", ".join(number(value) for value in values) or zero
    return f"static const double {name}[] = {{{listed}}};\n"


def number(value: float) -> str:
    """Return a literal of C that reads back as the same double."""
    if math.isinf(value):
        return "HUGE_VAL" if value > 0.0 else "-HUGE_VAL"
    return repr(float(value))


def _numbers(system: System, name: str, trees: tuple[Tree, ...], places: list[int] | None = None) -> str:
    tail = _tail(range(len(trees)) if places is None else places, "numbers")
    return numbers_source(system, trees, _head(system, name), tail, C)


def _head(system: System, name: str) -> str:
    """Return the first lines of a function; those of names that it does not use say so to the compiler."""
    lines = [f"static void {name}{ARGUMENTS}", "{", "    (void)x; (void)u; (void)t; (void)p;"]
    for letter, count in (("x", len(system.states)), ("u", len(system.inputs))):
        lines += [f"    const double {letter}{k} = {letter}[{k}];" for k in range(count)]
        lines += [f"    (void){letter}{k};" for k in range(count)]
    return "\n".join(lines) + "\n"


def _tail(places: Iterable[int], word: str) -> str:
    """Return the last lines of a function, with `{word}` in the place of a list of numbers."""
    kept = list(places)
    copies = " ".join(f"out[{place}] = made[{k}];" for k, place in enumerate(kept))
    return f"{{{{ const double made[] = {{{{ {{{word}}} }}}}; {copies} }}}}"
