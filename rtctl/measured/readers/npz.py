"""NumPy .npz: one array a column; rows are read in place where it is not compressed, else unpacked up to them."""

from __future__ import annotations

import struct
import zipfile
from math import prod
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from rtctl.measured.readers.hdf5_storage.fields import field_refusal
from rtctl.measured.readers.stated.beside import MOST_NUMBERS, levels_of
from rtctl.measured.readers.table import Column, Header, Table, reading, vector_rows

_LOCAL_HEADER = struct.Struct("<26xHH")  # ZIP, 4.3.7: its last two fields are the lengths of name and extra
_UNPACK_BYTES = 1 << 20


class _Layout(NamedTuple):
    """Position of an array's numbers in its member of the archive."""

    header: Header
    dtype: np.dtype[np.generic]
    offset: int
    """Offset [bytes] of the first number in the unpacked member."""
    stored_at: int | None
    """Offset [bytes] of the first number in the file, if the member is not compressed."""
    is_fortran: bool
    """Whether the first index of a matrix runs fastest."""


def read(path: Path) -> Table:
    """Return the columns of an .npz file. Raises ValueError in words."""
    if not zipfile.is_zipfile(path):
        raise ValueError(
            "not an .npz file, or cut off; save it with numpy.savez(path, drive=..., displacement=...)"
        )
    with reading("an .npz file"), zipfile.ZipFile(path) as archive, path.open("rb") as file:
        arrays = {
            info.filename.removesuffix(".npy"): (info, _layout(archive, info, file))
            for info in archive.infolist()
            if info.filename.endswith(".npy")
        }

    fields = {
        f"{name}.{field}": (name, field)
        for name, (_, layout) in arrays.items()
        for field in layout.dtype.names or ()
        if not layout.header.refusal
    }

    def load(column: str, first: int, end: int) -> Column:
        name, field = fields.get(column, (column, ""))
        values = load_array(name, first, end)
        return np.ascontiguousarray(values[field]) if field else values

    def load_array(name: str, first: int, end: int) -> Column:
        info, layout = arrays[name]
        shape = layout.header.shape
        with reading("an .npz file"):
            if len(shape) > 1 and max(shape) < prod(shape):
                whole = numbers(info, layout, 0, prod(shape))
                whole = whole.reshape(shape, order="F" if layout.is_fortran else "C")
                return np.ascontiguousarray(whole[vector_rows(shape, first, end)])
            return numbers(info, layout, first, end)

    def numbers(info: zipfile.ZipInfo, layout: _Layout, first: int, end: int) -> Column:
        if layout.stored_at is None:
            return _unpacked(path, info, layout, first, end)
        start = layout.stored_at + first * layout.dtype.itemsize
        return _whole(np.fromfile(path, layout.dtype, count=end - first, offset=start), first, end)

    few = {
        name: numbers(info, layout, 0, prod(layout.header.shape))
        for name, (info, layout) in arrays.items()
        if prod(layout.header.shape) <= MOST_NUMBERS and not layout.header.refusal and not layout.dtype.names
    }
    headers = {name: layout.header for name, (_, layout) in arrays.items() if layout.dtype.names is None}
    for column, (name, field) in fields.items():
        layout, kind = arrays[name][1], arrays[name][1].dtype
        part: np.dtype[Any] = np.empty(0, kind)[field].dtype
        headers[column] = layout.header._replace(dtype=part, refusal=field_refusal(part))
    return Table(
        columns=headers,
        load=load,
        beside=levels_of(few, {}),
        piecewise=all(layout.stored_at is not None for _, layout in arrays.values()),
    )


def _layout(archive: zipfile.ZipFile, info: zipfile.ZipInfo, file: IO[bytes]) -> _Layout:
    with archive.open(info) as member:
        version = np.lib.format.read_magic(member)
        parse = (
            np.lib.format.read_array_header_1_0 if version[0] == 1 else np.lib.format.read_array_header_2_0
        )
        shape, is_fortran, dtype = parse(member)
        offset = member.tell()
    objects = "holds Python objects, numbers are needed" if dtype.hasobject else ""
    header = Header(shape=shape, dtype=None if objects else dtype, refusal=objects)
    if info.compress_type != zipfile.ZIP_STORED:
        return _Layout(header, dtype, offset, None, is_fortran)
    file.seek(info.header_offset)
    name_bytes, extra_bytes = _LOCAL_HEADER.unpack(file.read(_LOCAL_HEADER.size))
    stored_at = info.header_offset + _LOCAL_HEADER.size + name_bytes + extra_bytes + offset
    return _Layout(header, dtype, offset, stored_at, is_fortran)


def _unpacked(path: Path, info: zipfile.ZipInfo, layout: _Layout, first: int, end: int) -> Column:
    with zipfile.ZipFile(path) as archive, archive.open(info) as member:
        to_skip = layout.offset + first * layout.dtype.itemsize
        while to_skip > 0:
            to_skip -= len(member.read(min(to_skip, _UNPACK_BYTES))) or to_skip  # at the end: nothing follows
        packed = member.read((end - first) * layout.dtype.itemsize)
    return _whole(np.frombuffer(packed, layout.dtype), first, end)


def _whole(values: Column, first: int, end: int) -> Column:
    if len(values) < end - first:
        raise ValueError(f"an array ends after {first + len(values)} values")
    return values
