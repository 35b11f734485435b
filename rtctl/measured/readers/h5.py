"""HDF5 and MATLAB 7.3: datasets by their path in the file. h5py is imported only when a file needs it."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from rtctl.extras import missing_message
from rtctl.measured.readers.groups import place_of
from rtctl.measured.readers.hdf5_storage.fields import (
    common_attributes,
    field_attributes,
    field_names,
    field_refusal,
    read_rows,
    type_of,
)
from rtctl.measured.readers.mat_headers import describe_object
from rtctl.measured.readers.stated.attributes import (
    LONGEST_TEXT,
    Packing,
    packing_of,
    readable_attributes,
    stated_decimation,
    stated_unit,
    text_of,
    texts_of,
    unapplied,
    unpack,
)
from rtctl.measured.readers.stated.beside import MOST_NUMBERS, levels_of, plain
from rtctl.measured.readers.stated.rate import stated_period
from rtctl.measured.readers.stated.start import stated_start
from rtctl.measured.readers.table import Column, Header, Table, reading, vector_rows

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_USER_BLOCKS = (0, 512, 1024, 2048)  # MATLAB puts its own header in front (HDF5 specification, II.A)
_NO_NUMBERS = frozenset({"char", "cell", "struct", "function_handle"})
"""Classes of MATLAB variables that hold no numbers."""
MOST_BESIDE = 256
"""Datasets of a text or of few numbers that are looked at for what they state of others."""
MOST_ITEMS = 64
"""Items of a MATLAB cell or array of structs whose arrays are columns."""
_OBJECT_MARK = 0xDD000000
"""First of the numbers by which MATLAB 7.3 stands a variable for an object that it keeps elsewhere in the file."""


def is_hdf5(path: Path) -> bool:
    """Return whether the file carries HDF5's signature."""
    with path.open("rb") as file:
        for offset in _USER_BLOCKS:
            file.seek(offset)
            if file.read(len(_SIGNATURE)) == _SIGNATURE:
                return True
    return False


def read(path: Path, separator: str = "/") -> Table:
    """Return the datasets of an HDF5 file as columns, groups joined by `separator`. Raises ValueError in words."""
    if not is_hdf5(path):
        raise ValueError("not an HDF5 file")
    h5py = _h5py()
    found = _Contents(path, separator)
    with reading("an HDF5 file"), h5py.File(path, "r") as file:
        found.visit("", file)
        file.visititems(found.visit)

    def load(name: str, first: int, end: int) -> Column:
        from rtctl.measured.readers.hdf5_storage.presence import unwritten_rows

        with reading("an HDF5 file"), h5py.File(path, "r") as file:
            place, field = found.paths[name]
            dataset = file[place]
            absent = unwritten_rows(dataset, first, end)
            stored = None if absent else read_rows(dataset, vector_rows(dataset.shape, first, end), field)
        if stored is None and absent is not None:
            raise ValueError(
                f'column "{name}" was never written in rows {absent[0]} to {absent[1] - 1} (HDF5 gives its fill value '
                "for them); leave them out: write each stretch into a file of its own, or in the manifest's record "
                f"rows = [{first}, {absent[0]}]"
            )
        return unpack(np.asarray(stored), found.packings[name])

    places = {name: place_of(name, separator) for name in found.headers}
    for group, level in levels_of(found.few, {name: place_of(name, separator) for name in found.few}).items():
        found.beside.setdefault(group, {}).update(level)
    return Table(columns=found.headers, load=load, places=places, texts=found.texts, beside=found.beside)


class _Contents:
    """What is gathered of a file, object by object."""

    def __init__(self, path: Path, separator: str) -> None:
        self._folder, self._separator = path.parent, separator
        self.headers: dict[str, Header] = {}
        self.paths: dict[str, tuple[str, str]] = {}
        """Path of each column's dataset, and the field that it is; "": the whole dataset."""
        self.packings: dict[str, Packing] = {}
        self.texts: dict[str, str] = {}
        self.beside: dict[str, dict[str, Any]] = {}
        self.few: dict[str, Any] = {}

    def visit(self, name: str, item: Any) -> None:
        """Keep what a group or a dataset is and states; `name` is its path, "": of the file."""
        column = name.replace("/", self._separator)
        self.texts.update(texts_of(readable_attributes(item), name))
        if not hasattr(item, "dtype"):
            self.beside[column] = _plain(readable_attributes(item))
            if not name.startswith("#"):
                self._keep_links(item)
            return
        if len(self.few) < MOST_BESIDE and (value := _few(item)) is not None:
            self.few[column] = value
        if name.startswith("#"):  # MATLAB's cells and objects, by reference
            return
        self._keep(column, item)
        if self._separator == "." and _are_references(item.dtype) and item.size <= MOST_ITEMS:
            for one, target in _referred(item, column):
                self._keep(one, target)

    def _keep_links(self, group: Any) -> None:
        from rtctl.measured.readers.hdf5_storage.links import links_of

        for link in links_of(group):
            column = link.name.replace("/", self._separator)
            if link.target is None:
                self.headers[column] = Header(shape=(0,), refusal=link.refusal)
            else:
                self._keep(column, link.target)
                if column in self.headers:  # no compound dataset, whose columns are its fields
                    alias_of = link.leads_to.replace("/", self._separator)
                    self.headers[column] = self.headers[column]._replace(alias_of=alias_of)

    def _keep(self, column: str, item: Any) -> None:
        fields = field_names(item.dtype) if item.shape else ()
        columns = [(f"{column}{self._separator}{one}", one) for one in fields] or [(column, "")]
        if fields:
            self.beside[column] = _plain(common_attributes(readable_attributes(item), len(fields)))
        for one, field in columns:
            self.paths[one] = str(item.name), field
            self.headers[one], self.packings[one] = _header(item, one, self._folder, field)


