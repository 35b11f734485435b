"""A table of an instrument: the commands that it understands and the fields of its answer, from a TOML file.

A meter, which only reads, needs `read`; a source needs the commands that drive it as well. `{value}` stands for a
number in A or V.
"""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, Field, model_validator

from rtctl.border.errors import InputError, nearest
from rtctl.border.units.quantities import Checked, Quantity, check, read_toml

FOLDER = Path(__file__).parent / "tables"
PLACE = "{value}"
NEEDED = ("compliance_voltage", "current_range", "current", "output_on", "output_off", "output_state")
"""Commands without which an instrument cannot be driven as a source."""

FieldName = Literal["voltage", "current", "resistance", "status", "unused"]


def _one_line(text: str) -> str:
    if not text.strip() or not text.isascii() or not text.isprintable():
        raise ValueError(f"a command is one line of printable ASCII, got {text!r}")
    return text


def _with_place(text: str) -> str:
    if text.count(PLACE) != 1 or "{" in text.replace(PLACE, "") or "}" in text.replace(PLACE, ""):
        raise ValueError(f"must have {PLACE} once, where the number goes, got {text!r}")
    return text


Command = Annotated[str, AfterValidator(_one_line)]
Setting = Annotated[str, AfterValidator(_one_line), AfterValidator(_with_place)]


class Commands(Checked):
    """[commands]: what is sent for each purpose."""

    identify: Command = "*IDN?"
    setup: tuple[Command, ...] = ()
    """Sent once after the identity, in order; the output is off then."""
    compliance_voltage: Setting | None = None
    current_range: Setting | None = None
    voltage_range: Setting | None = None
    nplc: Setting | None = None
    current: Setting | None = None
    read: Command
    separator: str = ";"
    """Between two commands of one message; TSP: a blank."""
    output_on: Command | None = None
    output_off: Command | None = None
    output_state: Command | None = None
    """Answered with 0 while the output is off."""
    next_error: Command | None = None
    """Answered with the oldest entry of the error queue; its number is 0 if there is none."""


class Answer(Checked):
    """[answer]: what `commands.read` is answered with, separated by commas or tabs."""

    fields: Annotated[tuple[FieldName, ...], Field(min_length=1)]
    compliance_bits: Annotated[int, Field(ge=0)] = 0
    """Bits of `status` that say that the voltage is limited, so that the current is less than was commanded."""
    current_tolerance: Annotated[float, Field(gt=0.0)] = 0.01
    """How far a `current` of the answer may be from the commanded one, as a share of the current range."""

    @model_validator(mode="after")
    def _says_enough(self) -> Answer:
        if not {"voltage", "resistance", "current"} & set(self.fields):
            raise ValueError("fields names no reading: voltage, current or resistance is needed")
        named = [name for name in self.fields if name != "unused"]
        if len(set(named)) < len(named):
            raise ValueError(f"fields names one twice: {', '.join(named)}")
        if self.compliance_bits and "status" not in self.fields:
            raise ValueError("compliance_bits needs status among the fields")
        return self


class Heading(Checked):
    """[instrument]: which instruments the table is for, and what they can do."""

    name: str
    identity: str
    """Pattern of the answer to `commands.identify`, with * and ?, upper or lower case."""
    largest_current_A: Annotated[float | None, Quantity("A"), Field(alias="largest_current", gt=0.0)] = None
    largest_voltage_V: Annotated[float | None, Quantity("V"), Field(alias="largest_voltage", gt=0.0)] = None
    nplc: tuple[float, float] | None = None
    """Least and largest integration time in power line cycles."""


class SourceCommands(NamedTuple):
    """The commands of `[commands]` by which a source is driven."""

    current: str
    output_on: str
    output_off: str
    output_state: str
    read: str
    separator: str


class InstrumentTable(Checked):
    """A whole table."""

    instrument: Heading
    commands: Commands
    answer: Answer

    def fits(self, identity: str) -> bool:
        """Return whether an instrument with this identity is one of the table's."""
        return fnmatchcase(identity.upper(), self.instrument.identity.upper())

    def source_commands(self) -> SourceCommands:
        """Return the commands of a source. Raises InputError where the table has not all of them."""
        for name in NEEDED:
            if getattr(self.commands, name) is None:
                raise InputError(f"{self.instrument.name}: as a source its table needs commands.{name}")
        return SourceCommands(*(getattr(self.commands, name) for name in SourceCommands._fields))


def bundled_tables() -> dict[str, Path]:
    """Return the files of all tables that come with the program, by name."""
    return {path.stem: path for path in sorted(FOLDER.glob("*.toml"))}


def load_table(name: str, folder: Path) -> InstrumentTable:
    """Return a table by path (as given, or beside `folder`) or by the name of a bundled one. Raises InputError."""
    for candidate in (Path(name), folder / name):
        if candidate.is_file():
            return check(InstrumentTable, read_toml(candidate), str(candidate))
    known = bundled_tables()
    if name not in known:
        what = "no such file" if Path(name).suffix else f"no bundled table{nearest(name, known)}"
        raise InputError(f'driver.table = "{name}": {what}')
    return check(InstrumentTable, read_toml(known[name]), str(known[name]))
