"""Whether the numbers of an HDF5 dataset are there: chunks that were written, virtual sources, outside files.

HDF5 gives the fill value, mostly 0, for what was never written or cannot be found, without a word.
"""

from __future__ import annotations

from math import prod
from pathlib import Path
from typing import Any

import h5py
import numpy as np

DEEPEST = 4
"""Virtual datasets of virtual datasets that are followed."""


def absence(dataset: Any, folder: Path, depth: int = 0) -> str:
    """Return why numbers of an h5py dataset cannot be had, as a phrase that continues its name; "": all can.

    Unwritten chunks of a dataset are left to `unwritten_rows`, as they may lie outside the rows that are used.
    """
    if dataset.is_virtual:
        return _virtual_absence(dataset, folder, depth)
    for name, _, _ in dataset.external or ():
        if not (folder / name).is_file() and not Path(name).is_file():
            return f'is kept in the file "{name}", which is not there; put it beside this file'
    if dataset.chunks is None and dataset.size and not dataset.external:
        status = dataset.id.get_space_status()
        if status == h5py.h5d.SPACE_STATUS_NOT_ALLOCATED:
            return "was created, but its numbers were never written"
    return ""


def unwritten_rows(dataset: Any, first: int, end: int) -> tuple[int, int] | None:
    """Return the first stretch [first, end) of rows within those asked for that was never written; None: all were.

    Only datasets in chunks are looked at; the longest axis is that of the rows.
    """
    if dataset.chunks is None or dataset.is_virtual or not dataset.size:
        return None
    counts = [-(-size // chunk) for size, chunk in zip(dataset.shape, dataset.chunks, strict=True)]
    if dataset.id.get_num_chunks() >= prod(counts):
        return None
    axis = int(np.argmax(dataset.shape))
    length = dataset.chunks[axis]
    for k in range(first // length, -(-end // length)):
        corner = tuple(k * length if one == axis else 0 for one in range(len(counts)))
        if dataset.id.get_chunk_info_by_coord(corner).byte_offset is None:
            return max(first, k * length), min(end, (k + 1) * length)
    return None


def _virtual_absence(dataset: Any, folder: Path, depth: int) -> str:
    mapped = 0
    for source in dataset.virtual_sources():
        found = _source_absence(dataset, source, folder, depth)
        if found:
            return found
        mapped += source.vspace.get_select_npoints()
    if mapped < dataset.size:
        return f"is virtual, and {dataset.size - mapped} of its {dataset.size} numbers come from no source"
    return ""


def _source_absence(dataset: Any, source: Any, folder: Path, depth: int) -> str:
    where = f'is virtual, and its source "{source.dset_name}" in "{source.file_name}"'
    if depth >= DEEPEST:
        return f"{where} is virtual too, {DEEPEST} times over; write the numbers to one file"
    path = Path(dataset.file.filename) if source.file_name == "." else folder / source.file_name
    if not path.is_file():
        return f"{where} is not there: no such file; put it beside this file"
    if source.file_name == ".":
        return _stored_absence(dataset.file, source, path.parent, where, depth)
    try:
        with h5py.File(path, "r") as file:
            return _stored_absence(file, source, path.parent, where, depth)
    except OSError:
        return f"{where} cannot be read: not an HDF5 file, or damaged"


def _stored_absence(file: Any, source: Any, folder: Path, where: str, depth: int) -> str:
    stored = file.get(source.dset_name)
    if not isinstance(stored, h5py.Dataset):
        return f"{where} is not there: no such dataset in the file"
    if not _reaches(stored, source):
        return f"{where} is shorter, {stored.shape}, than what is taken from it"
    below = absence(stored, folder, depth + 1)
    unwritten = None if below or not stored.shape else unwritten_rows(stored, 0, max(stored.shape))
    if below or unwritten:
        return f"{where} {below or f'was never written from row {unwritten and unwritten[0]} on'}"
    return ""


def _reaches(stored: Any, source: Any) -> bool:
    """Return whether a source has all that a mapping takes from it."""
    if source.src_space.get_select_type() == h5py.h5s.SEL_ALL:
        return bool(stored.size >= source.vspace.get_select_npoints())
    last = source.src_space.get_select_bounds()[1]
    return len(last) == len(stored.shape) and all(
        one < size for one, size in zip(last, stored.shape, strict=True)
    )
