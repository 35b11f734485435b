"""What data files hold: every column with its numbers, and what the file says of it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.measured.columns.conversion import TableCache, numbers
from rtctl.measured.readers import READERS, suffix_of
from rtctl.measured.readers.groups import TOP, Place
from rtctl.measured.readers.stated.preamble import NOTHING, Preamble
from rtctl.measured.readers.table import Table

_SHOWN = 8
OTHER_RATES = (
    ". They were recorded at different rates: export them again with one time for all, or resample the faster "
    "ones to the rate of the slowest with a filter against aliasing (SciPy resample_poly, MATLAB resample)"
)
"""What to do with columns of different lengths, to end a message."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One column of one file."""

    name: str
    label: str = ""
    """Words that tell what it is, `naming.labels`; "": its name."""
    unit: str | None = None
    """Unit that the file states, in its own words."""
    period_s: float | None = None
    """Sample period [s] that the file states."""
    period_key: str = ""
    """Key under which the file states the period."""
    is_decimated: bool = False
    """Whether the file states beside the period that samples were left out."""
    start_s: float | None = None
    """Time [s] of its first sample that the file states, from an origin that its columns share."""
    start_key: str = ""
    """Key under which the file states it."""
    begun: tuple[int, ...] = ()
    """Rows with which the file states that a further acquisition begins."""
    alias_of: str = ""
    """Column whose numbers it has, under another name; "": they are its own."""
    place: Place = TOP
    """Place in the groups of the file."""
    raw: NDArray[Any] | None = None
    """Numbers, dates or text as the file holds them; None where it is no vector."""
    values: FloatArray | None = None
    """Numbers (n,); None where it has none."""
    refusal: str = ""
    """Why it has none, as a phrase that continues its name."""

    @property
    def rows(self) -> int:
        """Number of samples."""
        return 0 if self.raw is None else int(self.raw.size)

    @property
    def varies(self) -> bool:
        """Return whether its finite numbers are not all the same."""
        if self.values is None:
            return False
        finite = self.values[np.isfinite(self.values)]
        return len(finite) > 1 and bool(np.ptp(finite) > 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Survey:
    """One file."""

    path: Path
    columns: Mapping[str, Column]
    """Columns by their names in the file, or in the group."""
    remarks: tuple[str, ...] = ()
    preamble: Preamble = NOTHING
    """What a text file states of its sample rate above its columns."""
    texts: Mapping[str, str] = field(default_factory=dict)
    """What the file says in words, by where it stands."""
    group: str | None = None
    """Group that it is; None: the whole file."""
    rows: int = field(init=False)
    """Length of its longest column of numbers."""
    numeric: Mapping[str, Column] = field(init=False, repr=False, compare=False)
    """Columns of numbers as long as the longest one."""

    def __post_init__(self) -> None:
        """Look for the longest columns once: they are asked for with every column."""
        numbers_of = {name: one for name, one in self.columns.items() if one.values is not None}
        rows = max((one.rows for one in numbers_of.values()), default=0)
        object.__setattr__(self, "rows", rows)
        object.__setattr__(
            self, "numeric", {name: one for name, one in numbers_of.items() if one.rows == rows}
        )

    @property
    def label(self) -> str:
        """Name of what can be a test: of the group, else of the file."""
        return self.group or self.path.name


def survey_files(files: Sequence[Path]) -> tuple[Survey, ...]:
    """Read all columns of the files. Raises InputError with one line for each file that cannot be used."""
    if not files:
        raise InputError("no data file was given")
    found, wrong = [], []
    for k, path in enumerate(files):
        if os.path.realpath(path) in [
            os.path.realpath(other) for other in files[:k]
        ]:  # which takes a loop of links
            wrong.append(f"{path}: is given twice; name it once")
            continue
        try:
            found.append(_survey(path))
        except ValueError as error:
            wrong.append(f"{path}: {error}")
    if wrong:
        raise InputError("\n".join(wrong))
    return tuple(found)


def _survey(path: Path) -> Survey:
    if path.suffix.lower() == ".toml":
        raise ValueError(
            f"is a manifest or a model, data files are needed. A manifest needs no rtctl init: look at it with "
            f"rtctl preview {path}, or go on with rtctl identify"
        )
    if path.is_dir():
        raise ValueError(f"is a folder; name its data files{_files_in(path)}")
    cache = TableCache([path])
    table = cache.table(path)
    usable = [name for name, header in table.columns.items() if not header.refusal]
    together = table.load_together(usable) if table.load_together else {}
    columns = {name: _column(cache, path, name, together.get(name)) for name in table.columns}
    survey = Survey(
        path=path,
        columns=columns,
        remarks=table.remarks,
        preamble=table.preamble,
        texts=_texts(table, columns),
    )
    _check_usable(survey)
    return survey


def _texts(table: Table, columns: Mapping[str, Column]) -> dict[str, str]:
    """Return what a file says in words: beside its columns, and in those of a single text."""
    single = {
        f'the text "{name}"': str(one.raw.reshape(-1)[0])
        for name, one in columns.items()
        if one.raw is not None and one.rows == 1 and one.raw.dtype.kind in "OSU"
    }
    return {**table.texts, **single}


def _files_in(folder: Path) -> str:
    names = sorted(one.name for one in folder.iterdir() if one.is_file() and suffix_of(one) in READERS)
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return f": {', '.join(names[:_SHOWN])}{more}" if names else "; it holds none that can be read"


def _column(cache: TableCache, path: Path, name: str, read: NDArray[Any] | None) -> Column:
    """Return a column, whose rows are `read` where they are read already."""
    table = cache.table(path)
    header = table.columns[name]
    unit = cache.stated_unit(path, name) if header.unit else None
    bare = Column(
        name=name,
        unit=unit,
        period_s=header.period_s,
        period_key=header.period_key,
        is_decimated=bool(header.decimation),
        start_s=header.start_s,
        start_key=header.start_key,
        begun=header.begun,
        alias_of=header.alias_of,
        place=table.place(name),
    )
    try:
        raw = np.asarray(cache.raw(path, name) if read is None else read).reshape(-1)
    except ValueError as error:
        return replace(bare, refusal=_phrase(str(error), name))
    try:
        return replace(bare, raw=raw, values=numbers(raw, name))
    except ValueError as error:
        return replace(bare, raw=raw, refusal=_phrase(str(error), name))


def _phrase(message: str, name: str) -> str:
    return message.removeprefix(f'column "{name}" ')


def _check_usable(survey: Survey) -> None:
    """Raise ValueError where a file cannot give a drive and a response."""
    if not survey.columns:
        raise ValueError("has no columns")
    refusals = {one.refusal for one in survey.columns.values()}
    if len(refusals) == 1 and len(survey.columns) > 1 and "" not in refusals:
        only = refusals.pop()  # of the file as a whole: once
        every = f"each of its {len(survey.columns)} columns "
        raise ValueError(every + only if only.startswith(("was ", "is ", "has ", "holds ")) else only)
    numeric = survey.numeric
    starts = {one.start_s for one in survey.columns.values() if one.rows > 1 and one.values is not None}
    if len(starts - {None}) > 1:
        return  # columns that begin at different times may have different lengths
    if len(numeric) < 2 or survey.rows < 2:
        have = ", ".join(f'"{name}" ({_kind(one)})' for name, one in list(survey.columns.items())[:_SHOWN])
        raise ValueError(
            "a drive and a response are needed, two columns of numbers of one length; "
            f"the file has {have}{_remedy(survey)}"
        )


def _kind(column: Column) -> str:
    if column.values is None:
        return column.refusal
    return f"{column.rows} {'number' if column.rows == 1 else 'numbers'}"


def _remedy(survey: Survey) -> str:
    """Return what to do with columns of several rates or a matrix of all signals, the usual reasons; "" for others."""
    lengths = {one.rows for one in survey.columns.values() if one.values is not None and one.rows > 1}
    if len(lengths) > 1:
        return OTHER_RATES
    for name, column in survey.columns.items():
        if "one dimension is needed" in column.refusal:
            if survey.path.suffix.lower() == ".mat":
                parts = f"u = {name}(:,1); x = {name}(:,2); and so on"
                return f". Save the columns of the matrix apart, in MATLAB: {parts}"
            return f'. Save the columns of "{name}" apart, one array a signal'
    return ""
