"""The tree keeps its shape: few files a folder, short functions, few parameters, a docstring on every public name."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parents[2]
PRODUCT = ("rtctl", "plant_sim", "drivers")
FILES_A_FOLDER, LINES, PARAMETERS = 14, 60, 7
DEFENDED = {"lines": r"#.*\blong because\b", "parameters": r"#.*\bparameters because\b"}

CROWDED: set[str] = set()
"""Folders with too many files that are still being divided."""
LONG: set[str] = set()
"""Functions that are too long without a defending comment and are still being divided."""
WIDE: set[str] = set()
"""Functions with too many parameters without a defending comment that still wait for a record."""
BARE: set[str] = set()
"""Public names without a docstring that still wait for one."""


class Function(NamedTuple):
    """A function of the product and where it stands."""

    name: str
    node: ast.FunctionDef | ast.AsyncFunctionDef
    source: tuple[str, ...]
    """Lines of its file."""

    @property
    def length(self) -> int:
        """Lines of the body and the signature, without decorators and docstring."""
        assert self.node.end_lineno is not None
        first = self.node.body[0]
        length = self.node.end_lineno - self.node.lineno + 1
        if ast.get_docstring(self.node) is not None:
            assert first.end_lineno is not None
            length -= first.end_lineno - first.lineno + 1
        return length

    @property
    def parameters(self) -> int:
        """Number of parameters without `self` and `cls`."""
        a = self.node.args
        every = [*a.posonlyargs, *a.args, *a.kwonlyargs, *filter(None, (a.vararg, a.kwarg))]
        return sum(argument.arg not in ("self", "cls") for argument in every)

    def is_defended(self, what: str) -> bool:
        """Whether a comment above the definition, in its signature or just below it says why."""
        start = min([self.node.lineno, *(decorator.lineno for decorator in self.node.decorator_list)])
        end = self.node.body[0].lineno
        if ast.get_docstring(self.node) is not None:
            end = (self.node.body[0].end_lineno or end) + 1
        return any(re.search(DEFENDED[what], line) for line in self.source[max(start - 3, 0) : end])


def files(root: Path = ROOT) -> Iterator[Path]:
    """Python files of the product."""
    for package in PRODUCT:
        yield from sorted((root / package).rglob("*.py"))


def functions(root: Path = ROOT) -> Iterator[Function]:
    """All functions and methods of the product, nested ones too."""
    for path in files(root):
        source = path.read_text(encoding="utf-8")
        lines = tuple(source.splitlines())
        for name, node in named(ast.parse(source)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                yield Function(f"{path.relative_to(root)}:{name}", node, lines)


def named(tree: ast.AST, prefix: str = "") -> Iterator[tuple[str, ast.AST]]:
    """Classes and functions below `tree` with their dotted names."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield prefix + node.name, node
            yield from named(node, f"{prefix}{node.name}.")
        else:
            yield from named(node, prefix)


def crowded(root: Path = ROOT) -> set[str]:
    """Folders with too many files at one level."""
    folders = {path.parent for path in files(root)}
    counts = {str(folder.relative_to(root)): len(list(folder.glob("*.py"))) for folder in folders}
    return {name for name, count in counts.items() if count > FILES_A_FOLDER}


def long(root: Path = ROOT) -> set[str]:
    """Functions that are too long, undefended."""
    return {f.name for f in functions(root) if f.length > LINES and not f.is_defended("lines")}


def wide(root: Path = ROOT) -> set[str]:
    """Functions with too many parameters, undefended."""
    return {f.name for f in functions(root) if f.parameters > PARAMETERS and not f.is_defended("parameters")}


def bare(root: Path = ROOT) -> set[str]:
    """Public modules, classes, functions and methods without a docstring; what a private name holds is private."""
    found = set()
    for path in files(root):
        tree, place = ast.parse(path.read_text(encoding="utf-8")), str(path.relative_to(root))
        if ast.get_docstring(tree) is None and (path.name != "__init__.py" or tree.body):
            found.add(place)
        for name, node in public(tree):
            if ast.get_docstring(node) is None and not overloads(node):
                found.add(f"{place}:{name}")
    return found


def public(tree: ast.AST, prefix: str = "") -> Iterator[tuple[str, ast.ClassDef | ast.FunctionDef]]:
    """Public classes and functions of a module, public methods of its public classes."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            if node.name.startswith("_"):
                continue
            yield prefix + node.name, node  # type: ignore[misc]
            if isinstance(node, ast.ClassDef):
                yield from public(node, f"{prefix}{node.name}.")
        elif isinstance(node, ast.If | ast.Try):
            yield from public(node, prefix)


def overloads(node: ast.AST) -> bool:
    """Whether a method takes its docstring from elsewhere: a property's setter, an overload or an override."""
    decorators = [ast.unparse(decorator) for decorator in getattr(node, "decorator_list", [])]
    return any(text.split(".")[-1] in ("setter", "overload", "override") for text in decorators)


@pytest.mark.parametrize(
    ("check", "allowed"),
    [(crowded, CROWDED), (long, LONG), (wide, WIDE), (bare, BARE)],
    ids=["files", "lines", "parameters", "docstrings"],
)
def test_nothing_offends_but_what_is_allowed(check, allowed: set[str]) -> None:
    offenders = check()
    assert sorted(offenders - allowed) == [], f"{check.__name__}: divide it, or defend it by a comment"


def write(root: Path, text: str, name: str = "a.py") -> None:
    (root / "rtctl").mkdir(exist_ok=True)
    (root / "rtctl" / name).write_text(text, encoding="utf-8")


def test_a_crowded_folder_is_seen(tmp_path: Path) -> None:
    for k in range(FILES_A_FOLDER):
        write(tmp_path, '"""M."""\n', f"m{k}.py")
    assert crowded(tmp_path) == set()
    write(tmp_path, '"""M."""\n')
    assert crowded(tmp_path) == {"rtctl"}


@pytest.mark.parametrize("comment", ["", "# long because it is a table", "# it is long"])
def test_a_long_function_is_seen_unless_it_is_defended(tmp_path: Path, comment: str) -> None:
    body = "    x = 1\n" * LINES
    write(tmp_path, f'{comment}\ndef f():\n    """D.\n\n    More.\n    """\n{body}')
    assert long(tmp_path) == (set() if "because" in comment else {"rtctl/a.py:f"})
    write(tmp_path, "def f():\n" + "    x = 1\n" * (LINES - 1))
    assert long(tmp_path) == set()


@pytest.mark.parametrize("comment", ["", "  # 8 parameters because the C library has them"])
def test_many_parameters_are_seen_unless_they_are_defended(tmp_path: Path, comment: str) -> None:
    write(tmp_path, f"class A:\n    def f(self, a, b, c, d, *, e, g, h, i=0):{comment}\n        return 1\n")
    assert wide(tmp_path) == (set() if comment else {"rtctl/a.py:A.f"})
    write(tmp_path, "class A:\n    def f(self, a, b, c, d, *, e, g, h):\n        return 1\n")
    assert wide(tmp_path) == set()


def test_a_public_name_without_docstring_is_seen(tmp_path: Path) -> None:
    write(
        tmp_path,
        '"""M."""\nclass A:\n    def f(self):\n        pass\n    def _g(self):\n        pass\n'
        "    def __repr__(self):\n        return ''\nclass _B:\n    def f(self):\n        pass\n",
    )
    assert bare(tmp_path) == {"rtctl/a.py:A", "rtctl/a.py:A.f"}
