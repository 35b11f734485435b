"""Tables of `dataset.toml`: what was measured, in which columns of which files, in which units."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, model_validator

from rtctl.border.errors import InputError, nearest
from rtctl.border.file_kinds import check_file_kind
from rtctl.border.units.quantities import Checked, check, read_toml
from rtctl.measured.manifest.signal_kinds import measured_kinds, signal_findings
from rtctl.measured.stated_unit import stated_amplitude
from rtctl.measured.units import check_unit, count_s

Role = Literal["input", "output"]
NO_PHASE = ": an amplitude without its phase tells neither part; export the phase as a column beside it"
Hold = Literal["linear", "zero", "band-limited"]
Use = Literal["identify", "fit", "test"]


def _one_of(*choices: str) -> BeforeValidator:
    return BeforeValidator(lambda raw: _chosen(raw, choices))


def _chosen(raw: Any, choices: tuple[str, ...]) -> Any:
    if raw not in choices:
        meant = nearest(str(raw), choices, listed=True)
        raise ValueError(f"{raw!r} is not one of {', '.join(choices)}{meant}")
    return raw


def _measured_plant(raw: Any) -> Any:
    return _chosen(raw, tuple(measured_kinds()))


def _rate_hz(raw: Any) -> float:
    is_number = isinstance(raw, int | float) and not isinstance(raw, bool)
    if not is_number or not 0.0 < raw < math.inf:
        raise ValueError(f"{raw!r} is not a rate; write a number of Hz above 0, such as 1000.0")
    return float(raw)


def _finite(raw: Any) -> float:
    if not isinstance(raw, int | float) or isinstance(raw, bool) or not math.isfinite(raw):
        raise ValueError(f"{raw!r} is not a finite number")
    return float(raw)


def _scale(raw: Any) -> float:
    if _finite(raw) == 0.0:
        raise ValueError(
            "0 leaves nothing of the signal; write the unit that one count is, such as 0.0003052"
        )
    return float(raw)


def _time_unit(raw: Any) -> str:
    count_s(_unit(raw))
    return str(raw)


def _frequency_unit(raw: Any) -> str:
    check_unit(_unit(raw), "Hz")
    return str(raw)


def _amplitude_unit(raw: Any) -> str:
    found = stated_amplitude(_unit(raw))
    if found is None:
        check_unit(raw)
    elif not found.unit:
        raise ValueError(f'"{raw}" does not say what 0 dB is; write it like "dB re 1 um"')
    return str(raw)


def _amplitude(raw: Any) -> float:
    if not _finite(raw) > 0.0:
        raise ValueError(f"{raw!r} is no amplitude; write a number above 0 in the drive's unit")
    return float(raw)


def _count(raw: Any) -> int:
    if not isinstance(raw, int) or isinstance(raw, bool) or raw < 0:
        raise ValueError(f"{raw!r} is not a whole number from 0 on; samples are counted from 0")
    return raw


def _rows(raw: Any) -> tuple[int, int]:
    if not isinstance(raw, list) or len(raw) != 2:
        raise ValueError(f"{raw!r} is not [first, end], the first row and the one after the last, from 0")
    first, end = (_count(row) for row in raw)
    if not first < end:
        raise ValueError(f"[{first}, {end}] selects nothing; the first must be below the second")
    return first, end


def _text(raw: Any) -> str:
    if not isinstance(raw, str) or not raw.strip():
        raise ValueError(f"{raw!r} is not a text; write one in quotes")
    return raw


def _unit(raw: Any) -> str:
    if not isinstance(raw, str) or not raw.strip():
        raise ValueError(f'{raw!r} is not a unit; write one in quotes ("dimensionless" for a plain number)')
    return raw


def _file_name(raw: Any) -> str:
    if not isinstance(raw, str) or not raw or {"/", "\\"} & set(raw):
        raise ValueError(
            f"{raw!r} is not a name without / and \\, as results are written to files of that name"
        )
    return raw


def _table(raw: Any) -> dict[str, Any]:
    if not isinstance(raw, dict):
        raise ValueError(f"{raw!r} is not a table; write {{ name = value }}")
    return raw


Text = Annotated[str, BeforeValidator(_text)]
Count = Annotated[int, BeforeValidator(_count)]
Table = Annotated[dict[str, Any], BeforeValidator(_table)]


class DatasetTable(Checked):
    """Table [dataset]."""

    name: Text
    plant: Annotated[str, BeforeValidator(_measured_plant)]
    identity: str = ""
    """Identity of the device that answered, where the wire reported it."""
    description: str = ""
    incomplete: str = ""
    """Why records are missing that were to be taken; "": none is."""
    conditions: Table = Field(default_factory=dict)
    """Conditions of every record, unless the record has its own."""


class SignalTable(Checked):
    """Table [signals.<name>]."""

    role: Annotated[Role, _one_of(*get_args(Role))]
    unit: Annotated[str, BeforeValidator(_unit)]
    column: Text | None = None
    hold: Annotated[Hold, _one_of(*get_args(Hold))] | None = None
    scale: Annotated[float, BeforeValidator(_scale)] | None = None
    """Scale [unit per count]: the signal is scale times what the column holds, plus offset."""
    offset: Annotated[float, BeforeValidator(_finite)] | None = None
    """Offset [unit]."""
    constant: Annotated[float, BeforeValidator(_finite)] | None = None
    """Of an input that no column has: its value [unit] throughout, 0 in a release."""
    in_phase: Text | None = None
    """Of a sweep: column of the part in phase with the drive, Re of displacement over drive."""
    quadrature: Text | None = None
    """Of a sweep: column of the part that leads the drive by a quarter of a period, Im."""
    amplitude: Text | None = None
    """Of a sweep: column of the amplitude; `phase` is the other one."""
    phase: Text | None = None
    """Of a sweep: column of the phase against the drive."""
    amplitude_unit: Annotated[str, BeforeValidator(_amplitude_unit)] | None = None
    """Of a sweep: what the numbers of amplitudes are: "um rms", "V pp", "dB re 1 um"; default: what the file states."""
    phase_unit: Annotated[Literal["deg", "rad"], _one_of("deg", "rad")] | None = None
    phase_sign: Annotated[Literal["lead", "lag"], _one_of("lead", "lag")] = "lead"
    """Which of the two a positive phase or quadrature means: a driven resonator lags."""
    per_drive: bool = False
    """Of a frequency response function: the columns hold the signal for a drive amplitude of 1."""

    @property
    def counts(self) -> bool:
        """Return whether the column holds counts, not numbers in the unit."""
        return self.scale is not None or self.offset is not None

    @model_validator(mode="after")
    def _hold_of_an_input(self) -> SignalTable:
        if self.hold is not None and self.role == "output":
            raise ValueError(f'hold = "{self.hold}" is for inputs only; remove it')
        return self

    @model_validator(mode="after")
    def _without_column(self) -> SignalTable:
        if self.constant is None:
            return self
        if self.role == "output":
            raise ValueError(f"constant = {self.constant:g} is for inputs only; remove it")
        others = ("column", "scale", "offset", "hold", "amplitude_unit")
        given = next((one for one in others if getattr(self, one) is not None), None)
        if given is not None:
            raise ValueError(f"constant = {self.constant:g} and {given} exclude each other; keep one")
        return self

    @property
    def parts(self) -> tuple[str, ...]:
        """Return the columns of a complex amplitude: in phase and quadrature, or amplitude and phase; () without."""
        named = (self.in_phase, self.quadrature, self.amplitude, self.phase)
        return tuple(one for one in named if one is not None)

    @model_validator(mode="after")
    def _two_parts(self) -> SignalTable:
        cartesian, polar = (self.in_phase, self.quadrature), (self.amplitude, self.phase)
        if not self.parts:
            of_drive = self.role == "input" or self.amplitude_unit is None
            if self.phase_unit is not None or self.phase_sign != "lead" or self.per_drive or not of_drive:
                raise ValueError(
                    "amplitude_unit, phase_unit, phase_sign and per_drive are of a sweep; name its columns in_phase "
                    "and quadrature, or amplitude and phase"
                )
            return self
        if self.role == "input":
            raise ValueError(
                "in_phase, quadrature, amplitude and phase are of outputs: the drive has phase 0"
            )
        if len(self.parts) != 2 or (None in cartesian and None in polar):
            raise ValueError(
                "a sweep needs two columns, in_phase and quadrature, or amplitude and phase; got "
                + " and ".join(f'"{one}"' for one in self.parts)
                + (NO_PHASE if self.parts == (self.amplitude,) else "")
            )
        if self.phase is not None and self.phase_unit is None:
            raise ValueError(f'the phase "{self.phase}" needs its unit: phase_unit = "deg" or "rad"')
        if self.offset is not None:
            raise ValueError("offset is of a signal in time; remove it")
        return self


class RecordTable(Checked):
    """Table [[records]]."""

    file: Text
    name: Annotated[str, BeforeValidator(_file_name)] | None = None
    """Name; default: the file's name without its suffix, made unique by the group and the rows."""
    group: Text | None = None
    """Group of the file that has the columns, whose names are those within it: "run_001", "rec(2)"."""
    sample_rate_hz: Annotated[float, BeforeValidator(_rate_hz)] | None = None
    time: Text | None = None
    time_unit: Annotated[str, BeforeValidator(_time_unit)] | None = None
    """Unit of the time column; default: what the file states, else seconds."""
    frequency: Text | None = None
    """Column of the frequencies of a sweep, in place of a time base."""
    frequency_unit: Annotated[str, BeforeValidator(_frequency_unit)] | None = None
    """Unit of the frequency column; default: what the file states, else Hz."""
    drive_amplitude: Annotated[float, BeforeValidator(_amplitude)] | None = None
    """Amplitude of the drive of a sweep, in the drive's unit, where no column has it."""
    resample: bool = False
    rows: Annotated[tuple[int, int], BeforeValidator(_rows)] | None = None
    """First row and the one after the last, counted from 0."""
    ignore_first: Count = 0
    use: Annotated[Use, _one_of(*get_args(Use))] = "fit"
    repeat: Text | None = None
    conditions: Table = Field(default_factory=dict)
    initial: Table = Field(default_factory=dict)

    @model_validator(mode="after")
    def _one_time_base(self) -> RecordTable:
        rate = self.sample_rate_hz
        if rate is not None and self.time is not None:
            raise ValueError(
                f'sample_rate_hz = {rate:g} and time = "{self.time}" exclude each other; keep one'
            )
        if self.frequency is not None and (rate is not None or self.time is not None or self.ignore_first):
            raise ValueError(
                f'frequency = "{self.frequency}" makes it a sweep, whose rows are steady states: remove '
                "sample_rate_hz, time and ignore_first"
            )
        if self.frequency is None and (self.frequency_unit is not None or self.drive_amplitude is not None):
            raise ValueError(
                "frequency_unit and drive_amplitude are of a sweep; name its column of frequencies with frequency"
            )
        if self.resample and self.time is None:
            raise ValueError("resample = true needs a time column; name it with time, or remove resample")
        if self.time_unit is not None and self.time is None:
            raise ValueError("time_unit is of a time column; name it with time, or remove time_unit")
        return self

    @property
    def first_row(self) -> int:
        """Row of the file at which the record starts."""
        return self.rows[0] if self.rows else 0


