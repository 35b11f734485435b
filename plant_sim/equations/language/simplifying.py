"""A tree without the parts that are zero."""

from __future__ import annotations

from collections.abc import Collection

from plant_sim.equations.language.tree import Call, Comparison, Name, Negative, Number, Operation, Own, Tree

ZERO, ONE = Number(0.0), Number(1.0)


def simplified(tree: Tree, zero: Collection[str]) -> Tree | None:
    """Return `tree` with some names being zero: terms and factors that are then gone are left out; None: it is zero."""
    found = _reduced(tree, zero)
    return None if found == ZERO else found


def _reduced(tree: Tree, zero: Collection[str]) -> Tree:
    match tree:
        case Name(name):
            return ZERO if name in zero else tree
        case Negative(of):
            inside = _reduced(of, zero)
            return ZERO if inside == ZERO else Negative(inside)
        case Operation(operator, left, right):
            return _operation(operator, _reduced(left, zero), _reduced(right, zero))
        case Own(function, member, arguments, block):
            return Own(function, member, tuple(_reduced(one, zero) for one in arguments), block)
        case Call("where", (Comparison(">", Name(name), right), _, otherwise)) if (
            name in zero and right == ZERO
        ):
            return _reduced(otherwise, zero)
        case Call(function, arguments):
            return Call(function, tuple(_reduced(one, zero) for one in arguments))
        case _:
            return tree


def _operation(operator: str, left: Tree, right: Tree) -> Tree:
    if (operator in "*/" and left == ZERO) or (operator == "*" and right == ZERO):
        return ZERO
    if operator in "+-" and right == ZERO:
        return left
    if left == ZERO:
        return (
            right
            if operator == "+"
            else Negative(right)
            if operator == "-"
            else Operation(operator, left, right)
        )
    if operator == "*" and left == ONE:
        return right
    if operator in "*/" and right == ONE:
        return left
    return Operation(operator, left, right)
