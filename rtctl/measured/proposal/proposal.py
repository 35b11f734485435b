"""What is proposed for a manifest: every guess with its reason, and what must be asked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from rtctl.border.errors import InputError
from rtctl.registry import PlantKind

NO_SIGNAL = "no signal of this kind of plant or model"
"""Why a column is not used."""


class Open(NamedTuple):
    """Something that no file tells and that must not be guessed."""

    key: str
    """What is missing, for the dialogue: "drive", "unit.drive", "response", "time", "time_unit", "sample_rate_hz"."""
    text: str
    """What is not known, a sentence."""
    option: str
    """The option that settles it."""
    example: str = ""
    """The option with a column of the file; "": `option` is one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelSignals:
    """What a model file says of a dataset for it."""

    path: Path
    plant: str
    """Kind of plant of the model."""
    inputs: Mapping[str, str] = field(default_factory=dict)
    """Unit of each input, by name; empty of kinds whose signals have fixed names."""
    outputs: Mapping[str, str] = field(default_factory=dict)
    """Unit of each output, by name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answers:
    """What the user says of the files, in the words of the command line; None: nothing was said."""

    plant: str | None = None
    model: ModelSignals | None = None
    """The model that the dataset is for; it names the signals of equations."""
    inputs: tuple[str, ...] = ()
    """Texts `[NAME=]COLUMN[:UNIT]`."""
    outputs: tuple[str, ...] = ()
    """Texts `NAME=COLUMN[:UNIT]`; `NAME=-`: there is none."""
    scales: tuple[str, ...] = ()
    """Texts `NAME=NUMBER UNIT` of transducers."""
    time: str | None = None
    """Text `COLUMN[:UNIT]`; "-": none of the columns is the time."""
    sample_rate_hz: float | None = None
    drive_amplitude: str | None = None
    """Amplitude of the drive of sweeps, such as "20 mV rms"."""
    hold: str | None = None
    test: str | None = None
    """Records that no fit uses: the name of a file or of a group in it, "last-third" or "none"."""
    name: str | None = None

    def as_options(self) -> list[tuple[str, str]]:
        """Return what was said as options of a command line, each with its word."""
        single = {
            "--plant": self.plant, "--model": None if self.model is None else str(self.model.path),
            "--time": self.time, "--hold": self.hold, "--test": self.test, "--name": self.name,
            "--drive-amplitude": self.drive_amplitude,
            "--sample-rate": None if self.sample_rate_hz is None else f"{self.sample_rate_hz:.12g}",
        }  # fmt: skip
        several = {"--input": self.inputs, "--output": self.outputs, "--scale": self.scales}
        return [
            *((key, value) for key, value in single.items() if value is not None),
            *((key, one) for key, texts in several.items() for one in texts),
        ]

    def __post_init__(self) -> None:
        rate = self.sample_rate_hz
        if self.model is not None and self.plant not in (None, self.model.plant):
            raise InputError(
                f'--plant {self.plant} and --model {self.model.path}, a model of kind "{self.model.plant}", contradict '
                "each other; leave out --plant"
            )
        if rate is not None and not 0.0 < rate < float("inf"):
            raise InputError(f"--sample-rate {rate:g}: must be above 0 Hz and finite")
        if rate is not None and self.time not in (None, "-"):
            raise InputError(
                f"--sample-rate {rate:g} and --time {self.time} exclude each other; keep one (--time - passes over "
                "all time columns)"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalGuess:
    """One table [signals.<name>]."""

    name: str
    role: str
    column: str
    why: str
    unit: str = ""
    """Unit of the column as pint reads it; "": it must be asked."""
    unit_source: str = ""
    amplitude_unit: str = ""
    """Of a sweep: what the numbers of the column are, such as "um rms"; "": peak values in `unit`."""
    scale: float | None = None
    """Scale [unit per number of the column]; None: 1."""
    constant: float | None = None
    """Value of an input that no column has, 0 in a release; its column is then "-"."""
    hold: str | None = None
    hold_why: str = ""
    certain: bool = False
    """Whether the user said so."""
    keys: tuple[tuple[str, str | bool], ...] = ()
    """Keys in place of `column`, of the response of a sweep: its two columns and how they are meant."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeGuess:
    """What tells the instants of the samples."""

    column: str | None = None
    unit: str | None = None
    """Unit of the time column; None: dates."""
    rate_hz: float | None = None
    """Rate to be written; None: of the column, or of the files."""
    stated_hz: float | None = None
    """Rate that the files state."""
    why: str = ""
    resample: bool = False
    is_frequency: bool = False
    """Whether the column has the frequencies of a sweep."""
    rounded: str = ""
    """Why the records have the rate of their stamps in the place of the column; "": they have the column."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordGuess:
    """One table [[records]]."""

    file: Path
    group: str | None = None
    """Group of the file that it is."""
    title: str = ""
    """Texts that the group has beside its numbers."""
    use: str
    why: str
    rows: tuple[int, int] | None = None
    ignore_first: int = 0
    drive_amplitude: float | None = None
    """Of a sweep: peak value of its drive, in the drive's unit, where no column has it."""
    drive_why: str = ""
    rate_hz: float | None = None
    """Rate of this file, by a variable or by its stamps."""
    name: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """A whole manifest, as far as it is known."""

    name: str
    plant: str
    plant_why: str
    kind: PlantKind
    """The kind of plant with the signals that a manifest may have."""
    model: Path | None = None
    """The model that the dataset is for, where one was named."""
    signals: tuple[SignalGuess, ...]
    time: TimeGuess
    records: tuple[RecordGuess, ...]
    unused: Mapping[str, str] = field(default_factory=dict)
    """Columns that no signal uses, each with the reason."""
    opens: tuple[Open, ...] = ()
    unsure: tuple[str, ...] = ()
    """What was guessed and should be looked at."""

    def labels(self, use: str | None = None) -> tuple[str, ...]:
        """Return the names of what can be a test, groups or files; those of one use where it is given."""
        told = [one.group or one.file.name for one in self.records if use in (None, one.use)]
        return tuple(dict.fromkeys(told))

    def signal(self, name: str) -> SignalGuess | None:
        """Return a signal by its name; None: it is not there."""
        return next((one for one in self.signals if one.name == name), None)
