"""Laws of the equation of motion to C: the functions that kernels are compiled from are the single source.

A law is plain arithmetic of numbers (`plant_sim.oscillator.equation`): assignments, conditions, loops of a fixed
number, other laws. One that returns several numbers fills `out` with them, in their order. Of `p[row + 2, j]` the lane
`j` is left out: a plant has one.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from collections.abc import Iterator
from typing import Any

CALLS = {
    "abs": "fabs",
    "min": "least",
    "max": "most",
    "copysign": "copysign",
    "floor": "floor",
    "sqrt": "sqrt",
    "power": "pow",
    "two_to": "exp2",
}
"""Functions of C, by what the laws call them; the last two are the same to 1e-12."""
COMPARED: dict[type[ast.cmpop], str] = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip
OPERATIONS: dict[type[ast.operator], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.BitAnd: "&&", ast.BitOr: "||",
}  # fmt: skip
TYPES = {"p": "const double *p", "w": "const double *w", "row": "int row"}
"""Declarations of arguments that are no numbers."""
LEFT_OUT = frozenset({"j"})
EXTREMES = {
    "least": "static double least(double a, double b) { return b < a ? b : a; }\n",
    "most": "static double most(double a, double b) { return b > a ? b : a; }\n",
}
"""Functions that laws and paths call, by name."""


class CLaws:
    """The functions in C that were translated so far, each after those that it calls."""

    def __init__(self) -> None:
        self._written: dict[str, str] = {}

    def add(self, law: Any) -> str:
        """Translate a law and all that it calls, and return its name in C.

        Raises:
            TypeError: It has a form that is no plain arithmetic.
        """
        function = getattr(law, "py_func", law)
        name = f"{function.__module__.rpartition('.')[2]}_{function.__name__}".replace("__", "_")
        if name not in self._written:
            text = _Function(self, function, name).text()
            self._written[name] = text
        return name

    def text(self) -> str:
        """Return all functions."""
        return "\n".join(self._written.values())


class _Function:
    """One function while it is translated."""

    def __init__(self, laws: CLaws, function: Any, name: str) -> None:
        self._laws, self._function, self._name = laws, function, name
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
        if not isinstance(tree, ast.FunctionDef):
            raise TypeError(f"{name} is no function")
        self._tree = tree
        self._arguments = [one.arg for one in tree.args.args if one.arg not in LEFT_OUT]
        self._local = set(self._arguments)
        returns = [one for one in ast.walk(tree) if isinstance(one, ast.Return)]
        self._is_tuple = any(isinstance(one.value, ast.Tuple) for one in returns)

    def text(self) -> str:
        declared = [TYPES.get(name, f"double {name}") for name in self._arguments]
        kind = "void" if self._is_tuple else "double"
        if self._is_tuple:
            declared.append("double *out")
        head = f"static {kind} {self._name}({', '.join(declared)})"
        unused = "".join(f"    (void){name};\n" for name in self._arguments if not self._uses(name))
        body = "".join(f"{line}\n" for line in self._statements(self._tree.body, 1))
        docstring = ast.get_docstring(self._tree) or ""
        comment = "/* " + " ".join(docstring.split("\n\n")[0].split()).replace("*/", "* /") + " */\n"
        return f"{comment}{head}\n{{\n{unused}{body}}}\n"

    def _uses(self, name: str) -> bool:
        return any(isinstance(one, ast.Name) and one.id == name for one in ast.walk(self._tree))

    def _statements(self, body: list[ast.stmt], depth: int) -> Iterator[str]:
        space = "    " * depth
        for one in body:
            match one:
                case ast.Expr(ast.Constant()):
                    continue
                case ast.Return(ast.Tuple(values)):
                    for k, value in enumerate(_flat(values)):
                        yield f"{space}out[{k}] = {self._number(value)};"
                    yield f"{space}return;"
                case ast.Return(value) if value is not None:
                    yield f"{space}return {self._number(value)};"
                case ast.Assign([ast.Name(name)], value):
                    yield f"{space}{self._target(name)} = {self._number(value)};"
                case ast.Assign([ast.Tuple(targets)], ast.Tuple(values)):
                    numbers = [self._number(value) for value in values]
                    for target, number in zip(targets, numbers, strict=True):
                        assert isinstance(target, ast.Name)
                        yield f"{space}{self._target(target.id)} = {number};"
                case ast.AugAssign(ast.Name(name), operator, value):
                    yield f"{space}{name} {OPERATIONS[type(operator)]}= {self._number(value)};"
                case ast.If() | ast.For():
                    yield from self._block(one, depth)
                case _:
                    raise TypeError(f"{self._name}: {ast.unparse(one)} has no form in C")

    def _block(self, block: ast.If | ast.For, depth: int) -> Iterator[str]:
        space = "    " * depth
        match block:
            case ast.If(condition, then, orelse):
                yield f"{space}if ({self._number(condition)}) {{"
                yield from self._statements(then, depth + 1)
                if orelse:
                    yield f"{space}}} else {{"
                    yield from self._statements(orelse, depth + 1)
            case ast.For(ast.Name(name), ast.Call(ast.Name("range"), [ast.Constant(int(count))]), inner):
                yield f"{space}for (int {name} = 0; {name} < {count}; {name}++) {{"
                yield from self._statements(inner, depth + 1)
            case _:
                raise TypeError(f"{self._name}: {ast.unparse(block)} has no form in C")
        yield f"{space}}}"

    def _target(self, name: str) -> str:
        if name in self._local:
            return name
        self._local.add(name)
        return f"double {name}"

    def _number(self, node: ast.expr) -> str:
        match node:
            case ast.Constant(int(value) | float(value)):
                return repr(float(value))
            case ast.Name(name):
                return name if name in self._local else self._constant(name)
            case ast.BinOp(left, ast.Pow(), right):
                return f"pow({self._number(left)}, {self._number(right)})"
            case ast.BinOp(left, operator, right):
                return f"({self._number(left)} {OPERATIONS[type(operator)]} {self._number(right)})"
            case ast.UnaryOp(ast.USub(), of):
                return f"(-{self._number(of)})"
            case ast.UnaryOp(ast.Not(), of):
                return f"(!{self._number(of)})"
            case ast.Compare(left, [operator], [right]):
                return f"({self._number(left)} {COMPARED[type(operator)]} {self._number(right)})"
            case ast.IfExp(condition, one, other):
                return f"({self._number(condition)} ? {self._number(one)} : {self._number(other)})"
            case ast.Subscript(ast.Name(name), index):
                return f"{name}[{self._place(index)}]"
            case ast.Attribute(ast.Name("math"), "pi"):
                return repr(math.pi)
            case ast.Call(called, arguments):
                return self._call(called, arguments)
            case _:
                raise TypeError(f"{self._name}: {ast.unparse(node)} has no form in C")

    def _place(self, index: ast.expr) -> str:
        if isinstance(index, ast.Tuple):
            index = index.elts[0]
        match index:
            case ast.Constant(int(value)):
                return str(value)
            case ast.Name("row"):
                return "row"
            case ast.Name(name):
                return str(int(self._function.__globals__[name]))
            case ast.BinOp(ast.Name("row"), ast.Add(), ast.Constant(int(value))):
                return f"row + {value}"
            case _:
                raise TypeError(f"{self._name}: the place {ast.unparse(index)} has no form in C")

    def _call(self, called: ast.expr, arguments: list[ast.expr]) -> str:
        name = called.attr if isinstance(called, ast.Attribute) else ast.unparse(called)
        if name in CALLS:
            return f"{CALLS[name]}({', '.join(self._number(one) for one in arguments)})"
        function = self._function.__globals__.get(name)
        if not hasattr(function, "py_func"):
            raise TypeError(f"{self._name}: the function {name} has no form in C")
        passed = [one for one in arguments if not (isinstance(one, ast.Name) and one.id in LEFT_OUT)]
        return f"{self._laws.add(function)}({', '.join(self._number(one) for one in passed)})"

    def _constant(self, name: str) -> str:
        value = self._function.__globals__.get(name)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise TypeError(f"{self._name}: {name} is no number")
        return repr(float(value))


def _flat(values: list[ast.expr]) -> Iterator[ast.expr]:
    for one in values:
        if isinstance(one, ast.Tuple):
            yield from _flat(one.elts)
        else:
            yield one
