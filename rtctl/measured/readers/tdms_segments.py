"""Segments of a TDMS file: whether the last one is complete, and where an acquisition that was appended begins.

A program that opens a file to append writes `wf_start_time` of its channels once more; a stream that goes on may write
it too, then as late as the samples before it last.
"""

from __future__ import annotations

import io
import re
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from nptdms import TdmsChannel, TdmsFile

_LEAD_IN_BYTES = 28  # tag, table of contents, version, 4 bytes each; next segment, raw data, 8 bytes each
_BIG_ENDIAN = 1 << 6  # of the table of contents, whose own bytes are little-endian
_UNKNOWN_SIZE = 0xFFFF_FFFF_FFFF_FFFF  # what LabVIEW leaves where it could not finish a segment
_START = re.compile(rb"wf_start_time(?:\x44\0\0\0|\0\0\0\x44)(.{16})", re.DOTALL)
"""The property with its type, a time stamp of 16 bytes."""
LONGEST_PAUSE = 0.1
"""Pause, as a share of what was recorded before it, up to which the computer's clock explains it."""
MOST_STARTS = 50
"""Segments with a start time of their own that are looked at one by one; of more the first and the last."""


class Segment(NamedTuple):
    """One segment."""

    first: int
    """Its first byte."""
    end: int
    starts: frozenset[bytes]
    """Start times that it states, as the file stores them."""


def whole_segments(path: Path) -> list[Segment]:
    """Return the segments. Raises ValueError where the file was cut off: npTDMS only logs that, and reads the rest."""
    size, start = path.stat().st_size, 0
    found = []
    with path.open("rb") as file:
        while start < size:
            file.seek(start)
            lead_in = file.read(_LEAD_IN_BYTES)
            if not lead_in.startswith(b"TDSm"):
                raise ValueError(f"not a TDMS file, or damaged: no segment begins at byte {start}")
            if len(lead_in) < _LEAD_IN_BYTES:
                raise ValueError(_cut_off(start))
            order = ">" if int.from_bytes(lead_in[4:8], "little") & _BIG_ENDIAN else "<"
            to_next, to_data = struct.unpack_from(f"{order}QQ", lead_in, 12)
            end = start + _LEAD_IN_BYTES + to_next
            if to_next == _UNKNOWN_SIZE or end > size:
                raise ValueError(_cut_off(start))
            starts = frozenset(_START.findall(file.read(min(to_data, to_next))))
            found.append(Segment(start, end, starts))
            start = end
    return found


def first_rows(file: BinaryIO, segments: Sequence[Segment]) -> dict[str, tuple[int, ...]]:
    """Return by the path of each channel the rows with which further acquisitions begin; without those that have none.

    Args:
        file: The file, open; it may be left anywhere.
        segments: Its segments.

    Raises:
        ValueError: In words: they are too many.
    """
    stating = [one for one in segments if one.starts]
    if len(frozenset().union(*(one.starts for one in stating))) < 2:
        return {}
    if len(stating) > MOST_STARTS:
        if _paused(file, [stating[0], stating[-1]]):
            raise ValueError(
                f"holds {len(stating)} pieces with start times of their own and pauses between them, at most "
                f"{MOST_STARTS} are told apart; save each acquisition to a file of its own"
            )
        return {}
    return _paused(file, stating)


def _paused(file: BinaryIO, stating: Sequence[Segment]) -> dict[str, tuple[int, ...]]:
    """Return the rows of each channel with which an acquisition begins later than the last one ended."""
    found: dict[str, list[int]] = {}
    begun: dict[str, tuple[int, np.datetime64]] = {}
    for one in stating:
        rows = {channel.path: len(channel) for channel in _channels(file, one.first)}
        for channel in _channels(file, one.end):
            start, increment_s = (channel.properties.get(key) for key in ("wf_start_time", "wf_increment"))
            if not isinstance(start, np.datetime64) or not increment_s:
                continue
            now = rows.get(channel.path, 0)
            before, since = begun.setdefault(channel.path, (now, start))
            lasted_s = (now - before) * float(increment_s)
            pause_s = float((start - since) / np.timedelta64(1, "us")) * 1e-6 - lasted_s
            if abs(pause_s) > max(LONGEST_PAUSE * lasted_s, float(increment_s)):
                found.setdefault(channel.path, []).append(now)
                begun[channel.path] = now, start
    return {path: tuple(rows) for path, rows in found.items()}


def _channels(file: BinaryIO, end: int) -> Iterator[TdmsChannel]:
    """Yield the channels as they are in the file up to a byte."""
    if end:
        opened = TdmsFile.read_metadata(_Beginning(file, end))
        yield from (channel for group in opened.groups() for channel in group.channels())


class _Beginning(io.RawIOBase):
    """The bytes of a file up to one."""

    def __init__(self, file: BinaryIO, end: int) -> None:
        self.file, self.end = file, end
        file.seek(0)

    def read(self, size: int = -1) -> bytes:
        left = max(self.end - self.file.tell(), 0)
        return self.file.read(left if size < 0 else min(size, left))

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        return self.file.seek(self.end + offset) if whence == io.SEEK_END else self.file.seek(offset, whence)

    def tell(self) -> int:
        return self.file.tell()

    def seekable(self) -> bool:
        return True

    def readable(self) -> bool:
        return True


def _cut_off(start: int) -> str:
    return (
        f"is cut off: its last segment, from byte {start}, is not complete; copy the file again, or open and "
        "save it in LabVIEW or DIAdem"
    )
