"""First bytes by which a file tells what it is, where its name says otherwise."""

from __future__ import annotations

from pathlib import Path

SIGNATURES = (
    (b"\x89HDF\r\n\x1a\n", "an HDF5 file", ".h5"),
    (b"PAR1", "a Parquet file", ".parquet"),
    (b"ARROW1", "an Arrow file", ".arrow"),
    (b"TDSm", "a TDMS file", ".tdms"),
    (b"MATLAB 5.0", "a MATLAB file", ".mat"),
    (b"MATLAB 7.3", "a MATLAB file", ".mat"),
    (b"MDF ", "a measurement data file (MDF)", ".mf4"),
    (b"UnFinMF ", "a measurement data file (MDF) that was not finished", ""),
    (b"PK\x03\x04", "a packed file, such as a spreadsheet (.xlsx), or .npz", ""),
    (b"\xd0\xcf\x11\xe0", "a spreadsheet or document of Microsoft Office (.xls)", ""),
    (b"%PDF", "a PDF", ""),
    (b"CDF\x01", "a NetCDF 3 file", ""),
    (b"CDF\x02", "a NetCDF 3 file", ""),
    (b"\x93NUMPY", "a single NumPy array (.npy)", ""),
    (b"<!DOCTYPE", "a web page", ""),
    (b"<html", "a web page", ""),
    (b"SQLite format 3", "a SQLite database", ""),
)  # fmt: skip
"""First bytes, what the file is, and the suffix under which it is read; "": it is not."""


def contradiction(path: Path, suffix: str) -> str:
    """Return why a file is not what its `suffix` says, and what to do; "": nothing speaks against it."""
    with path.open("rb") as file:
        head = file.read(32)
    for first, what, known in SIGNATURES:
        if head.startswith(first):
            remedy = f"rename it to {known}" if known else "save it as CSV, Parquet or HDF5"
            return f"is {what} by its first bytes, and not what {suffix} says; {remedy}"
    return ""
