"""Statements and functions of a kernel as C99."""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Iterator

from rtctl.translation.c99.expressions import Expressions, c_name
from rtctl.translation.instances import Instance
from rtctl.translation.types import (
    INT,
    ArrayType,
    FunctionType,
    RecordArray,
    RecordType,
    Scalar,
    StructType,
    TupleType,
    Type,
)

STEP = "    "
WIDTH = 110


def comment(text: str, indent: str = "") -> list[str]:
    """Return the lines of a comment."""
    text = text.replace("*/", "* /").strip()
    if "\n" not in text and len(text) + len(indent) < WIDTH:
        return [f"{indent}/* {text} */"]
    lines = text.splitlines()
    first, rest = lines[0], textwrap.dedent("\n".join(lines[1:])).splitlines()
    body = [first, *rest]
    return [f"{indent}/* {body[0]}", *(f"{indent} * {line}".rstrip() for line in body[1:]), f"{indent} */"]


def parameter(name: str, kind: Type, changed: bool) -> str:
    """Return the declaration of a parameter."""
    name = c_name(name)
    if isinstance(kind, ArrayType):
        view = "real_table" if kind.dimensions == 2 else "real_array" if changed else "real_list"
        return f"{view} {name}"
    if isinstance(kind, StructType):
        return f"const {kind.name} *{name}"
    if isinstance(kind, RecordArray | RecordType):
        record = kind.record if isinstance(kind, RecordArray) else kind
        return f"{'' if changed else 'const '}{record.name} *{name}"
    assert isinstance(kind, Scalar)
    return f"{kind.value} {name}"


def declared(kind: Type, constant: bool) -> str:
    """Return the type of a local variable."""
    if isinstance(kind, ArrayType):
        return "real_table" if kind.dimensions == 2 else "real_list" if constant else "real_array"
    if isinstance(kind, RecordType):
        return f"{'const ' if constant else ''}{kind.name} *"
    if isinstance(kind, StructType):
        return kind.name
    assert isinstance(kind, Scalar)
    return kind.value


