"""Expressions of a kernel as C99, with its association kept and every change of type written out."""

from __future__ import annotations

import ast
import math
from typing import Any

from rtctl.translation.instances import Instance
from rtctl.translation.types import (
    BOOL,
    INT,
    LONG,
    REAL,
    ArrayType,
    FunctionType,
    RecordArray,
    RecordType,
    Scalar,
    StructType,
    TupleType,
    Type,
)

OPERATORS: dict[type, tuple[str, int]] = {
    ast.Add: ("+", 12), ast.Sub: ("-", 12), ast.Mult: ("*", 13), ast.Div: ("/", 13), ast.BitAnd: ("&", 8),
    ast.BitOr: ("|", 6),
}  # fmt: skip
COMPARISONS: dict[type, str] = {
    ast.Eq: "==", ast.NotEq: "!=", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=",
}  # fmt: skip
UNARY, ATOM, COMPARE, AND, OR, CHOICE = 14, 16, 10, 5, 4, 3
TAKEN = {
    "exp", "log", "tanh", "atanh", "expm1", "log1p", "sin", "cos", "atan", "atan2", "acos", "asin", "tan", "sinh",
    "cosh", "sqrt", "fabs", "floor", "near", "far", "double", "float", "int", "signed",
}  # fmt: skip
PREFIX = {REAL: "real", INT: "int", LONG: "long"}


def c_name(name: str) -> str:
    """Return a name that C leaves free: those of its library get a prefix."""
    return f"real_{name}" if name in TAKEN else name


