"""What HDF5 says of a dataset's numbers where it does not stand at the dataset: at its sources, in its creation.

A virtual dataset gives the numbers of others and none of their attributes: counts without their scale.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from rtctl.measured.readers.hdf5_storage.presence import DEEPEST
from rtctl.measured.readers.stated.attributes import readable_attributes, says_of_numbers

_BY_USER = h5py.h5d.FILL_VALUE_USER_DEFINED


def own_fill_value(dataset: Any) -> float | None:
    """Return the number that HDF5 itself gives for what was not written, where the file sets it; None: 0 or no number.

    It may also stand among the numbers that were: of a dataset that is not in chunks every number is.
    """
    if dataset.dtype.kind not in "iuf" or dataset.id.get_create_plist().fill_value_defined() != _BY_USER:
        return None
    value = float(dataset.fillvalue)
    return value if value != 0.0 and np.isfinite(value) else None


def source_attributes(dataset: Any, folder: Path, depth: int = 0) -> dict[str, Any]:
    """Return the attributes that all sources of a virtual dataset have alike; those of others are none of its own.

    Raises ValueError in words where its sources differ in what they say of their numbers.
    """
    if not dataset.is_virtual or depth >= DEEPEST:
        return {}
    found: list[dict[str, Any]] = []
    for source in dataset.virtual_sources():
        if source.file_name == ".":
            found.append(_stored_attributes(dataset.file, source.dset_name, folder, depth))
            continue
        path = folder / source.file_name
        with h5py.File(path, "r") as file:
            found.append(_stored_attributes(file, source.dset_name, path.parent, depth))
    first, *rest = found or [{}]
    for other in rest:
        for key in first.keys() | other.keys():
            if says_of_numbers(key) and not _are_equal(first.get(key), other.get(key)):
                raise ValueError(
                    f'is virtual, and its sources differ in "{key}": {first.get(key)} and {other.get(key)}; write the '
                    "numbers to one file"
                )
    return {key: value for key, value in first.items() if says_of_numbers(key)}


def _are_equal(one: Any, other: Any) -> bool:
    return one is not None and other is not None and bool(np.array_equal(one, other))


def _stored_attributes(file: Any, name: str, folder: Path, depth: int) -> dict[str, Any]:
    stored = file[name]
    fill = own_fill_value(stored)
    own = {} if fill is None else {"_FillValue": fill}
    return {**source_attributes(stored, folder, depth + 1), **own, **readable_attributes(stored)}