class Function:
    """Prints one instance."""

    def __init__(self, instance: Instance) -> None:
        self._instance = instance
        self._expressions = Expressions(instance)
        self._declared: set[str] = set()
        self._results = 0

    def result_type(self) -> list[str]:
        """Return the struct of what it returns, if it returns several values without a name of their own."""
        kind = self._instance.returns
        if not isinstance(kind, TupleType):
            return []
        fields = [
            f"{declared(item, False)} {name};"
            for name, item in zip(self._result_names(), kind.items, strict=True)
        ]
        return [f"typedef struct {{ {' '.join(fields)} }} {self._instance.name}_result;"]

    def _result_names(self) -> list[str]:
        return result_names(self._instance)

    def head(self) -> str:
        """Return the function's declaration."""
        instance, kind = self._instance, self._instance.returns
        returns = (
            "void"
            if kind is None
            else declared(kind, False)
            if not isinstance(kind, TupleType)
            else f"{instance.name}_result"
        )
        inside = ", ".join(
            parameter(name, one, name in instance.mutated)
            for name, one in instance.parameters.items()
            if not isinstance(one, FunctionType)
        )
        head = f"static {returns} {c_name(instance.name)}({inside})"
        if len(head) <= WIDTH:
            return head
        wrapped = textwrap.wrap(inside.replace(" ", "\0").replace(",\0", ", "), WIDTH - len(STEP))
        return (
            f"static {returns} {c_name(instance.name)}(\n"
            + "\n".join(STEP + line.replace("\0", " ") for line in wrapped)
            + ")"
        )

    def lines(self) -> list[str]:
        """Return the whole function."""
        node = self._instance.source.node
        text = ast.get_docstring(node)
        used = set().union(*(_used(statement) for statement in node.body))
        unused = [
            f"{STEP}(void){c_name(name)};"
            for name, kind in self._instance.parameters.items()
            if name not in used and not isinstance(kind, FunctionType)
        ]
        body = [*unused, *self._block(node.body, 1, set())]
        return [*(comment(text) if text else []), self.head(), "{", *body, "}"]

    # --- statements ---
    def _block(self, body: list[ast.stmt], depth: int, known: set[str]) -> Iterator[str]:
        declared_here = set(known)
        for number, statement in enumerate(body):
            yield from self._declare_before(statement, body[number + 1 :], depth, declared_here)
            yield from self._comments_of(statement, depth)
            method = getattr(self, f"_{type(statement).__name__}")
            yield from method(statement, depth, declared_here)

    def _comments_of(self, statement: ast.stmt, depth: int) -> Iterator[str]:
        last = (
            statement.lineno
            if isinstance(statement, ast.If | ast.While | ast.For)
            else statement.end_lineno or 0
        )
        for line in range(statement.lineno, last + 1):
            text = self._instance.source.comments.get(line)
            if text and not isinstance(statement, ast.Expr):
                yield from comment(text, STEP * depth)

    def _declare_before(
        self, statement: ast.stmt, following: list[ast.stmt], depth: int, known: set[str]
    ) -> Iterator[str]:
        """Declare what this statement first sets within a block, or in a tuple, and what others use later."""
        for name in _assigned(statement):
            if name in known or name not in self._instance.locals:
                continue
            if self._declares_itself(statement, name):
                continue
            inside_only = isinstance(statement, ast.If | ast.While | ast.For) and not any(
                name in _used(later) for later in following
            )
            if inside_only and _in_one_block(statement, name):
                continue
            known.add(name)
            yield f"{STEP * depth}{self._declaration(name)};"

    def _declares_itself(self, statement: ast.stmt, name: str) -> bool:
        if isinstance(statement, ast.AnnAssign):
            return True
        return isinstance(statement, ast.Assign) and len(statement.targets) == 1

    def _declaration(self, name: str) -> str:
        kind = self._instance.locals[name]
        text = declared(kind, self._expressions.is_constant(ast.Name(id=name)) or self._reads_record(name))
        return f"{text}{'' if text.endswith('*') else ' '}{c_name(name.lstrip('_'))}"

    def _reads_record(self, name: str) -> bool:
        if not isinstance(self._instance.locals.get(name), RecordType):
            return False
        root = self._instance.roots().get(name, name)
        return root not in self._instance.mutated

    def _set(self, name: str, value: str, depth: int, known: set[str]) -> str:
        if name in self._instance.locals and name not in known:
            known.add(name)
            return f"{STEP * depth}{self._declaration(name)} = {value};"
        return f"{STEP * depth}{c_name(name.lstrip('_'))} = {value};"

    def _Assign(self, node: ast.Assign, depth: int, known: set[str]) -> Iterator[str]:
        if len(node.targets) > 1:
            yield from self._chain(node, depth, known)
            return
        yield from self._to(node.targets[0], node.value, depth, known)

    def _AnnAssign(self, node: ast.AnnAssign, depth: int, known: set[str]) -> Iterator[str]:
        assert node.value is not None
        yield from self._to(node.target, node.value, depth, known)

    def _chain(self, node: ast.Assign, depth: int, known: set[str]) -> Iterator[str]:
        """Write the value of `a = b = value` once for each, since it is a constant or a name."""
        for target in node.targets:
            yield from self._to(target, node.value, depth, known)

    def _to(self, target: ast.expr, value: ast.expr, depth: int, known: set[str]) -> Iterator[str]:
        e = self._expressions
        if isinstance(target, ast.Tuple):
            yield from self._unpack(target, value, depth, known)
        elif (
            isinstance(value, ast.Call)
            and isinstance(value.func, ast.Attribute)
            and value.func.attr == "copy"
        ):
            assert isinstance(target, ast.Name)
            size = self._instance.sizes.get(target.id, 0)
            yield f"{STEP * depth}real_t {target.id}_memory[{size}];"
            yield self._set(
                target.id, f"copy_of({self._list(value.func.value)}, {target.id}_memory)", depth, known
            )
        elif isinstance(target, ast.Name):
            text = e.text(value, kind=e.type_of(target))
            yield self._set(target.id, text, depth, known)
        elif isinstance(target, ast.Subscript) and isinstance(target.slice, ast.Slice):
            yield f"{STEP * depth}array_fill({e.text(target.value)}, {e.text(value)});"
        else:
            yield f"{STEP * depth}{e.text(target)} = {e.text(value, kind=e.type_of(target))};"

    def _list(self, node: ast.expr) -> str:
        text = self._expressions.text(node)
        return text if self._expressions.is_constant(node) else f"list_of({text})"

    # long because a tuple is taken from another one, from a struct or from a call
    def _unpack(  # noqa: C901
        self, target: ast.Tuple, value: ast.expr, depth: int, known: set[str]
    ) -> Iterator[str]:
        e, pad = self._expressions, STEP * depth
        if isinstance(value, ast.Tuple):
            set_names = {one.id for one in target.elts if isinstance(one, ast.Name)}
            used = (
                set().union(*(_used(ast.Expr(one)) for one in value.elts[1:]))
                if len(value.elts) > 1
                else set()
            )
            stored = [one for one in target.elts if not isinstance(one, ast.Name)]
            values_read = {ast.unparse(one) for entry in value.elts[1:] for one in ast.walk(entry)}
            safe = not (set_names & used) and not any(ast.unparse(one) in values_read for one in stored[:-1])
            if safe:
                for one, entry in zip(target.elts, value.elts, strict=True):
                    yield from self._to(one, entry, depth, known)
                return
            temporaries: list[str] = []
            for one, entry in zip(target.elts, value.elts, strict=True):
                kind = e.type_of(one)
                name = f"next_{one.id if isinstance(one, ast.Name) else len(temporaries)}"
                temporaries.append(name)
                yield f"{pad}const {declared(kind, False)} {name} = {e.text(entry, kind=kind)};"
            for one, name in zip(target.elts, temporaries, strict=True):
                if isinstance(one, ast.Name):
                    yield self._set(one.id, name, depth, known)
                else:
                    yield f"{pad}{e.text(one)} = {name};"
            return
        self._results += 1
        kind = e.type_of(value)
        if isinstance(kind, StructType):
            fields = [name for name, _ in kind.fields]
            if isinstance(value, ast.Name):  # power, of which each is a field
                pointer = "->" if e.is_pointer(value) else "."
                for one, name in zip(target.elts, fields, strict=True):
                    assert isinstance(one, ast.Name)
                    yield self._set(one.id, f"{value.id}{pointer}{name}", depth, known)
                return
            result, kind_name = f"result_{self._results}", kind.name
        else:
            assert isinstance(value, ast.Call)
            called = self._instance.calls[value]
            fields, result, kind_name = (
                result_names(called),
                f"result_{self._results}",
                f"{called.name}_result",
            )
        yield f"{pad}const {kind_name} {result} = {e.text(value)};"
        for one, name in zip(target.elts, fields, strict=True):
            if isinstance(one, ast.Name) and one.id == "_":
                continue
            if isinstance(one, ast.Name):
                yield self._set(one.id, f"{result}.{name}", depth, known)
            else:
                yield f"{pad}{e.text(one)} = {result}.{name};"

    def _AugAssign(self, node: ast.AugAssign, depth: int, known: set[str]) -> Iterator[str]:
        e = self._expressions
        kind = e.type_of(node.target)
        text, _ = e.binary(node.target, node.op, node.value, kind)
        sign = text.removeprefix(e.text(node.target) + " ")
        if text.startswith(e.text(node.target) + " ") and not isinstance(node.op, ast.FloorDiv | ast.Mod):
            operator, _, _ = sign.partition(" ")
            yield f"{STEP * depth}{e.text(node.target)} {operator}= {e.text(node.value, kind=kind)};"
        else:
            yield f"{STEP * depth}{e.text(node.target)} = {text};"

    def _If(self, node: ast.If, depth: int, known: set[str], lead: str = "if") -> Iterator[str]:
        pad = STEP * depth
        yield f"{pad}{lead} ({self._expressions.text(node.test)}) {{"
        yield from self._block(node.body, depth + 1, known)
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            yield from self._If(node.orelse[0], depth, known, "} else if")
            return
        if node.orelse or lead != "if":
            yield f"{pad}}} else {{"
            yield from (
                self._block(node.orelse, depth + 1, known) if node.orelse else [f"{pad}{STEP}/* nothing */"]
            )
        yield f"{pad}}}"

    def _While(self, node: ast.While, depth: int, known: set[str]) -> Iterator[str]:
        yield f"{STEP * depth}while ({self._expressions.text(node.test)}) {{"
        yield from self._block(node.body, depth + 1, known)
        yield f"{STEP * depth}}}"

    def _For(self, node: ast.For, depth: int, known: set[str]) -> Iterator[str]:
        assert isinstance(node.iter, ast.Call)
        assert isinstance(node.target, ast.Name)
        bounds = [self._expressions.text(one, kind=INT) for one in node.iter.args]
        first, last = ("0", bounds[0]) if len(bounds) == 1 else (bounds[0], bounds[1])
        name = node.target.id if node.target.id != "_" else "round"
        yield f"{STEP * depth}for (int32_t {name} = {first}; {name} < {last}; {name}++) {{"
        yield from self._block(node.body, depth + 1, known | {node.target.id})
        yield f"{STEP * depth}}}"

    def _Return(self, node: ast.Return, depth: int, known: set[str]) -> Iterator[str]:
        if node.value is None:
            yield f"{STEP * depth}return;"
        else:
            yield f"{STEP * depth}return {self._expressions.text(node.value, kind=self._instance.returns)};"

    def _Expr(self, node: ast.Expr, depth: int, known: set[str]) -> Iterator[str]:
        if isinstance(node.value, ast.Call):
            dropped = "(void)" if self._expressions.type_of(node.value) is not None else ""
            yield f"{STEP * depth}{dropped}{self._expressions.text(node.value)};"

    def _Break(self, node: ast.Break, depth: int, known: set[str]) -> Iterator[str]:
        yield f"{STEP * depth}break;"

    def _Continue(self, node: ast.Continue, depth: int, known: set[str]) -> Iterator[str]:
        yield f"{STEP * depth}continue;"

    def _Pass(self, node: ast.Pass, depth: int, known: set[str]) -> Iterator[str]:
        return iter(())


ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")


