"""Types of every expression of a kernel, and of every kernel that it calls.

An instance is a kernel for the types of its arguments, as numba would compile it. A function's arrays are of any size;
`sizes` keeps the largest that each parameter can have, which a copy of it needs.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from typing import Any, get_type_hints

from rtctl.translation.instances import INT_RANGE, Instance, annotated
from rtctl.translation.mutation import mutated_parameters
from rtctl.translation.source import function_of, is_function, source_of
from rtctl.translation.types import (
    BOOL,
    INT,
    LONG,
    NUMBERS,
    REAL,
    ArrayType,
    FunctionType,
    RecordArray,
    RecordType,
    StructType,
    TupleType,
    Type,
    wider,
)

MATHEMATICS = {math.sqrt: REAL, math.copysign: REAL, math.isfinite: BOOL, math.isnan: BOOL}
"""Functions that are exact, or a test of bits: these need no arithmetic of their own."""
BUILTINS = {abs, min, max, int, float, bool}


class Program:
    """All kernels that an entry needs, callees first."""

    def __init__(self, structs: Mapping[type, StructType] | None = None) -> None:
        """Prepare to translate; `structs`: types of NamedTuples of constants."""
        self.structs: dict[type, StructType] = dict(structs or {})
        self.instances: list[Instance] = []
        self._found: dict[tuple[Any, ...], Instance] = {}
        self._names: set[str] = set()

    def add(self, function: Callable[..., Any], types: list[Type], sizes: list[int]) -> Instance:
        """Return the instance of a kernel for argument types; infer it, and its callees, if it is new."""
        function = function_of(function)
        key = (function, *types)
        found = self._found.get(key)
        if found is not None:
            if any(
                size > found.sizes.get(name, 0) for name, size in zip(found.parameters, sizes, strict=True)
            ):
                found.sizes |= {
                    name: max(size, found.sizes.get(name, 0))
                    for name, size in zip(found.parameters, sizes, strict=True)
                }
                _Inference(self, found).run()  # hand the larger size on to its callees
            return found
        source = source_of(function)
        names = [argument.arg for argument in source.node.args.args]
        if len(names) != len(types) or source.node.args.kwonlyargs or source.node.args.vararg:
            raise source.error(
                source.node, f"takes {len(names)} plain arguments, is called with {len(types)}"
            )
        parameters = dict(zip(names, types, strict=True))
        handed = {name: one.function for name, one in parameters.items() if isinstance(one, FunctionType)}
        instance = Instance(
            self._free_name(function.__name__), source, parameters, mutated_parameters(source, handed),
            dict(zip(names, sizes, strict=True)),
        )  # fmt: skip
        self._found[key] = instance
        _Inference(self, instance).run()
        self.instances.append(instance)
        return instance

    def struct(self, source: type) -> StructType:
        """Return the type of a NamedTuple: that of its constants, or by its annotations."""
        if source not in self.structs:
            hints = get_type_hints(source)
            fields = tuple((name, annotated(hints[name])) for name in source._fields)  # type: ignore[attr-defined]
            self.structs[source] = StructType(source.__name__, source, fields)
        return self.structs[source]

    def _free_name(self, name: str) -> str:
        name, free, number = name.lstrip("_"), name.lstrip("_"), 2
        while free in self._names:
            free, number = f"{name}_{number}", number + 1
        self._names.add(free)
        return free


class _Inference(ast.NodeVisitor):
    """Infers one instance; runs over its body until nothing widens."""

    def __init__(self, program: Program, instance: Instance) -> None:
        self._program, self._instance, self._source = program, instance, instance.source
        self._types, self._sizes = instance.types, instance.sizes

    def run(self) -> None:
        """Infer all types of the body."""
        instance = self._instance
        for _ in range(4):
            before = dict(instance.locals)
            for statement in instance.source.node.body:
                self.visit(statement)
            if instance.locals == before:
                return
        raise self._source.error(instance.source.node, "its types do not settle")

    # --- statements ---
    def visit_Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):
            self._of(node.value)

    def visit_Pass(self, node: ast.Pass) -> None: ...
    def visit_Break(self, node: ast.Break) -> None: ...
    def visit_Continue(self, node: ast.Continue) -> None: ...

    def visit_Assign(self, node: ast.Assign) -> None:
        kind = self._of(node.value)
        for target in node.targets:
            self._assign(target, kind, node.value)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self._assign(node.target, self._of(node.value), node.value)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        kind = self._binary(self._of(node.target), node.op, self._of(node.value), node)
        self._assign(node.target, kind, node.value)

    def visit_If(self, node: ast.If) -> None:
        self._of(node.test)
        for statement in (*node.body, *node.orelse):
            self.visit(statement)

    def visit_While(self, node: ast.While) -> None:
        self._of(node.test)
        for statement in node.body:
            self.visit(statement)

    def visit_For(self, node: ast.For) -> None:
        call = node.iter
        if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"):
            raise self._source.error(node, "a loop runs over a range")
        for argument in call.args:
            self._of(argument)
        assert isinstance(node.target, ast.Name)
        self._name(node.target.id, INT, node)
        for statement in node.body:
            self.visit(statement)

    def visit_Return(self, node: ast.Return) -> None:
        kind = None if node.value is None else self._of(node.value)
        instance = self._instance
        if instance.returns is None:
            instance.returns = kind
        elif isinstance(kind, TupleType) and isinstance(instance.returns, TupleType):
            pairs = zip(kind.items, instance.returns.items, strict=True)
            instance.returns = TupleType(tuple(wider(a, b) for a, b in pairs))
        else:
            instance.returns = wider(instance.returns, kind)

    def generic_visit(self, node: ast.AST) -> None:
        raise self._source.error(node, f"{type(node).__name__} has no counterpart")

    def _assign(self, target: ast.expr, kind: Type, value: ast.expr) -> None:
        if isinstance(target, ast.Tuple):
            items = self._items(kind, target)
            values = value.elts if isinstance(value, ast.Tuple) else [value] * len(items)
            for one, item, own in zip(target.elts, items, values, strict=True):
                self._assign(one, item, own)
        elif isinstance(target, ast.Name):
            if isinstance(kind, ArrayType):
                self._sizes[target.id] = max(self._sizes.get(target.id, 0), self._size(value))
            self._name(target.id, kind, target)
            self._types[target] = self._instance.locals.get(target.id, kind)
        elif isinstance(target, ast.Subscript) and isinstance(target.slice, ast.Slice):
            self._of(target.value)
        else:
            self._of(target)

    def _items(self, kind: Type, node: ast.AST) -> tuple[Type, ...]:
        if isinstance(kind, TupleType):
            return kind.items
        if isinstance(kind, StructType):
            return tuple(item for _, item in kind.fields)
        raise self._source.error(node, f"{kind} cannot be taken apart")

    def _name(self, name: str, kind: Type, node: ast.AST) -> None:
        if name == "_":
            return
        known = self._instance.locals.get(name, self._instance.parameters.get(name))
        if kind is None:
            raise self._source.error(node, f"{name} has no value")
        try:
            wide = kind if known is None else wider(known, kind)
        except ValueError as error:
            raise self._source.error(node, f"{name}: {error}") from None
        if name in self._instance.parameters:
            if wide != known:
                raise self._source.error(
                    node, f"the parameter {name} changes its type from {known} to {wide}"
                )
        else:
            self._instance.locals[name] = wide

    # --- expressions ---
    def _of(self, node: ast.expr) -> Type:
        method = getattr(self, f"_of_{type(node).__name__}", None)
        if method is None:
            raise self._source.error(node, f"{type(node).__name__} has no counterpart")
        kind: Type = method(node)
        self._types[node] = kind
        return kind

    def _of_Constant(self, node: ast.Constant) -> Type:
        return self._constant(node.value, node)

    def _constant(self, value: Any, node: ast.AST) -> Type:
        if isinstance(value, bool):
            return BOOL
        if isinstance(value, int):
            return INT if value in INT_RANGE else LONG
        if isinstance(value, float):
            return REAL
        raise self._source.error(node, f"the constant {value!r} has no counterpart")

    def _of_Name(self, node: ast.Name) -> Type:
        name, instance = node.id, self._instance
        if name in instance.locals:
            return instance.locals[name]
        if name in instance.parameters:
            return instance.parameters[name]
        value = self._source.names.get(name)
        if isinstance(value, int | float):
            instance.constants[name] = value
            return self._constant(value, node)
        if is_function(value):
            return FunctionType(function_of(value))
        raise self._source.error(node, f"the name {name} is no number and no argument")

    def _of_Attribute(self, node: ast.Attribute) -> Type:
        if isinstance(node.value, ast.Name) and self._source.names.get(node.value.id) is math:
            return REAL  # math.inf, math.nan
        owner = self._of(node.value)
        if isinstance(owner, StructType | RecordType) and owner.of(node.attr) is not None:
            return owner.of(node.attr)
        if isinstance(owner, ArrayType) and node.attr == "size":
            return INT
        raise self._source.error(node, f"{owner} has no {node.attr}")

    def _of_Subscript(self, node: ast.Subscript) -> Type:
        owner = self._of(node.value)
        if isinstance(owner, RecordArray):
            assert not isinstance(node.slice, ast.Slice)
            self._of(node.slice)
            return owner.record
        if not isinstance(owner, ArrayType):
            raise self._source.error(node, f"{owner} has no entries")
        if isinstance(node.slice, ast.Slice):
            for bound in (node.slice.lower, node.slice.upper):
                if bound is not None:
                    self._of(bound)
            return owner
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if len(indices) != owner.dimensions or any(self._of(index) not in (INT, LONG) for index in indices):
            raise self._source.error(node, "an entry has one integer for each dimension")
        return REAL

    def _of_BinOp(self, node: ast.BinOp) -> Type:
        return self._binary(self._of(node.left), node.op, self._of(node.right), node)

    def _binary(self, left: Type, op: ast.operator, right: Type, node: ast.AST) -> Type:
        if left not in NUMBERS or right not in NUMBERS:
            raise self._source.error(node, f"{left} and {right} are no numbers to calculate with")
        if isinstance(op, ast.Div):
            return REAL
        if not isinstance(op, ast.Add | ast.Sub | ast.Mult) and REAL in (left, right):
            raise self._source.error(node, f"{type(op).__name__} is for integers only")
        kind = wider(wider(left, right), INT)
        if isinstance(op, ast.BitAnd | ast.BitOr) and left == right == BOOL:
            return BOOL
        return kind

    def _of_UnaryOp(self, node: ast.UnaryOp) -> Type:
        kind = self._of(node.operand)
        return BOOL if isinstance(node.op, ast.Not) else kind

    def _of_BoolOp(self, node: ast.BoolOp) -> Type:
        for value in node.values:
            if self._of(value) is not BOOL:
                raise self._source.error(node, "`and` and `or` join conditions only")
        return BOOL

    def _of_Compare(self, node: ast.Compare) -> Type:
        for value in (node.left, *node.comparators):
            if self._of(value) not in NUMBERS:
                raise self._source.error(node, "only numbers are compared")
        return BOOL

    def _of_IfExp(self, node: ast.IfExp) -> Type:
        self._of(node.test)
        return wider(self._of(node.body), self._of(node.orelse))

    def _of_Tuple(self, node: ast.Tuple) -> Type:
        return TupleType(tuple(self._of(item) for item in node.elts))

    def _of_Call(self, node: ast.Call) -> Type:
        if node.keywords:
            raise self._source.error(node, "arguments are given in their order")
        if isinstance(node.func, ast.Attribute):
            return self._method(node, node.func)
        assert isinstance(node.func, ast.Name)
        kinds = [self._of(argument) for argument in node.args]
        handed = self._instance.parameters.get(node.func.id)
        called = handed.function if isinstance(handed, FunctionType) else self._source.names.get(node.func.id)
        if called is None and node.func.id in __builtins__:  # type: ignore[operator]
            called = __builtins__[node.func.id]  # type: ignore[index]
        if called in BUILTINS:
            return self._builtin(called, kinds, node)
        if isinstance(called, type) and issubclass(called, tuple):
            return self._program.struct(called)
        if not callable(called):
            raise self._source.error(node, f"{node.func.id} is no kernel")
        sizes = [
            self._size(argument) if isinstance(kind, ArrayType) else 0
            for kind, argument in zip(kinds, node.args, strict=True)
        ]
        instance = self._program.add(called, self._widened(called, kinds), sizes)
        self._instance.calls[node] = instance
        return instance.returns

    def _widened(self, called: Callable[..., Any], kinds: list[Type]) -> list[Type]:
        """Return argument types as the parameters' annotations want them: an integer where a float is declared."""
        hints = get_type_hints(getattr(called, "py_func", called))
        names = source_of(called).node.args.args
        return [
            REAL if kind in NUMBERS and hints.get(name.arg) is float else kind
            for name, kind in zip(names, kinds, strict=False)
        ] + kinds[len(names) :]

    def _builtin(self, called: Any, kinds: list[Type], node: ast.Call) -> Type:
        if called in (min, max):
            kind = kinds[0]
            for other in kinds[1:]:
                kind = wider(kind, other)
            return kind
        if called is int:
            return INT if kinds[0] in (REAL, BOOL) else kinds[0]
        return {abs: kinds[0], float: REAL, bool: BOOL}[called]

    def _method(self, node: ast.Call, function: ast.Attribute) -> Type:
        kinds = [self._of(argument) for argument in node.args]
        if isinstance(function.value, ast.Name) and self._source.names.get(function.value.id) is math:
            called = getattr(math, function.attr)
            if called in MATHEMATICS:
                return MATHEMATICS[called]
            raise self._source.error(
                node,
                f"math.{function.attr} differs from one C library to another; use rtctl.arithmetic.elementary",
            )
        owner = self._of(function.value)
        if isinstance(owner, ArrayType) and function.attr == "copy" and not kinds:
            return owner
        raise self._source.error(node, f"the method {function.attr} has no counterpart")

    def _size(self, node: ast.expr) -> int:
        """Return the most entries that an array expression can have."""
        if isinstance(node, ast.Name):
            return self._sizes.get(node.id, 0)
        if isinstance(node, ast.Subscript | ast.Attribute) and not isinstance(node, ast.Attribute):
            return self._size(node.value)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            return self._size(node.func.value)
        if isinstance(node, ast.Attribute):
            owner = self._types.get(node.value)
            if isinstance(owner, RecordType):
                return next(field.size for field in owner.fields if field.name == node.attr)
        return 0
