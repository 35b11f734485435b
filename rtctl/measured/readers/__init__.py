"""Readers of measured files, one module a format; a new format is one module and one line here."""

from __future__ import annotations

import importlib
from pathlib import Path

from rtctl.border.errors import InputError, nearest
from rtctl.extras import require
from rtctl.measured.readers.limits import limited
from rtctl.measured.readers.table import Header, Table
from rtctl.measured.readers.whole_file.beside import with_beside
from rtctl.measured.readers.whole_file.clock_ticks import with_clock
from rtctl.measured.readers.whole_file.matrices import with_matrix_columns
from rtctl.measured.readers.whole_file.real_parts import with_real_parts
from rtctl.measured.readers.whole_file.signatures import contradiction
from rtctl.measured.readers.whole_file.split_instants import with_joined_instants
from rtctl.measured.readers.whole_file.waveforms import with_waveforms

__all__ = ["READERS", "Header", "Table", "open_table"]

READERS = {
    ".csv": "csv",
    ".csv.gz": "csv",
    ".txt": "csv",
    ".dat": "csv",
    ".tsv": "csv",
    ".asc": "csv",
    ".lvm": "csv",
    ".parquet": "parquet",
    ".arrow": "arrow",
    ".feather": "arrow",
    ".npz": "npz",
    ".mat": "mat",
    ".h5": "h5",
    ".hdf5": "h5",
    ".tdms": "tdms",
    ".mf4": "mdf",
    ".mdf": "mdf",
    ".uff": "uff58",
    ".unv": "uff58",
}
NEEDS = {".mf4": "asammdf", ".mdf": "asammdf", ".tdms": "nptdms", ".uff": "pyuff", ".unv": "pyuff"}
"""Optional dependency of a reader by suffix; h5py is asked for where a file turns out to be HDF5."""

LIMITED = frozenset({"mat", "h5", "mdf"})
"""Readers whose libraries crash on damaged files, or never end with them: they run in a process of their own."""


def suffix_of(path: Path) -> str:
    """Return the suffix in lower case, with the one before it where the file is packed: `.csv.gz`."""
    suffix = path.suffix.lower()
    return Path(path.stem).suffix.lower() + suffix if suffix == ".gz" else suffix


def open_table(path: Path) -> Table:
    """Return the columns of a file by its suffix. Raises ValueError in words."""
    suffix = suffix_of(path)
    if suffix not in READERS:
        known = ", ".join(sorted(READERS))
        raise ValueError(f'no reader for the suffix "{suffix}"; known: {known}; convert the file')
    if path.is_dir():
        raise ValueError("is a folder, a file is needed")
    if not path.is_file():
        raise ValueError(_about_missing(path))
    try:
        size = path.stat().st_size
        with path.open("rb"):
            pass
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror}") from None
    if size == 0:
        raise ValueError("the file is empty (0 bytes); copy or export it again")
    if READERS[suffix] == "csv" and (why := contradiction(path, suffix)):
        raise ValueError(why)
    if suffix in NEEDS:
        try:
            require(NEEDS[suffix], f"reading {suffix}")
        except InputError as missing:
            raise ValueError(str(missing)) from None
    module = f"{__name__}.{READERS[suffix]}"
    table: Table
    if READERS[suffix] in LIMITED:
        table = limited.read(module, path)
    else:
        table = importlib.import_module(module).read(path)
    if suffix not in (".uff", ".unv"):  # whose complex numbers are frequency responses
        table = with_real_parts(table)
    table = with_matrix_columns(with_clock(with_waveforms(table)), matlab=suffix == ".mat")
    return with_joined_instants(with_beside(table))


def _about_missing(path: Path) -> str:
    """Return why a path is no file that can be opened."""
    if path.is_symlink() and not path.exists():
        return f"is a symbolic link to {path.readlink()}, which leads to no file; correct the link, or name the file"
    if path.exists():  # and is no folder
        return (
            "is a pipe, a socket or a device, a file is needed: write what comes out of it into a file, such as "
            f"new_{path.name}, and name that"
        )
    siblings = [other.name for other in path.parent.glob("*") if suffix_of(other) in READERS]
    return f"no such file in {path.parent}{nearest(path.name, siblings)}"
