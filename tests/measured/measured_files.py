"""Files of foreign programs for tests: universal files written out by the format's own description, and TDMS."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter


def write_tdms(
    path: Path,
    columns: Mapping[str, np.ndarray],
    properties: Mapping[str, Mapping[str, Any]] | None = None,
    segments: int = 1,
) -> None:
    """`columns` by "group/channel" or by channel in a group "run"; split over `segments` as a logger streams."""
    with TdmsWriter(str(path)) as writer:
        groups = sorted({_place(name)[0] for name in columns})
        writer.write_segment([RootObject({}), *(GroupObject(group) for group in groups)])
        for k in range(segments):
            writer.write_segment(
                [
                    ChannelObject(
                        *_place(name),
                        np.array_split(values, segments)[k],
                        dict((properties or {}).get(name, {})),
                    )
                    for name, values in columns.items()
                ]
            )


def _place(name: str) -> tuple[str, str]:
    group, _, channel = name.rpartition("/")
    return group or "run", channel


def uff58(
    values: np.ndarray,
    *,
    id1: str = "NONE",
    node: int = 1,
    direction: int = 3,
    form: int = 4,
    spacing: int = 1,
    increment: float = 1e-3,
    start: float = 0.0,
    abscissa: int = 17,
    abscissa_unit: str = "NONE",
    unit: str = "NONE",
    points: int | None = None,
    binary: bool = False,
) -> bytes:
    """One dataset 58 or 58b. Records and formats as in the description of dataset 58 (SDRC)."""
    count = len(values) if points is None else points
    size = 8 * len(values)
    first = f"{58:6d}b{1:6d}{2:6d}{11:12d}{size:12d}{0:6d}{0:6d}{0:12d}{0:12d}" if binary else f"{58:6d}"
    lines = [
        f"{-1:6d}",
        f"{first:<80}",
        *(f"{text:<80}" for text in (id1, "NONE", "21-NOV-26  10:00:00", "NONE", "NONE")),
        f"{1:5d}{0:10d}{0:5d}{0:10d} {'NONE':<10}{node:10d}{direction:4d} {'NONE':<10}{0:10d}{0:4d}",
        f"{form:10d}{count:10d}{spacing:10d}{start:13.5E}{increment:13.5E}{0.0:13.5E}",
        _axis(abscissa, abscissa_unit),
        _axis(8, unit),
        _axis(0, "NONE"),
        _axis(0, "NONE"),
    ]
    head = ("\n".join(lines) + "\n").encode()
    end = f"{-1:6d}\n".encode()
    if binary:
        return head + struct.pack(f"<{len(values)}d", *values) + end
    return head + _numbers(values, form).encode() + end


def _axis(kind: int, unit: str) -> str:
    return f"{kind:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {unit:<20}"


def _numbers(values: np.ndarray, form: int) -> str:
    """6E13.5 or 4E20.12, complex values as pairs."""
    if form in (5, 6):
        values = np.column_stack([values.real, values.imag]).ravel()
    a_line, width, digits = (6, 13, 5) if form in (2, 5) else (4, 20, 12)
    cells = [f"{value:{width}.{digits}E}" for value in values]
    return "".join("".join(cells[k : k + a_line]) + "\n" for k in range(0, len(cells), a_line))


def write_uff(path: Path, functions: Iterable[bytes]) -> None:
    """A universal file of several datasets, after one of another kind (151, header) that is to be passed over."""
    header = f"{-1:6d}\n{151:6d}\n" + "\n".join(["bench", "NONE", "NONE"]) + f"\n{-1:6d}\n"
    path.write_bytes(header.encode() + b"".join(functions))