def c_number(value: Any, kind: Type) -> str:
    """Return a constant of a type."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if kind is REAL:
        if math.isinf(value):
            return "REAL_INFINITY" if value > 0 else "(-REAL_INFINITY)"
        return "REAL_NAN" if math.isnan(value) else f"R({float(value)!r})"
    return f"{value}" if kind is INT else f"INT64_C({value})"


class Expressions:
    """Prints the expressions of one instance."""

    def __init__(self, instance: Instance) -> None:
        self.instance, self._types = instance, instance.types
        self._source = instance.source

    def type_of(self, node: ast.expr) -> Type:
        """Return the type of an expression."""
        if isinstance(node, ast.Name):
            known = self.instance.locals.get(node.id, self.instance.parameters.get(node.id))
            if known is not None:
                return known
        return self._types.get(node)

    def text(self, node: ast.expr, binds: int = 0, kind: Type = None) -> str:
        """Return an expression, in parentheses if it binds less than `binds`, converted to the number type `kind`."""
        own = self.type_of(node)
        if isinstance(kind, Scalar) and kind is not own and isinstance(node, ast.Constant):
            return c_number(node.value, kind)
        if isinstance(kind, Scalar) and isinstance(own, Scalar) and own is not kind and kind is not BOOL:
            return self._wrapped(f"({kind.value}){self.text(node, UNARY)}", UNARY, binds)
        text, level = getattr(self, f"_{type(node).__name__}")(node)
        return self._wrapped(text, level, binds)

    def _wrapped(self, text: str, level: int, binds: int) -> str:
        return f"({text})" if level < binds else text

    def _Constant(self, node: ast.Constant) -> tuple[str, int]:
        return c_number(node.value, self.type_of(node)), ATOM

    def _Name(self, node: ast.Name) -> tuple[str, int]:
        return c_name(node.id.lstrip("_")), ATOM

    def _Attribute(self, node: ast.Attribute) -> tuple[str, int]:
        if isinstance(node.value, ast.Name) and self._source.names.get(node.value.id) is math:
            return c_number(getattr(math, node.attr), REAL), ATOM
        text = self._field(node)
        if isinstance(self.type_of(node.value), RecordType) and isinstance(self.type_of(node), ArrayType):
            return f"{'LIST' if self._is_read(node.value) else 'ARRAY'}_OF({text})", ATOM
        return text, ATOM

    def _field(self, node: ast.Attribute) -> str:
        joint = "->" if self.is_pointer(node.value) else "."
        return f"{self.text(node.value, ATOM)}{joint}{node.attr}"

    def _is_read(self, record: ast.expr) -> bool:
        """Return whether a function only reads a record."""
        name = record.id if isinstance(record, ast.Name) else ""
        return self.instance.roots().get(name, name) not in self.instance.mutated

    def is_pointer(self, node: ast.expr) -> bool:
        """Return whether a struct or record is reached through a pointer."""
        if isinstance(self.type_of(node), RecordType):
            return True
        is_struct = isinstance(self.type_of(node), StructType)
        return is_struct and isinstance(node, ast.Name) and node.id in self.instance.parameters

    def is_constant(self, node: ast.expr) -> bool:
        """Return whether an array lies in constants, or in memory that the function leaves alone."""
        if isinstance(node, ast.Subscript):
            return self.is_constant(node.value)
        if isinstance(node, ast.Attribute):
            return not isinstance(self.type_of(node.value), RecordType) or self._is_read(node.value)
        if isinstance(node, ast.Name):
            root = self.instance.roots().get(node.id, node.id)
            return root in self.instance.parameters and root not in self.instance.mutated
        return False

    def _is_own_array(self, node: ast.expr) -> bool:
        """Return whether an expression is an array that is a field of a record."""
        return isinstance(node, ast.Attribute) and isinstance(self.type_of(node.value), RecordType)

    def _index(self, array: ast.expr, index: ast.expr, extent: str) -> str:
        if isinstance(index, ast.UnaryOp) and isinstance(index.op, ast.USub):
            return f"{self.text(array, ATOM)}.{extent} - {self.text(index.operand, 13)}"
        return self.text(index)

    def _Subscript(self, node: ast.Subscript) -> tuple[str, int]:
        owner = self.type_of(node.value)
        if self._is_own_array(node.value) and not isinstance(node.slice, ast.Slice):
            assert isinstance(node.value, ast.Attribute)
            return f"{self._field(node.value)}[{self.text(node.slice)}]", ATOM
        array = self.text(node.value, ATOM)
        if isinstance(owner, RecordArray):
            return f"&{array}[{self.text(node.slice)}]", UNARY
        if isinstance(node.slice, ast.Slice):
            first = "0" if node.slice.lower is None else self._index(node.value, node.slice.lower, "size")
            last = (
                f"{array}.size"
                if node.slice.upper is None
                else self._index(node.value, node.slice.upper, "size")
            )
            return (
                f"{'list' if self.is_constant(node.value) else 'array'}_part({array}, {first}, {last})",
                ATOM,
            )
        if isinstance(node.slice, ast.Tuple):
            i, j = node.slice.elts
            row, column = self._index(node.value, i, "rows"), self._index(node.value, j, "columns")
            return f"table_entry({array}, {row}, {column})", ATOM
        return f"{array}.at[{self._index(node.value, node.slice, 'size')}]", ATOM

    def _BinOp(self, node: ast.BinOp) -> tuple[str, int]:
        return self.binary(node.left, node.op, node.right, self.type_of(node))

    def binary(self, left: ast.expr, op: ast.operator, right: ast.expr, kind: Type) -> tuple[str, int]:
        """Return an operation whose result has the type `kind`, and how strongly it binds."""
        if isinstance(op, ast.FloorDiv | ast.Mod):
            name = "quotient" if isinstance(op, ast.FloorDiv) else "remainder"
            a, b = self.text(left, kind=kind), self.text(right, kind=kind)
            return f"{PREFIX[kind]}_{name}({a}, {b})", ATOM  # type: ignore[index]
        sign, level = OPERATORS[type(op)]
        if isinstance(op, ast.BitAnd | ast.BitOr):  # in parentheses: few know how strongly they bind
            return f"{self.text(left, UNARY, kind)} {sign} {self.text(right, UNARY, kind)}", level
        return f"{self.text(left, level, kind)} {sign} {self.text(right, level + 1, kind)}", level

    def _UnaryOp(self, node: ast.UnaryOp) -> tuple[str, int]:
        sign = "!" if isinstance(node.op, ast.Not) else "-" if isinstance(node.op, ast.USub) else "+"
        inner = self.text(node.operand, UNARY)
        return (f"{sign}({inner})" if inner.startswith("-") else f"{sign}{inner}"), UNARY

    def _BoolOp(self, node: ast.BoolOp) -> tuple[str, int]:
        sign, level = ("&&", AND) if isinstance(node.op, ast.And) else ("||", OR)
        # comparisons in parentheses, as MISRA C 12.1 has it
        # the other operator in parentheses: compilers warn where they are mixed
        return f" {sign} ".join(self.text(value, UNARY) for value in node.values), level

    def _Compare(self, node: ast.Compare) -> tuple[str, int]:
        operands = [node.left, *node.comparators]
        parts = []
        for left, op, right in zip(operands, node.ops, operands[1:], strict=False):
            kind = self._common(left, right)
            level = COMPARE + 1
            parts.append(
                f"{self.text(left, level, kind)} {COMPARISONS[type(op)]} {self.text(right, level, kind)}"
            )
        if len(parts) == 1:
            return parts[0], COMPARE
        return " && ".join(f"({part})" for part in parts), AND

    def _common(self, left: ast.expr, right: ast.expr) -> Type:
        kinds = (self.type_of(left), self.type_of(right))
        return REAL if REAL in kinds else LONG if LONG in kinds else INT if INT in kinds else BOOL

    def _IfExp(self, node: ast.IfExp) -> tuple[str, int]:
        kind = self.type_of(node)
        yes, no = (self.text(one, CHOICE, kind) for one in (node.body, node.orelse))
        return f"{self.text(node.test, UNARY)} ? {yes} : {no}", CHOICE

    def _Tuple(self, node: ast.Tuple) -> tuple[str, int]:
        kind = self.instance.returns
        items = kind.items if isinstance(kind, TupleType) else ()
        inside = ", ".join(self.text(one, kind=item) for one, item in zip(node.elts, items, strict=True))
        return f"({self.instance.name}_result){{{inside}}}", ATOM

    def _Call(self, node: ast.Call) -> tuple[str, int]:
        if isinstance(node.func, ast.Attribute):
            called = node.func.attr
            names = {
                "sqrt": "REAL_SQRT",
                "copysign": "REAL_COPYSIGN",
                "isfinite": "real_is_finite",
                "isnan": "real_is_nan",
            }
            return f"{names[called]}({', '.join(self.text(one, kind=REAL) for one in node.args)})", ATOM
        assert isinstance(node.func, ast.Name)
        if node in self.instance.calls:
            return self._kernel(node, self.instance.calls[node]), ATOM
        kind = self.type_of(node)
        if isinstance(kind, StructType):
            inside = ", ".join(
                self.text(one, kind=field) for one, (_, field) in zip(node.args, kind.fields, strict=True)
            )
            return f"({kind.name}){{{inside}}}", ATOM
        return self._builtin(node.func.id, node.args, kind)

    def _builtin(self, name: str, arguments: list[ast.expr], kind: Any) -> tuple[str, int]:
        if name in ("min", "max"):
            text = self.text(arguments[0], kind=kind)
            for other in arguments[1:]:
                text = f"{PREFIX[kind]}_{name}({text}, {self.text(other, kind=kind)})"
            return text, ATOM
        if name == "abs":
            return f"{'REAL_ABS' if kind is REAL else PREFIX[kind] + '_abs'}({self.text(arguments[0])})", ATOM
        if name == "bool" or self.type_of(arguments[0]) is kind:
            found: tuple[str, int] = getattr(self, f"_{type(arguments[0]).__name__}")(arguments[0])
            return found
        return f"({kind.value}){self.text(arguments[0], UNARY)}", UNARY

    def _kernel(self, node: ast.Call, called: Instance) -> str:
        arguments = [
            self.argument(one, called, name, kind)
            for one, (name, kind) in zip(node.args, called.parameters.items(), strict=True)
            if not isinstance(kind, FunctionType)
        ]
        return f"{c_name(called.name)}({', '.join(arguments)})"

    def argument(self, node: ast.expr, called: Instance, name: str, kind: Type) -> str:
        """Return what a kernel is called with for one of its parameters."""
        if isinstance(kind, ArrayType):
            if name not in called.mutated and not self.is_constant(node):
                return f"list_of({self.text(node)})"
            return self.text(node)
        if isinstance(kind, StructType):
            if isinstance(node, ast.Call):
                raise self._source.error(node, "give what a call returns a name before it is handed on")
            return self.text(node) if self.is_pointer(node) else f"&{self.text(node, UNARY)}"
        return self.text(node, kind=kind)
