"""Fields of compound HDF5 datasets, each a column with what the attributes say of it, and complex numbers of MATLAB."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtctl.measured.readers.stated.attributes import says_of_numbers
from rtctl.measured.readers.stated.keys import is_unit_key, says_of_columns

_FIELD_KEY = re.compile(r"FIELD_(?P<place>\d+)_(?P<key>\w+)")
"""Attributes by which PyTables says something of one field: `FIELD_2_UNITS`."""
_COMPLEX = frozenset({"real", "imag"})


def field_names(dtype: np.dtype[Any]) -> tuple[str, ...]:
    """Return the fields of a compound type that are columns; (): it is a plain one, or one of complex numbers."""
    names = dtype.names or ()
    return () if set(names) == _COMPLEX else names


def field_attributes(attributes: Mapping[str, Any], place: int, count: int) -> dict[str, Any]:
    """Return what the attributes of a compound dataset say of one of its `count` fields.

    Those with as many items as there are fields say one of each; for a unit or a scale for all see `common_attributes`.
    """
    found: dict[str, Any] = {}
    for key, value in attributes.items():
        named = _FIELD_KEY.fullmatch(key)
        if named is not None:
            if int(named["place"]) == place and is_unit_key(named["key"]):
                found[named["key"]] = value
        elif np.shape(value) == (count,):
            found[key] = np.asarray(value)[place]
        elif count == 1 or not says_of_numbers(key):
            found[key] = value
    return found


def common_attributes(attributes: Mapping[str, Any], count: int) -> dict[str, Any]:
    """Return what attributes say of units and scales of a compound dataset of `count` fields as a whole.

    That stands beside the fields as what a group says beside its datasets: `x_unit`, or a unit of nobody knows which.
    """
    return {
        key: value
        for key, value in attributes.items()
        if count > 1
        and says_of_columns(key)
        and np.shape(value) != (count,)
        and not _FIELD_KEY.fullmatch(key)
    }


def field_refusal(dtype: np.dtype[Any]) -> str:
    """Return why a field is no column, as a phrase that continues its name; "": it is one."""
    if dtype.subdtype is not None:
        return f"holds {dtype.shape} numbers in each row, one is needed: save each as a dataset of its own"
    if field_names(dtype):
        return "holds a record in each row, one number is needed: save its fields as datasets of their own"
    return ""


def type_of(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return the type of the numbers that are read: complex ones of MATLAB are a compound of two."""
    return np.dtype(np.complex128) if set(dtype.names or ()) == _COMPLEX else dtype


def read_rows(dataset: Any, rows: tuple[slice, ...], field: str) -> NDArray[Any]:
    """Return rows of an h5py dataset, of one field where that is not ""."""
    stored = np.asarray(dataset.fields(field)[rows] if field else dataset[rows])
    if set(stored.dtype.names or ()) == _COMPLEX:
        stored = stored["real"] + 1j * stored["imag"]
    return stored
