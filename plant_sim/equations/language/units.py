"""Units of an expression, term by term: sums, comparisons and arguments of functions must fit, or a message says where.

A unit is pint's; None is that of the number 0, which fits every unit. Angles are plain numbers, as sin(x) needs them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

from plant_sim.equations.language.evaluation import constant
from plant_sim.equations.language.functions import FUNCTIONS, Asks
from plant_sim.equations.language.tree import (
    Call,
    Comparison,
    Logic,
    Name,
    Negative,
    Number,
    Operation,
    Own,
    Tree,
    terms_of,
    written,
)
from rtctl.border.units.quantities import unit_registry
from rtctl.border.units.unit_text import parsed_unit

Unit: TypeAlias = Any  # of pint, whose types mypy takes for two; None: of the number 0
PLAIN = "a plain number"
ROUNDING = 1e-9
"""Difference of exponents below which two units are one: of roots."""


def named(unit: Unit) -> str:
    """Return a unit as people write it."""
    text = "" if unit is None else f"{unit:~C}".replace("**", "^")
    return text or PLAIN


def stated(unit: Unit) -> str:
    """Return the predicate of a sentence on a term in this unit."""
    return f"is {'' if named(unit) == PLAIN else 'in '}{named(unit)}"


def fits(one: Unit, other: Unit) -> bool:
    """Return whether two units measure the same."""
    if one is None or other is None:
        return True
    return all(abs(power) < ROUNDING for power in (one / other).dimensionality.values())


def check_terms(tree: Tree, scope: Mapping[str, Unit], expected: Unit) -> None:
    """Raise ValueError that names the first term of a sum which is not in the unit that is expected."""
    for term in terms_of(tree):
        found = unit_of(term, scope)
        if not fits(found, expected):
            raise ValueError(f'the term "{written(term)}" {stated(found)}, {named(expected)} is needed')


def unit_of(tree: Tree, scope: Mapping[str, Unit]) -> Unit:
    """Return the unit of a tree. Raises ValueError in words where its parts do not fit.

    Args:
        tree: The expression; all its names are in `scope`.
        scope: Unit of each name.
    """
    match tree:
        case Number(value):
            return None if value == 0.0 else unit_registry().dimensionless
        case Name(name):
            return scope[name]
        case Negative(of):
            return unit_of(of, scope)
        case Operation("^", base, exponent):
            return _power(tree, base, exponent, scope)
        case Operation(operator, left, right):
            if operator in "+-":
                return _common(list(terms_of(tree)), scope, written(tree))
            one, other = unit_of(left, scope), unit_of(right, scope)
            if one is None or other is None:
                return None
            return one * other if operator == "*" else one / other
        case Call() | Own():
            return _of_call(tree, scope) if isinstance(tree, Call) else _of_own(tree, scope)
        case Comparison(_, left, right):
            _common([left, right], scope, written(tree))
            return unit_registry().dimensionless
        case Logic(_, conditions):
            for condition in conditions:
                unit_of(condition, scope)
            return unit_registry().dimensionless


def _common(parts: Sequence[Tree], scope: Mapping[str, Unit], whole: str) -> Unit:
    """Return the unit that all parts have. Raises ValueError that names the two parts that do not fit."""
    first: Unit = None
    named_by = parts[0]
    for part in parts:
        unit = unit_of(part, scope)
        if not fits(first, unit):
            raise ValueError(
                f'in "{whole}" the term "{written(part)}" {stated(unit)}, "{written(named_by)}" {stated(first)}; both '
                "need one unit"
                + (": give the number as a parameter with its unit" if isinstance(part, Number) else "")
            )
        if first is None and unit is not None:
            first, named_by = unit, part
    return first


def _power(tree: Tree, base: Tree, exponent: Tree, scope: Mapping[str, Unit]) -> Unit:
    under, above = unit_of(base, scope), unit_of(exponent, scope)
    if not fits(above, unit_registry().dimensionless):
        raise ValueError(f'the exponent "{written(exponent)}" {stated(above)}, a plain number is needed')
    if under is None or fits(under, unit_registry().dimensionless):
        return unit_registry().dimensionless
    power = constant(exponent)
    if power is None:
        raise ValueError(
            f'in "{written(tree)}" the exponent must be a number, because "{written(base)}" {stated(under)}; '
            "divide it by a parameter of that unit"
        )
    if not abs(power) <= 100.0:
        raise ValueError(f'in "{written(tree)}" the exponent {power:g} is too large, at most 100')
    return under**power


def _of_own(tree: Own, scope: Mapping[str, Unit]) -> Unit:
    """Return the unit that the class declares, if its arguments are in those that it declares."""
    block = tree.block
    assert block is not None  # trees are bound to their class before units are asked
    for argument, name, unit in zip(tree.arguments, block.arguments, block.argument_units, strict=True):
        found = unit_of(argument, scope)
        if not fits(found, parsed_unit(unit)):
            raise ValueError(
                f'in "{written(tree)}" the argument {name} "{written(argument)}" {stated(found)}, '
                f"{named(parsed_unit(unit))} is needed"
            )
    return parsed_unit(block.member_units[block.members.index(tree.member)])


def _of_call(tree: Call, scope: Mapping[str, Unit]) -> Unit:
    plain = unit_registry().dimensionless
    text = written(tree)
    asks = FUNCTIONS[tree.function].asks
    if asks is Asks.NUMBER:
        (argument,) = tree.arguments
        unit = unit_of(argument, scope)
        if not fits(unit, plain):
            raise ValueError(
                f'in "{text}" the argument "{written(argument)}" {stated(unit)}, a plain number is needed; '
                "divide it by a parameter of that unit"
            )
        return plain
    if asks is Asks.CHOICE:
        unit_of(tree.arguments[0], scope)
        return _common(tree.arguments[1:], scope, text)
    unit = _common(tree.arguments, scope, text)
    if asks is Asks.ROOT:
        return None if unit is None else unit**0.5
    return unit if asks is Asks.SAME else plain
