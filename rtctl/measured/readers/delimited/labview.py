"""Heads of LabVIEW measurement files (.lvm): of the file, and of each of its segments, with a cell for each channel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

_FIRST, _END = "LabVIEW Measurement", "***End_of_Header***"
NO_CHANNELS = ("X_Value", "Comment")
"""Names of columns that are no channels: the instants, and what was written beside them."""


def below_heads(lines: Sequence[str]) -> int:
    """Return the line below the heads of the file and of its first segment; 0: it is no such file.

    Lines in them, such as `Samples`, have as many cells with numbers as the rows below.
    """
    if not lines or not lines[0].startswith(_FIRST):
        return 0
    ends = [k + 1 for k, line in enumerate(lines) if line.startswith(_END)]
    return max(ends[:2], default=0)


class Starts(NamedTuple):
    """When the channels of a file begin."""

    start_s: dict[str, float]
    """Time [s] by channel; {}: all begin at the same time, or nobody says."""
    remark: str = ""
    """What a user must know of them."""


def starts_of(lines: Sequence[str], names: Sequence[str]) -> Starts:
    """Return when the channels of a file begin, by the lines above its numbers and the names of its columns."""
    head = lines[: below_heads(lines)]
    cells = [line.split("\t") for line in head if line.startswith("X0\t")]
    channels = [name for name in names if name and name not in NO_CHANNELS]
    try:
        starts = [float(cell.replace(",", ".")) for cell in cells[0][1:] if cell.strip()] if cells else []
    except ValueError:
        return Starts({})
    if len(set(starts)) < 2 or len(starts) != len(channels):
        return Starts({})
    if not any(line.split() == ["X_Columns", "One"] for line in head):
        return Starts(dict(zip(channels, starts, strict=True)))
    return Starts(
        {},
        f"its columns begin at different times (X0 = {', '.join(f'{one:g}' for one in starts)}) and share one column "
        "of times: they are taken as rows of that; if they are not, export one time for each",
    )
