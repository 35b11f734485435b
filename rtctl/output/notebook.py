"""Short tables for notebooks, and numbers as a person reads them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

MOST_ROWS = 12
"""Rows that a notebook shows of a longer table."""


def html_table(
    title: str,
    headers: Sequence[str],
    rows: Sequence[Sequence[str]],
    notes: Iterable[str] = (),
    most_rows: int = MOST_ROWS,
) -> str:
    """Return an HTML table with a title above and notes below; all text is escaped, rows beyond `most_rows` counted."""
    head = "".join(f"<th>{escape(header)}</th>" for header in headers)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows[:most_rows]
    )
    below = list(notes)
    if len(rows) > most_rows:
        below.insert(0, f"and {len(rows) - most_rows} rows more")
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>" if rows else ""
    heading = f"<p><b>{escape(title)}</b></p>" if title else ""
    return heading + table + "".join(f"<p>{escape(note)}</p>" for note in below)


def number(value: float | None, unit: str = "") -> str:
    """Return `0.1234 um`, or a dash where there is no value."""
    if value is None or value != value:
        return "–"
    plain = "" if unit in ("", "dimensionless") else f" {unit}"
    return f"{value:.4g}{plain}"