class Manifest(Checked):
    """A whole `dataset.toml`."""

    dataset: DatasetTable
    signals: dict[str, SignalTable] = Field(default_factory=dict)
    records: tuple[RecordTable, ...] = ()


def read_manifest(path: Path) -> Manifest:
    """Return the checked manifest. Raises InputError with every finding, one a line."""
    tables = read_toml(path)
    check_file_kind(tables, path, "dataset")
    findings = [f"{path}: {text}" for text in _against_plant(tables)]
    try:
        manifest = check(Manifest, tables, str(path))
    except InputError as error:
        raise InputError("\n".join([*str(error).splitlines(), *findings])) from None
    if findings:
        raise InputError("\n".join(findings))
    return manifest


def _against_plant(tables: dict[str, Any]) -> list[str]:
    """Return findings across tables, on the raw tables: so that they come together with those inside a table."""
    found = []
    if not tables.get("records"):
        found.append("no records: add [[records]] with file and sample_rate_hz for each measured file")
    found += _mixed(tables.get("records"))
    found += _amplitudes_in_time(tables)
    heading, signals = tables.get("dataset"), tables.get("signals", {})
    plant = heading.get("plant") if isinstance(heading, dict) else None
    if isinstance(plant, str) and plant in measured_kinds() and isinstance(signals, dict):
        found += signal_findings(plant, signals)
    if isinstance(signals, dict):
        found += _shared_columns(signals)
    return found


