"""Write docs/thresholds.md from the docstrings of rtctl/diagnosis/thresholds: `python benchmarks/thresholds_table.py`.

The source is read, not imported: a field's docstring is the string below it, which `ast` sees and Python drops.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "rtctl" / "diagnosis" / "thresholds"
PAGE = ROOT / "docs" / "thresholds.md"
HEAD = """# Thresholds of a diagnosis

Every number that decides in a [diagnosis](diagnosis-method.md), with its unit and its reason. The numbers are fields of
the frozen records in `rtctl/diagnosis/thresholds/`; `dataclasses.replace` changes one for a test or a study. A dash in
the column of units means a number without unit. This page is generated from the source by `make thresholds`.
"""
BRACKET = re.compile(r"\s*\[([^\]]+)\]")


def thresholds_page() -> str:
    """Return the page: one section and one table a record, in the order of the stages in `Thresholds`."""
    return HEAD + "".join(f"\n{section}" for section in map(_section, _stages()))


def _stages() -> list[tuple[str, ast.ClassDef]]:
    """Return title and class of each stage, in the order in which `Thresholds` lists them."""
    trees = [ast.parse(path.read_text(encoding="utf-8")) for path in sorted(PACKAGE.glob("*.py"))]
    classes = {node.name: node for tree in trees for node in tree.body if isinstance(node, ast.ClassDef)}
    fields = [node for node in classes["Thresholds"].body if isinstance(node, ast.AnnAssign)]
    stages = [(ast.unparse(node.target), ast.unparse(node.annotation)) for node in fields]
    return [(name.replace("_", " ").capitalize(), classes[record]) for name, record in stages]


def _section(stage: tuple[str, ast.ClassDef]) -> str:
    title, record = stage
    about = " ".join((ast.get_docstring(record) or "").split())
    common = BRACKET.search(about)
    rows = _rows(record, common[1] if common else "–")
    if not rows:
        return f"## {title}\n\n{about}\n"
    table = ["| threshold | value | unit | what it decides, and why |", "|---|---|---|---|", *rows]
    return f"## {title}\n\n{about}\n\n" + "\n".join(table) + "\n"


def _rows(record: ast.ClassDef, common_unit: str) -> list[str]:
    """Return the table's rows: fields with the string below each."""
    rows = []
    for field, below in zip(record.body, [*record.body[1:], None], strict=True):
        if not isinstance(field, ast.AnnAssign) or field.value is None:
            continue
        text = ""
        if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
            text = " ".join(str(below.value.value).split())
        unit = BRACKET.search(text)
        if unit:
            text = text[: unit.start()] + text[unit.end() :]
        name, value = ast.unparse(field.target), _value(field.value)
        rows.append(f"| `{name}` | {value} | {unit[1] if unit else common_unit} | {_escaped(text)} |")
    return rows


def _value(node: ast.expr) -> str:
    """Return a value as it is read: tuples without parentheses, large numbers with an exponent."""
    if isinstance(node, ast.Tuple):
        return ", ".join(_value(item) for item in node.elts)
    text = ast.unparse(node)
    try:
        number = float(text)
    except ValueError:
        return _escaped(text)
    return text if abs(number) < 1e5 else f"{number:g}"


def _escaped(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;").replace("*", "\\*")


if __name__ == "__main__":
    PAGE.write_text(thresholds_page(), encoding="utf-8")
