"""Tables for a terminal: they fit its width, 80 columns where nothing says how wide it is, and cut no cell.

Columns that do not fit stand in a block of their own below, each with the first column, as a wide table is printed in a
book. rich is imported when it is needed.
"""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Sequence
from typing import Any, Literal

PIPE_WIDTH = 80
"""Columns where no terminal says how many it has."""
BETWEEN = 2
"""Columns between two columns of a table: the box has one of them."""
LONGEST_TEXT = 36
"""Columns from which a text that is no number may be folded."""


def print_table(title: str, headers: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table on standard output: columns of numbers right-aligned, long texts folded, never cut."""
    from rich.console import Console

    console = Console(width=None if sys.stdout.isatty() else PIPE_WIDTH, highlight=False)
    blocks = split_columns(headers, rows, console.width)
    for k, columns in enumerate(blocks):
        console.print(_block("" if k else title, columns, headers, rows, console.width))


def split_columns(headers: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[list[int]]:
    """Return the columns of each block of a table that is at most `width` wide; each begins with the first column."""
    widths = [_width_of(header, [row[k] for row in rows]) for k, header in enumerate(headers)]
    blocks, used = [[0]], widths[0]
    for k in range(1, len(headers)):
        if used + BETWEEN + widths[k] > width and len(blocks[-1]) > 1:
            blocks.append([0])
            used = widths[0]
        blocks[-1].append(k)
        used += BETWEEN + widths[k]
    return blocks


def _width_of(header: str, cells: Sequence[str]) -> int:
    """Return the width that a column needs: headers are folded between words, long texts anywhere."""
    from rich.cells import cell_len

    words = max((cell_len(word) for word in header.split()), default=0)
    widest = max((cell_len(cell) for cell in cells), default=0)
    return max(words, widest if _are_numbers(cells) else min(widest, LONGEST_TEXT))


def _fits(columns: Sequence[int], headers: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> bool:
    """Return whether a block fits with all its headers on one line."""
    whole = (max(_width_of("", [row[k] for row in rows]), len(headers[k])) for k in columns)
    return sum(whole) + BETWEEN * (len(columns) - 1) <= width


def _block(
    title: str, columns: Sequence[int], headers: Sequence[str], rows: Sequence[Sequence[str]], width: int
) -> Any:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(
        title=plain(title) or None, title_justify="left", title_style="bold", box=SIMPLE_HEAD, pad_edge=False,
        padding=(0, BETWEEN - 1, 0, 0), show_edge=False,
    )  # fmt: skip
    on_one_line = _fits(columns, headers, rows, width)
    for place, k in enumerate(columns):
        cells = [row[k] for row in rows]
        numbers = k > 0 and _are_numbers(cells)
        justify: Literal["left", "right"] = "right" if numbers else "left"
        fixed = place == 0 and _width_of("", cells) <= LONGEST_TEXT
        folded = "\n".join(textwrap.wrap(headers[k], max(_width_of(headers[k], cells), 1)))
        header = headers[k] if on_one_line else folded
        table.add_column(plain(header), justify=justify, no_wrap=fixed or numbers, overflow="fold")
    for row in rows:
        table.add_row(*(plain(row[k]) for k in columns))
    return table


def _are_numbers(cells: Sequence[str]) -> bool:
    """Whether the cells that say something all begin as a number does."""
    told = [cell.strip() for cell in cells if cell.strip() not in ("", "–", "-")]
    return bool(told) and all(cell.lstrip("+-−±<>≤≥ ")[:1].isdigit() for cell in told)


def plain(text: str) -> str:
    """Escape units in brackets, which rich would take for markup."""
    from rich.markup import escape as escaped

    return escaped(text)
