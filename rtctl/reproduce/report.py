"""The report of a study: DIR/report.md (what the documentation keeps), DIR/report.html, DIR/results.json."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from html import escape
from pathlib import Path

from rtctl.evaluation.metrics import finite
from rtctl.output.atomic_write import replacing
from rtctl.output.html_page import figure, page, table
from rtctl.output.own_files import mark_of, refuse_foreign
from rtctl.reproduce.study import Comparison, Part, Picture, Row, Section, Study, Table, as_json

HEADERS = ("", "unit", "paper", "ours", "ratio", "")
NUMBERS = (2, 3, 4)


COMMAND = "reproduce"


def check_folder(out: Path) -> None:
    """Raise InputError where a file of a study is in the folder that no study wrote."""
    names = ("results.json", "report.md", "report.html")
    for path in (*(out / name for name in names), *out.glob("pictures/*.png"), *out.glob("sections/*.json")):
        refuse_foreign(path, COMMAND)


def write_report(
    study: Study, sections: Sequence[tuple[Section, float]], out: Path, command: str, finished: str
) -> None:
    """Write all three files. `command` is what makes them, `finished` the date and the machine."""
    found = [section for section, _ in sections]
    took = f"Made by `{command}` in {sum(seconds for _, seconds in sections):.0f} s ({finished})."
    results = {
        "program": mark_of(COMMAND),
        "study": study.name,
        "command": command,
        "finished": finished,
        "sections": [
            {"name": step.name, "seconds": seconds, **as_json(section)}
            for step, (section, seconds) in zip(study.steps, sections, strict=True)
        ],
    }
    _write(out / "results.json", json.dumps(finite(results), indent=1) + "\n")
    _write(out / "report.md", _markdown(study, found, took))
    _write(out / "report.html", page(study.title, _html(study, found, took, out / "pictures"), COMMAND))


def _write(path: Path, text: str) -> None:
    with replacing(path, COMMAND) as partial:
        partial.write_text(text, encoding="utf-8")


def cell(value: float | None) -> str:
    """Return a number in four digits; a dash where there is none."""
    return "–" if value is None else f"{value:.4g}"


def cells(row: Row) -> tuple[str, ...]:
    """Return a row of a comparison as text."""
    ratio = "–" if row.ratio is None else f"{row.ratio:.3g}"
    return (row.quantity, row.unit, cell(row.paper), cell(row.ours), ratio, row.note)


def _markdown(study: Study, sections: Sequence[Section], took: str) -> str:
    lines = [f"# {study.title}", "", study.lead, "", f"Paper: {study.paper}", "", took, ""]
    if study.faults:
        lines += ["## What the paper has wrong", "", *(f"- {fault}" for fault in study.faults), ""]
    for section in sections:
        lines += [f"## {section.title}", "", section.text, ""]
        for part in section.parts:
            lines += [*_markdown_part(part), ""]
    return "\n".join(lines).rstrip() + f"\n\n<!-- Written by {mark_of(COMMAND)} -->\n"


def _markdown_part(part: Part) -> list[str]:
    if isinstance(part, Picture):
        return [f"![{part.alt}](pictures/{part.file})", "", f"*{part.caption}*"]
    headers, rows, numbers = _table(part)
    rules = ["---:" if k in numbers else "---" for k in range(len(headers))]
    text = [part.text, ""] if part.text else []
    lines = ["| " + " | ".join(line) + " |" for line in (headers, rules, *rows)]
    return [f"**{part.title}**", "", *text, *lines]


def _html(study: Study, sections: Sequence[Section], took: str, pictures: Path) -> list[str]:
    parts = [
        f"<h1>{escape(study.title)}</h1>",
        *_paragraphs(study.lead),
        *_paragraphs(f"Paper: {study.paper}"),
    ]
    parts.append(f'<p class="dim small">{escape(took.replace("`", ""))}</p>')
    if study.faults:
        faults = "".join(f"<li>{escape(fault)}</li>" for fault in study.faults)
        parts.append(f"<h2>What the paper has wrong</h2><ul>{faults}</ul>")
    number = 0
    for section in sections:
        parts += [f"<h2>{escape(section.title)}</h2>", *_paragraphs(section.text)]
        for part in section.parts:
            number += isinstance(part, Picture)
            parts.append(_html_part(part, pictures, number))
    return parts


def _paragraphs(text: str) -> list[str]:
    return [f"<p>{escape(one)}</p>" for one in text.split("\n\n") if one.strip()]


def _html_part(part: Part, pictures: Path, number: int) -> str:
    if isinstance(part, Picture):
        suffix = Path(part.file).suffix.lstrip(".")
        data = base64.b64encode((pictures / part.file).read_bytes()).decode("ascii")
        return figure(f"data:image/{suffix};base64,{data}", part.alt, escape(part.caption), number)
    headers, rows, numbers = _table(part)
    body = table([escape(one) for one in headers], [[escape(one) for one in row] for row in rows], numbers)
    return f"<p><b>{escape(part.title)}</b></p>" + "".join(_paragraphs(part.text)) + body


def _table(
    part: Comparison | Table,
) -> tuple[Sequence[str], Sequence[tuple[str, ...]], Sequence[int]]:
    if isinstance(part, Comparison):
        return HEADERS, [cells(row) for row in part.rows], NUMBERS
    return part.headers, part.rows, part.numbers
