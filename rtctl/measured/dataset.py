"""Measured data in memory, the same for every file format and plant.

Time alignment: row k holds the input applied from t_k to t_{k+1} (hold "zero"; else the input's value
at t_k) and the outputs measured at t_k, that is before this row's input takes effect.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rtctl.border.arrays import ComplexArray, FloatArray
from rtctl.border.errors import InputError, nearest
from rtctl.output.dataframes import data_frame, stacked
from rtctl.output.notebook import html_table, number

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

FREQUENCY = "frequency"
"""Input of a sweep: the frequency of each row's sine [Hz]; records in time have none."""
SWEEP_PERIOD_S = 0.5
"""Sample period of a sweep, which has none: its rows count as one a second, each of two samples."""


class Signal(NamedTuple):
    """One measured quantity of a dataset."""

    role: str
    """Role: "input" | "output"."""
    unit: str
    hold: str | None
    """Hold between samples; None for outputs."""


def paired(samples: FloatArray) -> ComplexArray:
    """Return the complex numbers (n,) of 2 n samples, Re and Im one after the other."""
    return samples[::2] + 1j * samples[1::2]


def signals_of(units: Mapping[str, str], holds: Mapping[str, str]) -> dict[str, Signal]:
    """Return signals by name; those with a hold are inputs."""
    return {
        name: Signal("input" if name in holds else "output", unit, holds.get(name))
        for name, unit in units.items()
    }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Record:
    """One uninterrupted measurement on a uniform time base, or a sweep of frequencies.

    Of a sweep of n rows each signal has 2 n samples, two for each row: of a response the part in phase with the drive,
    then the part that leads it (Re and Im of its complex amplitude), of drive and frequency the same number twice.
    """

    name: str
    """Name, unique in its dataset and fit to be a file's name."""
    period_s: float
    signals: Mapping[str, FloatArray]
    """Samples (n,) by name of the signal, in the dataset's `units[name]`."""
    use: str = "fit"
    """Use: "identify" | "fit" | "test"."""
    file: str = ""
    """Name of its file in the manifest."""
    group: str | None = None
    """Group of the file that has its columns; None: the file itself."""
    ignore_first: int = 0
    """Samples that prepare the state and are not scored."""
    repeat: str | None = None
    """Letter of a group of records that repeat one input."""
    conditions: Mapping[str, Any] = field(default_factory=dict)
    initial: Mapping[str, float] = field(default_factory=dict)
    """State at the first sample where it is not at rest, in the signals' units."""
    after_jumps: frozenset[str] | None = None
    """Outputs that are read just after an input jumps at their row; None: this record's readings tell."""

    def __post_init__(self) -> None:
        if not self.period_s > 0.0:
            raise InputError(f"record {self.name}: period_s must be > 0 s, got {self.period_s!r}")
        lengths = {name: values.shape for name, values in self.signals.items()}
        if len(set(lengths.values())) != 1 or any(len(shape) != 1 for shape in lengths.values()):
            raise InputError(f"record {self.name}: signals must be 1-D and of one length, got {lengths}")
        if not 0 <= self.ignore_first < self.samples:
            raise InputError(
                f"record {self.name}: ignore_first = {self.ignore_first} leaves nothing "
                f"of {self.samples} samples"
            )

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(next(iter(self.signals.values())))

    @property
    def time_s(self) -> FloatArray:
        """Time (n,) of each sample since the first one [s]. Raises InputError of a sweep, which has frequencies."""
        if self.is_sweep:
            raise InputError(f"record {self.name}: a sweep has no times; see its frequencies_hz")
        times: FloatArray = self.period_s * np.arange(self.samples, dtype=np.float64)
        return times

    @property
    def is_sweep(self) -> bool:
        """Whether it is a sweep of frequencies."""
        return FREQUENCY in self.signals

    @property
    def frequencies_hz(self) -> FloatArray:
        """Frequencies (n,) of the rows of a sweep."""
        return self.signals[FREQUENCY][::2]

    def complex_amplitudes(self, name: str) -> ComplexArray:
        """Return the complex amplitudes (n,) of a response of a sweep: Re in phase with the drive, Im leads it."""
        return paired(self.signals[name])

    def to_dataframe(self, units: Mapping[str, str] | None = None) -> pd.DataFrame:
        """Return the signals as a pandas table, a row a sample, at `time_s`.

        Of a sweep a row a frequency, at `frequency_hz`: responses as complex amplitudes.

        Args:
            units: Unit of each signal, kept in `attrs["units"]`; `Dataset.to_dataframe` gives those of the dataset.

        Raises:
            InputError: pandas is not installed (`pip install 'rtctl[pandas]'`).
        """
        if not self.is_sweep:
            return data_frame(self.signals, self.time_s, "time_s", units, "Record.to_dataframe")
        rows = {name: self.complex_amplitudes(name) for name in self.signals if name != FREQUENCY}
        columns = {name: one.real if (one.real == one.imag).all() else one for name, one in rows.items()}
        return data_frame(columns, self.frequencies_hz, "frequency_hz", units, "Record.to_dataframe")

    def has(self, name: str) -> bool:
        """Return whether the signal was measured in this record."""
        return name in self.signals

    def __repr__(self) -> str:
        names = ", ".join(self.signals)
        if self.is_sweep:
            rows = (
                f"{self.samples // 2} rows from {self.frequencies_hz[0]:g} to {self.frequencies_hz[-1]:g} Hz"
            )
            return f"<Record {self.name} ({self.use}): sweep of {rows}, {names}>"
        return f"<Record {self.name} ({self.use}): {self.samples} samples at {1.0 / self.period_s:g} Hz of {names}>"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dataset:
    """All records of one manifest."""

    path: Path
    """Path of the manifest."""
    name: str
    plant: str
    """Kind of plant: "oscillator" | "vo2"."""
    identity: str = ""
    """Identity of the device that answered, where the wire reported it."""
    units: Mapping[str, str]
    """Unit of each signal in the records.

    mA, ohm, um of a vo2; an oscillator's are the manifest's own (velocity: displacement's per second).
    """
    holds: Mapping[str, str]
    """Hold of each input between its samples: "linear" | "zero" | "band-limited"."""
    records: tuple[Record, ...]
    incomplete: str = ""
    """Why records are missing that were to be taken; "": none is."""
    remarks: tuple[str, ...] = ()
    """What a user must know of files that could be read: units that are not understood, rows that are left out."""

    @property
    def signals(self) -> dict[str, Signal]:
        """Every signal with its role, unit and hold, in the manifest's order."""
        return signals_of(self.units, self.holds)

    @property
    def is_acquired(self) -> bool:
        """Whether rtctl acquire recorded it, through a driver that it can use again, and no file was given."""
        return bool(self.identity)

    @property
    def has_sweeps(self) -> bool:
        """Whether its records are sweeps of frequencies; they all are, or none is."""
        return FREQUENCY in self.holds

    def used_for(self, use: str) -> tuple[Record, ...]:
        """Return the records of one use, in order."""
        return tuple(record for record in self.records if record.use == use)

    def record(self, name: str) -> Record:
        """Return the record of a name. Raises InputError with the nearest name where there is none."""
        by_name = {one.name: one for one in self.records}
        if name not in by_name:
            raise InputError(f'{self.name}: no record "{name}"{nearest(str(name), by_name)}')
        return by_name[name]

    def plot(self, record: str | None = None) -> Figure:
        """Return the figure of a first look: of every signal the beginning, the whole and its spectrum, with units.

        Args:
            record: Name of the only record to draw; None: all of them.

        Raises:
            InputError: There is no such record, or matplotlib is not installed (`pip install 'rtctl[plots]'`).
        """
        shown = self if record is None else replace(self, records=(self.record(record),))
        # by name, since figures are drawn of datasets, which must not know them
        figure: Figure = importlib.import_module("rtctl.api.first_look.preview").preview(shown).plot()
        return figure

    def to_dataframe(self, record: str | None = None) -> pd.DataFrame:
        """Return a record's signals as a pandas table, with their units in `attrs["units"]`.

        Args:
            record: Name of the record; None: all of them, one below the other, the record's name first in the index.

        Raises:
            InputError: There is no such record, or pandas is not installed (`pip install 'rtctl[pandas]'`).
        """
        if record is not None:
            return self.record(record).to_dataframe(self.units)
        return stacked({one.name: one.to_dataframe(self.units) for one in self.records}, "record")

    def __repr__(self) -> str:
        return (
            f"<Dataset {self.name} ({self.plant}): {len(self.records)} records, {self._signals_in_words()}>"
        )

    def _repr_html_(self) -> str:
        rows = [
            [
                one.name,
                one.use,
                str(one.samples),
                number(1.0 / one.period_s, "Hz"),
                number(one.samples * one.period_s, "s"),
            ]
            for one in self.records
        ]  # fmt: skip
        headers = ["record", "use", "samples", "sample rate", "duration"]
        return html_table(f"{self.name} ({self.plant})", headers, rows, [self._signals_in_words()])

    def _signals_in_words(self) -> str:
        return ", ".join(f"{name} [{unit}]" for name, unit in self.units.items())