def _few(item: Any) -> Any:
    """Return what a dataset of a text or of few numbers holds; None of others."""
    kind = text_of(readable_attributes(item).get("MATLAB_class"))
    if item.shape is None or _are_references(item.dtype) or "MATLAB_empty" in item.attrs:
        return None
    if item.size > (LONGEST_TEXT if kind == "char" else MOST_NUMBERS) or item.is_virtual:
        return None
    try:
        value = np.asarray(item[()])
    except (OSError, TypeError, ValueError):
        return None
    if kind == "char":
        return "".join(chr(code) for code in value.T.reshape(-1)) if value.dtype.kind == "u" else None
    unit = stated_unit(readable_attributes(item))
    return f"{value.item():.17g} {unit}" if unit and value.size == 1 and value.dtype.kind in "iuf" else value


def _plain(attributes: Mapping[str, Any]) -> dict[str, Any]:
    return {key: kept for key, value in attributes.items() if (kept := plain(value)) is not None}


def _referred(item: Any, column: str) -> Iterator[tuple[str, Any]]:
    """Yield name and dataset of what MATLAB keeps by reference: items of a cell, a field of an array of structs."""
    cell = text_of(readable_attributes(item).get("MATLAB_class")) == "cell"
    parent, _, field = column.rpartition(".")
    for k, reference in enumerate(np.asarray(item[()]).reshape(-1)):
        target = item.file[reference] if reference else None
        one = f"{column}{{{k + 1}}}" if cell else f"{parent}({k + 1}).{field}"
        if hasattr(target, "dtype"):
            yield one, target
        elif target is not None:  # a struct in a cell
            yield from ((f"{one}.{key}", field) for key, field in target.items() if hasattr(field, "dtype"))


def _header(dataset: Any, name: str, folder: Path, field: str = "") -> tuple[Header, Packing]:
    """Return the header of a dataset or of one of its fields, and how its numbers are packed."""
    from rtctl.measured.readers.hdf5_storage.origins import own_fill_value, source_attributes
    from rtctl.measured.readers.hdf5_storage.presence import absence

    attributes = readable_attributes(dataset)
    if dataset.shape is None or "MATLAB_empty" in attributes:
        return Header(shape=(0,)), Packing()
    kind, levels = dataset.dtype, list(_levels(dataset))
    if field:
        names = field_names(kind)
        kind = kind[field]
        attributes = field_attributes(attributes, names.index(field), len(names))
        levels[0] = attributes
    refusal = _refusal(dataset, attributes, name) or field_refusal(kind) or absence(dataset, folder)
    packing = Packing()
    if not refusal and not attributes.keys() & {"MATLAB_class"}:
        try:
            attributes = {**source_attributes(dataset, folder), **attributes}
            packing = packing_of(attributes)
        except ValueError as error:
            refusal = str(error)
        if not field and (fill := own_fill_value(dataset)) is not None:
            packing = packing._replace(missing=(*packing.missing, fill))
    dtype = np.dtype(np.float64) if packing.changes_numbers and kind.kind in "biuf" else type_of(kind)
    period_s, key = stated_period(*levels) or (None, "")
    start_s, start_key = stated_start(attributes) or (None, "")
    header = Header(
        shape=dataset.shape,
        dtype=dtype,
        unit=stated_unit(attributes),
        refusal=refusal,
        unapplied=unapplied(attributes),
        decimation=stated_decimation(attributes),
        period_s=period_s,
        period_key=key,
        start_s=start_s,
        start_key=start_key,
    )
    return header, packing


def _levels(dataset: Any) -> Iterator[Mapping[str, Any]]:
    """Yield the attributes of a dataset and of the groups around it, the innermost first."""
    yield readable_attributes(dataset)
    group = dataset.parent
    while group is not None:
        yield readable_attributes(group)
        group = None if group.name in ("/", None) else group.parent


def _refusal(dataset: Any, attributes: Mapping[str, Any], name: str) -> str:
    kind = text_of(attributes.get("MATLAB_class"))
    if "MATLAB_object_decode" in attributes or _is_object_mark(dataset, kind):
        return describe_object(kind, name)
    if kind in _NO_NUMBERS:
        return f"is a MATLAB {kind}, numbers are needed"
    if _are_references(dataset.dtype):
        return "refers to other arrays of the file, which are columns of their own"
    return ""


def _are_references(dtype: np.dtype[Any]) -> bool:
    """Return whether a type of HDF5 is that of references."""
    return dtype.hasobject and "ref" in (dtype.metadata or {})


def _is_object_mark(dataset: Any, kind: str) -> bool:
    """Return whether a MATLAB variable is six numbers that stand for an object, also where its class is not said."""
    if dataset.dtype != np.uint32 or not 4 <= dataset.size <= 64 or (kind and kind.startswith("uint")):
        return False
    return bool(np.asarray(dataset[()]).reshape(-1)[0] == _OBJECT_MARK)


def _h5py() -> ModuleType:
    try:
        return importlib.import_module("h5py")
    except ImportError:
        raise ValueError(
            "is an HDF5 file (MATLAB 7.3 also is): "
            f"{missing_message('h5py', 'reading it')}, or save as Parquet, .npz or MATLAB version 5 (save -v7)"
        ) from None
