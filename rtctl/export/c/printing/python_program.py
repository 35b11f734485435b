"""Translated kernels as Python in one precision: the same arithmetic as the C, operation by operation.

numba computes a float32 with a Python float in double precision; here every constant, and every integer that meets a
real, is converted first, as C does it. The text is compiled by numba or run as it is, and the result is the oracle of
all machines: `run(state, inputs, outputs, constants, initial, applied)`.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np

from rtctl.translation.c99.expressions import COMPARISONS
from rtctl.translation.inference import Program
from rtctl.translation.instances import Instance
from rtctl.translation.memory import ByPrecision
from rtctl.translation.types import INT, REAL, FunctionType, Scalar, StructType, TupleType, Type

OPERATORS: dict[type, str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%", ast.BitAnd: "&",
    ast.BitOr: "|",
}  # fmt: skip
RUN = """
@njit
def run(state, inputs, outputs, constants, initial, applied):
    for k in range(inputs.size):
        if inputs[k].periods == 0:
            state[0] = initial[0]
            state[0].settle_left = 1
            inputs[k].periods = 1
{applied}
        {entry}(state, inputs[k], outputs[k], constants)
"""


class PythonFunction:
    """Prints one instance."""

    def __init__(self, instance: Instance, numbers: dict[str, Any]) -> None:
        self._instance, self._types, self._numbers = instance, instance.types, numbers

    def text(self) -> str:
        """Return the function."""
        instance = self._instance
        taken = [name for name, kind in instance.parameters.items() if not isinstance(kind, FunctionType)]
        head = f"@njit\ndef {instance.name}({', '.join(taken)}):"
        return "\n".join([head, *self._block(instance.source.node.body, "    "), ""])

    def _block(self, body: list[ast.stmt], pad: str) -> list[str]:
        lines = [line for statement in body for line in self._statement(statement, pad)]
        return lines or [f"{pad}pass"]

    def _statement(self, node: ast.stmt, pad: str) -> list[str]:
        if isinstance(node, ast.If):
            lines = [f"{pad}if {self._of(node.test)}:", *self._block(node.body, pad + "    ")]
            return lines + ([f"{pad}else:", *self._block(node.orelse, pad + "    ")] if node.orelse else [])
        if isinstance(node, ast.While):
            return [f"{pad}while {self._of(node.test)}:", *self._block(node.body, pad + "    ")]
        if isinstance(node, ast.For):
            return [
                f"{pad}for {self._of(node.target)} in {self._of(node.iter)}:",
                *self._block(node.body, pad + "    "),
            ]
        if isinstance(node, ast.Return):
            value = "" if node.value is None else self._converted(node.value, self._instance.returns)
            return [f"{pad}return {value}"]
        if isinstance(node, ast.Assign):
            targets = " = ".join(self._target(target) for target in node.targets)
            return [f"{pad}{targets} = {self._assigned(node.targets[0], node.value)}"]
        if isinstance(node, ast.AnnAssign) and node.value is not None:
            return [f"{pad}{self._target(node.target)} = {self._assigned(node.target, node.value)}"]
        if isinstance(node, ast.AugAssign):
            kind = self._type(node.target)
            value = self._binary(node.target, node.op, node.value, kind)
            return [f"{pad}{self._of(node.target)} = {value}"]
        if isinstance(node, ast.Expr):
            return [] if isinstance(node.value, ast.Constant) else [f"{pad}{self._of(node.value)}"]
        return [f"{pad}{ast.unparse(node)}"]

    def _target(self, node: ast.expr) -> str:
        if isinstance(node, ast.Tuple):
            return ", ".join(self._target(one) for one in node.elts)
        return self._of(node)

    def _assigned(self, target: ast.expr, value: ast.expr) -> str:
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            return ", ".join(
                self._converted(one, self._type(to)) for to, one in zip(target.elts, value.elts, strict=True)
            )
        kind = self._type(target)
        return self._converted(value, kind if isinstance(kind, Scalar) else None)

    def _type(self, node: ast.expr) -> Type:
        if isinstance(node, ast.Name):
            known = self._instance.locals.get(node.id, self._instance.parameters.get(node.id))
            if known is not None:
                return known
        return self._types.get(node)

    def _converted(self, node: ast.expr, kind: Type) -> str:
        """Return an expression as a number of type `kind`; a tuple item by item."""
        if isinstance(node, ast.Tuple) and isinstance(kind, TupleType):
            return ", ".join(
                self._converted(one, item) for one, item in zip(node.elts, kind.items, strict=True)
            )
        text = self._of(node)
        return f"to_real({text})" if kind is REAL and self._type(node) is not REAL else text

    def _of(self, node: ast.expr) -> str:
        return str(getattr(self, f"_{type(node).__name__}")(node))

    def _number(self, value: Any) -> str:
        if isinstance(value, float):
            name = f"number_{len(self._numbers)}"
            for known, other in self._numbers.items():
                if other == value or (other != other and value != value):
                    return known
            self._numbers[name] = value
            return name
        return repr(value)

    def _Constant(self, node: ast.Constant) -> str:
        return self._number(node.value)

    def _Name(self, node: ast.Name) -> str:
        if node.id in self._instance.constants and node.id not in self._instance.locals:
            return self._number(self._instance.constants[node.id])
        return node.id

    def _Attribute(self, node: ast.Attribute) -> str:
        if isinstance(node.value, ast.Name) and self._instance.source.names.get(node.value.id) is math:
            return self._number(getattr(math, node.attr))
        return f"{self._of(node.value)}.{node.attr}"

    def _Subscript(self, node: ast.Subscript) -> str:
        if isinstance(node.slice, ast.Slice):
            bounds = ["" if one is None else self._of(one) for one in (node.slice.lower, node.slice.upper)]
            return f"{self._of(node.value)}[{':'.join(bounds)}]"
        return f"{self._of(node.value)}[{self._target(node.slice)}]"

    def _BinOp(self, node: ast.BinOp) -> str:
        return self._binary(node.left, node.op, node.right, self._type(node))

    def _binary(self, left: ast.expr, op: ast.operator, right: ast.expr, kind: Type) -> str:
        return f"({self._converted(left, kind)} {OPERATORS[type(op)]} {self._converted(right, kind)})"

    def _UnaryOp(self, node: ast.UnaryOp) -> str:
        return f"({'not ' if isinstance(node.op, ast.Not) else '-'}{self._of(node.operand)})"

    def _BoolOp(self, node: ast.BoolOp) -> str:
        sign = " and " if isinstance(node.op, ast.And) else " or "
        return f"({sign.join(self._of(value) for value in node.values)})"

    def _Compare(self, node: ast.Compare) -> str:
        operands = [node.left, *node.comparators]
        real = any(self._type(one) is REAL for one in operands)
        texts = [self._converted(one, REAL if real else None) for one in operands]
        signs = [COMPARISONS[type(op)] for op in node.ops]
        return (
            f"({texts[0]} {' '.join(f'{sign} {text}' for sign, text in zip(signs, texts[1:], strict=True))})"
        )

    def _IfExp(self, node: ast.IfExp) -> str:
        kind = self._type(node)
        yes, no = self._converted(node.body, kind), self._converted(node.orelse, kind)
        return f"({yes} if {self._of(node.test)} else {no})"

    def _Tuple(self, node: ast.Tuple) -> str:
        return ", ".join(self._of(one) for one in node.elts)

    def _Call(self, node: ast.Call) -> str:
        if isinstance(node.func, ast.Attribute):
            arguments = ", ".join(self._of(one) for one in node.args)
            owner = ast.unparse(node.func.value) if node.args else self._of(node.func.value)
            text = f"{owner}.{node.func.attr}({arguments})"  # Python's own computes in double precision
            return f"to_real({text})" if self._type(node) is REAL else text
        assert isinstance(node.func, ast.Name)
        called, kind = self._instance.calls.get(node), self._type(node)
        if called is not None:
            return f"{called.name}({self._listed(node.args, list(called.parameters.values()))})"
        if isinstance(kind, StructType):
            return f"{kind.name}({self._listed(node.args, [one for _, one in kind.fields])})"
        if node.func.id == "float":
            return self._converted(node.args[0], REAL)
        kinds: list[Type] = [kind if kind in (REAL, INT) and node.func.id in ("min", "max") else None] * len(
            node.args
        )
        return f"{node.func.id}({self._listed(node.args, kinds)})"

    def _listed(self, nodes: list[ast.expr], kinds: list[Type]) -> str:
        return ", ".join(
            self._converted(one, kind)
            for one, kind in zip(nodes, kinds, strict=True)
            if not isinstance(kind, FunctionType)
        )


def python_program(
    program: Program, entry: Instance, real: Any, levels: Sequence[str], *, compiled: bool
) -> Callable[..., None]:
    """Return `run` of a program in one precision.

    Args:
        program: the kernels.
        entry: the function of a sample.
        levels: fields of the state that are the commands in force; `applied` (n, commands) puts others in their place,
            where it is a number.
        real: np.float32 or np.float64.
        compiled: whether numba compiles it, which lasts ten seconds; else Python runs it on records of NumPy.
    """
    numbers: dict[str, Any] = {}
    text = "\n".join(PythonFunction(instance, numbers).text() for instance in program.instances)
    applied = [
        f"        if applied[k, {at}] == applied[k, {at}]:\n            state[0].{name} = applied[k, {at}]"
        for at, name in enumerate(levels)
    ]
    text += RUN.format(entry=entry.name, applied="\n".join(applied))
    compile_function: Any = numba.njit(error_model="numpy", fastmath=False) if compiled else lambda f: f
    names = {
        "njit": compile_function,
        "to_real": real,
        "math": math,
        **{name: real(value) for name, value in numbers.items()},
        **{struct.name: struct.source for struct in program.structs.values()},
    }
    exec(compile(text, "<exported law in Python>", "exec"), names)
    run: Callable[..., None] = names["run"]
    return run


def in_precision(values: Any, real: Any) -> Any:
    """Return NamedTuples of constants with reals and arrays of one precision."""
    if isinstance(values, tuple):
        return type(values)(*(in_precision(value, real) for value in values))
    if isinstance(values, np.ndarray):
        return values.astype(real)
    if isinstance(values, ByPrecision) and real is np.float32:
        return real(values.single)
    return values if isinstance(values, bool | int) else real(values)
