"""`dataset.toml` as checked tables: what was measured, in which columns of which files, in which units."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, model_validator

from rtctl.border.errors import InputError, nearest
from rtctl.border.quantities import Checked, check, read_toml
from rtctl.measured.plant_kinds import PLANT_KINDS, signal_findings

Role = Literal["input", "output"]
Hold = Literal["linear", "zero", "band-limited"]
Use = Literal["identify", "fit", "test"]
Row = Annotated[int, Field(ge=0)]


def _one_of(*choices: str) -> BeforeValidator:
    def chosen(raw: Any) -> Any:
        if raw not in choices:
            raise ValueError(f"{raw!r} is not one of {', '.join(choices)}{nearest(str(raw), choices)}")
        return raw

    return BeforeValidator(chosen)


class DatasetTable(Checked):
    """[dataset]"""

    name: Annotated[str, Field(min_length=1)]
    plant: Annotated[str, _one_of(*PLANT_KINDS)]
    identity: str = ""
    """Which device answered, where the wire told."""
    description: str = ""
    conditions: dict[str, Any] = Field(default_factory=dict)
    """Of every record, unless the record says otherwise."""


class SignalTable(Checked):
    """[signals.<name>]"""

    role: Annotated[Role, _one_of(*get_args(Role))]
    unit: str
    column: str | None = None
    hold: Annotated[Hold, _one_of(*get_args(Hold))] | None = None

    @model_validator(mode="after")
    def _hold_of_an_input(self) -> SignalTable:
        if self.hold is not None and self.role == "output":
            raise ValueError(f'hold = "{self.hold}" is for inputs only; remove it')
        return self


class RecordTable(Checked):
    """[[records]]"""

    file: Annotated[str, Field(min_length=1)]
    name: Annotated[str, Field(pattern=r"^[^/\\]+$")] | None = None
    """Default: the file's name without its suffix, made unique by the rows."""
    sample_rate_hz: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = None
    time: str | None = None
    resample: bool = False
    rows: tuple[Row, Row] | None = None
    """First row and the one after the last, counted from 0."""
    ignore_first: Annotated[int, Field(ge=0)] = 0
    use: Annotated[Use, _one_of(*get_args(Use))] = "fit"
    repeat: str | None = None
    conditions: dict[str, Any] = Field(default_factory=dict)
    initial: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _one_time_base(self) -> RecordTable:
        rate = self.sample_rate_hz
        if rate is None and self.time is None:
            raise ValueError("no sample rate: add sample_rate_hz = <Hz>, or time = <column in seconds>")
        if rate is not None and self.time is not None:
            raise ValueError(
                f'sample_rate_hz = {rate:g} and time = "{self.time}" exclude each other; keep one'
            )
        if self.resample and self.time is None:
            raise ValueError("resample = true needs a time column; name it with time, or remove resample")
        if self.rows is not None and not self.rows[0] < self.rows[1]:
            raise ValueError(f"rows = {list(self.rows)} selects nothing; the first must be below the second")
        return self

    @property
    def first_row(self) -> int:
        """Row of the file at which the record begins."""
        return self.rows[0] if self.rows else 0


class Manifest(Checked):
    """A whole `dataset.toml`."""

    dataset: DatasetTable
    signals: dict[str, SignalTable] = Field(default_factory=dict)
    records: tuple[RecordTable, ...] = ()


def read_manifest(path: Path) -> Manifest:
    """The checked manifest. Raises InputError with every finding, one a line."""
    tables = read_toml(path)
    findings = [f"{path}: {text}" for text in _against_plant(tables)]
    try:
        manifest = check(Manifest, tables, str(path))
    except InputError as error:
        raise InputError("\n".join([*str(error).splitlines(), *findings])) from None
    if findings:
        raise InputError("\n".join(findings))
    return manifest


def _against_plant(tables: dict[str, Any]) -> list[str]:
    """Findings across tables, on the raw tables: so that they come together with those inside a table."""
    found = []
    if not tables.get("records"):
        found.append("no records: add [[records]] with file and sample_rate_hz for each measured file")
    heading, signals = tables.get("dataset"), tables.get("signals", {})
    plant = heading.get("plant") if isinstance(heading, dict) else None
    if isinstance(plant, str) and plant in PLANT_KINDS and isinstance(signals, dict):
        found += signal_findings(plant, signals)
    return found