def _first_part(table: dict[str, Any]) -> Any:
    return table.get("in_phase", table.get("amplitude"))


def _mixed(records: Any) -> list[str]:
    """Return the finding that some records are sweeps and others are not."""
    tables = [one for one in records if isinstance(one, dict)] if isinstance(records, list) else []
    swept = ["frequency" in one for one in tables]
    if not any(swept) or all(swept):
        return []
    return [
        f"records.{swept.index(True)} is a sweep (frequency), records.{swept.index(False)} is in time: a dataset has "
        "one kind of records; write a second manifest for the sweeps, and identify or diagnose from each"
    ]


def _amplitudes_in_time(tables: dict[str, Any]) -> list[str]:
    """Return findings on signals that have a unit of amplitudes though the records are in time."""
    records, signals = tables.get("records"), tables.get("signals")
    if not isinstance(records, list) or not isinstance(signals, dict):
        return []
    if any("frequency" in one for one in records if isinstance(one, dict)):
        return []
    return [
        f'key "signals.{name}.amplitude_unit" is of sweeps of frequencies, and the records are in time; remove it'
        for name, one in signals.items()
        if isinstance(one, dict) and one.get("role") == "input" and "amplitude_unit" in one
    ]


def _shared_columns(signals: dict[str, Any]) -> list[str]:
    """Return findings on two signals of one column, a slip of copying."""
    columns: dict[str, str] = {}
    found = []
    for name, table in signals.items():
        if isinstance(table, dict) and "constant" in table:
            continue
        column = str(table.get("column", _first_part(table) or name)) if isinstance(table, dict) else name
        if column in columns:
            found.append(
                f'key "signals.{name}.column": "{columns[column]}" and "{name}" both read the column "{column}"; '
                "correct one"
            )
        columns.setdefault(column, name)
    return found
