"""Headers of the variables of a MATLAB file of version 5, and what is said of MATLAB's objects.

SciPy lists no variables of a file that has an object beside its numbers, so the headers are read here: of each
variable array flags, dimensions and name, which come first ("MAT-File Format", level 5; a compressed variable is
unpacked as far as that).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, NamedTuple

_HEADER_BYTES = 128  # text, version, two bytes that tell the byte order
_TAG_BYTES = 8
_OPENING_BYTES = 2048
"""Bytes of a variable that hold its flags, dimensions and name."""
_MATRIX, _COMPRESSED = 14, 15
_OPAQUE = 17
_COMPLEX, _LOGICAL = 0x08, 0x02
_CLASSES = {
    1: "cell", 2: "struct", 3: "object", 4: "char", 5: "sparse", 6: "double", 7: "single", 8: "int8", 9: "uint8",
    10: "int16", 11: "uint16", 12: "int32", 13: "uint32", 14: "int64", 15: "uint64", 16: "function", _OPAQUE: "opaque",
}  # fmt: skip
_EXPORTS = {
    "timeseries": "t = {0}.Time; x = {0}.Data(:)",
    "datetime": "t = seconds({0} - {0}(1))",
    "duration": "t = seconds({0})",
    "string": "x = double({0})",
    "table": "x = {0}.NAME",
    "timetable": "t = seconds({0}.Properties.RowTimes - {0}.Properties.RowTimes(1)); x = {0}.NAME",
    "categorical": "x = double({0})",
}


class Variable(NamedTuple):
    """A variable of a file."""

    name: str
    shape: tuple[int, ...]
    kind: str
    """MATLAB class; "complex" of complex numbers; of an object the name of its class."""
    is_object: bool = False


def describe_object(kind: str, name: str) -> str:
    """Return why an object of MATLAB is no signal and how to save its numbers, as a phrase that continues its name."""
    how = _EXPORTS.get(kind, "save its properties that are plain arrays").format(name)
    return (
        f"is a MATLAB {kind or 'object'}, an object that only MATLAB reads; save its numbers in MATLAB: {how}"
    )


def variables(path: Path) -> Iterator[Variable]:
    """Yield the variables of a file of version 5, in order.

    Raises:
        ValueError: The file was cut off (SciPy silently passes over such a variable), or a header makes no sense.
    """
    size, start = path.stat().st_size, _HEADER_BYTES
    with path.open("rb") as file:
        order = "<" if file.read(_HEADER_BYTES)[-2:] == b"IM" else ">"
        while start < size:
            file.seek(start)
            tag = file.read(_TAG_BYTES)
            if len(tag) < _TAG_BYTES:
                raise ValueError(_cut_off(start))
            kind, content_bytes = struct.unpack(f"{order}II", tag)
            if start + _TAG_BYTES + content_bytes > size:
                raise ValueError(_cut_off(start))
            found = _variable(_opening(file, kind, content_bytes), order)
            if found is not None and found.name:  # without a name: what MATLAB keeps of its objects
                yield found
            start += _TAG_BYTES + content_bytes


def is_version_5(path: Path) -> bool:
    """Return whether a file has the byte-order mark of version 5."""
    with path.open("rb") as file:
        return file.read(_HEADER_BYTES)[-2:] in (b"IM", b"MI")


def _cut_off(start: int) -> str:
    return f"is cut off: the variable at byte {start} is not complete; copy or save it again"


def _opening(file: IO[bytes], kind: int, content_bytes: int) -> bytes:
    """Return the first bytes within a variable; b"" of an element of another kind."""
    if kind == _MATRIX:
        return file.read(min(content_bytes, _OPENING_BYTES))
    if kind != _COMPRESSED:
        return b""
    packed = file.read(min(content_bytes, 4 * _OPENING_BYTES))
    return zlib.decompressobj().decompress(packed, _OPENING_BYTES)[_TAG_BYTES:]


def _variable(opening: bytes, order: str) -> Variable | None:
    if not opening:
        return None
    parts = _parts(opening, order)
    (flags,) = struct.unpack_from(f"{order}I", next(parts))
    number, flags = flags & 0xFF, flags >> 8
    if number == _OPAQUE:
        name, _, own_class = (next(parts) for _ in range(3))  # between them its family: MCOS, java
        return Variable(_text(name), (1,), _text(own_class), is_object=True)
    dimensions, name = next(parts), next(parts)
    shape = struct.unpack(f"{order}{len(dimensions) // 4}i", dimensions)
    kind = (
        "complex" if flags & _COMPLEX else "logical" if flags & _LOGICAL else _CLASSES.get(number, "unknown")
    )
    return Variable(_text(name), shape, kind)


def _parts(opening: bytes, order: str) -> Iterator[bytes]:
    """Yield the contents of the elements within a variable, small ones (up to 4 bytes, in the tag) among them."""
    at = 0
    while at + _TAG_BYTES <= len(opening):
        kind, count = struct.unpack_from(f"{order}II", opening, at)
        if kind >> 16:
            yield opening[at + 4 : at + 4 + (kind >> 16)]
            at += _TAG_BYTES
        else:
            yield opening[at + _TAG_BYTES : at + _TAG_BYTES + count]
            at += _TAG_BYTES + -(-count // 8) * 8
    raise ValueError("the header of a variable makes no sense: damaged; save it again")


def _text(raw: bytes) -> str:
    return raw.rstrip(b"\0").decode("latin-1")
