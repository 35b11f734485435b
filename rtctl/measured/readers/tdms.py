"""TDMS of LabVIEW and DIAdem by npTDMS: channels; piece by piece as the file stores them.

A column is named by its channel, or "group/channel" where several groups have a channel of that name. The
property `unit_string` is its unit, `wf_increment` its period [s].
"""

from __future__ import annotations

import struct
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from nptdms import TdmsChannel, TdmsFile

from rtctl.measured.readers.table import Column, Header, Table, reading

_LEAD_IN_BYTES = 28  # tag, table of contents, version, 4 bytes each; next segment, raw data, 8 bytes each
_BIG_ENDIAN = 1 << 6  # of the table of contents, whose own bytes are little-endian
_UNKNOWN_SIZE = 0xFFFF_FFFF_FFFF_FFFF  # what LabVIEW leaves where it could not finish a segment


def read(path: Path) -> Table:
    """Return the channels of a TDMS file as columns. Raises ValueError in words."""
    _check_whole(path)
    with reading("a TDMS file"), path.open("rb") as file, TdmsFile.open(file) as opened:
        channels = [channel for group in opened.groups() for channel in group.channels()]
        places = {name: (c.group_name, c.name) for name, c in zip(_names(channels), channels, strict=True)}
        headers = {name: _header(c) for name, c in zip(_names(channels), channels, strict=True)}

    def load(name: str, first: int, end: int) -> Column:
        # opened as a file, so that an index file beside it, which may be old, is not believed
        with reading("a TDMS file"), path.open("rb") as file, TdmsFile.open(file) as opened:
            group, channel = places[name]
            return np.asarray(opened[group][channel].read_data(first, end - first))

    return Table(columns=headers, load=load)


def _names(channels: list[TdmsChannel]) -> list[str]:
    counts = Counter(channel.name for channel in channels)
    return [c.name if counts[c.name] == 1 else f"{c.group_name}/{c.name}" for c in channels]


def _header(channel: TdmsChannel) -> Header:
    properties = channel.properties
    period_s = _number(properties.get("wf_increment"))
    in_seconds = str(properties.get("wf_xunit_string", "s")).strip() in ("", "s", "sec", "Seconds", "seconds")
    return Header(
        shape=(len(channel),),
        dtype=None if channel.dtype.hasobject else channel.dtype,
        unit=str(properties.get("unit_string", "")).strip() or None,
        period_s=period_s if period_s > 0.0 and in_seconds else None,
        period_key="wf_increment",
        refusal="holds text, numbers are needed" if channel.dtype.hasobject else "",
    )


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float | np.number) else 0.0


def _check_whole(path: Path) -> None:
    """Follow the segments' lead-ins: npTDMS reads a file that was cut off as far as it goes, and only logs it."""
    size, start = path.stat().st_size, 0
    with path.open("rb") as file:
        while start < size:
            file.seek(start)
            lead_in = file.read(_LEAD_IN_BYTES)
            if not lead_in.startswith(b"TDSm"):
                raise ValueError(f"not a TDMS file, or damaged: no segment begins at byte {start}")
            if len(lead_in) < _LEAD_IN_BYTES:
                raise ValueError(_cut_off(start))
            order = ">" if int.from_bytes(lead_in[4:8], "little") & _BIG_ENDIAN else "<"
            (to_next,) = struct.unpack_from(f"{order}Q", lead_in, 12)
            end = start + _LEAD_IN_BYTES + to_next
            if to_next == _UNKNOWN_SIZE or end > size:
                raise ValueError(_cut_off(start))
            start = end


def _cut_off(start: int) -> str:
    return (
        f"is cut off: its last segment, from byte {start}, is not complete; copy the file again, or open and "
        "save it in LabVIEW or DIAdem"
    )