def result_names(instance: Instance) -> list[str]:
    """Return names of the values that a function returns: those of the variables where it returns variables."""
    assert isinstance(instance.returns, TupleType)
    count = len(instance.returns.items)
    for node in ast.walk(instance.source.node):
        if isinstance(node, ast.Return) and isinstance(node.value, ast.Tuple):
            names = [one.id if isinstance(one, ast.Name) else "" for one in node.value.elts]
            if all(names) and len(set(names)) == count:
                return names
    return list(ORDINALS[:count])


def _assigned(statement: ast.stmt) -> list[str]:
    """Return the names that a statement sets, in order; the target of a loop is declared by the loop."""
    loops = {node.target for node in ast.walk(statement) if isinstance(node, ast.For)}
    names = [node for node in ast.walk(statement) if isinstance(node, ast.Name) and node not in loops]
    return list(dict.fromkeys(one.id for one in names if isinstance(one.ctx, ast.Store) and one.id != "_"))


def _used(node: ast.AST) -> set[str]:
    return {one.id for one in ast.walk(node) if isinstance(one, ast.Name)}


def _in_one_block(statement: ast.stmt, name: str) -> bool:
    """Return whether a name occurs in one of the statement's blocks only, so that it is declared there."""
    if isinstance(statement, ast.If):
        blocks: list[list[ast.AST]] = [[*statement.body], [*statement.orelse], [statement.test]]
    elif isinstance(statement, ast.While):
        blocks = [[*statement.body], [statement.test]]
        # set in one turn and read in a later one before it is set again: declare it outside
        return not any(name in _used(one) for one in blocks[1]) and _set_first(statement.body, name)
    elif isinstance(statement, ast.For):
        return _set_first(statement.body, name)
    else:
        return False
    holding = [block for block in blocks if any(name in _used(one) for one in block)]
    return len(holding) == 1 and holding[0] is not blocks[2]


def _set_first(body: list[ast.stmt], name: str) -> bool:
    """Return whether the first statement of a loop's body that has a name sets it without reading it."""
    for statement in body:
        if name not in _used(statement):
            continue
        if isinstance(statement, ast.Assign):
            return name not in _used(statement.value)
        return False
    return False
