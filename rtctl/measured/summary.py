"""Summary of what was read of a dataset: signals with their columns, units and values; records with rate and length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.measured.clipping import find_cut_off
from rtctl.measured.columns.conversion import TableCache
from rtctl.measured.dataset import Dataset, Record
from rtctl.measured.manifest.schema import Manifest, read_manifest

FEW_SAMPLES = 8.0
"""Samples in a period of the strongest line below which its motion is hardly sampled."""
LONGEST_SPECTRUM, FEWEST_SAMPLES = 1 << 18, 32
FEWEST_PERIODS = 4
"""Periods in a record below which a line is a trend."""
STANDS_OUT, EXCITED, FEW_BINS = 4.0, 0.01, 12
"""Height of a line over the median of what is excited; share of the largest that counts as excited; bins of a tone."""
WIDTH, RISES = 2, 2.0
"""Bins of a line in the averaged spectrum; height of a line over what is below it in frequency."""
CLIPPED_RUN = 12
"""Equal readings at an extreme, in a row, from which a signal that moves is probably clipped."""
SIGNAL_HEADERS = (
    "signal",
    "role",
    "column",
    "unit",
    "unit from",
    "first",
    "last",
    "least",
    "largest",
    "spectrum largest at",
)
RECORD_HEADERS = ("record", "use", "file", "rows", "from row", "rate", "duration", "gaps or sweep")


class Source(NamedTuple):
    """Where a signal comes from."""

    column: str
    unit_from: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalSummary:
    """One signal over all records; values in `unit`."""

    name: str
    role: str
    column: str
    unit: str
    """Unit in which it is held."""
    unit_from: str
    """Who states the unit of the column."""
    first: float
    last: float
    least: float
    largest: float
    strongest_hz: float | None
    """Frequency of the line that stands out in the longest record; None: none does."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordSummary:
    """One record."""

    name: str
    use: str
    file: str
    group: str | None = None
    """Group of the file; None: the file itself."""
    rows: int
    first_row: int
    """Row of the file at which it begins."""
    ignore_first: int
    rate_hz: float | None
    """Sample rate; None of a sweep of frequencies."""
    duration_s: float | None
    """Duration; None of a sweep."""
    gaps: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """What was read of a dataset."""

    name: str
    plant: str
    signals: tuple[SignalSummary, ...]
    records: tuple[RecordSummary, ...]
    notes: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the summary as plain tables."""
        return asdict(self)


def summarise(dataset: Dataset, sources: Mapping[str, Source] | None = None) -> Summary:
    """Return the summary of a dataset; `sources` by signal, else they are looked up in its manifest and files."""
    manifest = _manifest(dataset)
    known = sources or ({} if manifest is None else _sources(dataset, manifest))
    longest = max(dataset.records, key=lambda one: one.samples)
    signals = tuple(
        _signal(dataset, name, known.get(name, Source("", "")), longest) for name in dataset.units
    )
    tables = () if manifest is None else manifest.records
    matched = tables if len(tables) == len(dataset.records) else (None,) * len(dataset.records)
    records = tuple(
        RecordSummary(
            name=one.name, use=one.use, file=one.file, group=one.group,
            rows=one.samples // 2 if one.is_sweep else one.samples,
            first_row=table.first_row if table else 0, ignore_first=one.ignore_first,
            rate_hz=None if one.is_sweep else 1.0 / one.period_s,
            duration_s=None if one.is_sweep else one.samples * one.period_s,
            gaps=_course(one) if one.is_sweep else "resampled" if table and table.resample else "none in it",
        )
        for one, table in zip(dataset.records, matched, strict=True)
    )  # fmt: skip
    return Summary(
        name=dataset.name, plant=dataset.plant, signals=signals, records=records,
        notes=(*dataset.remarks, *_notes(dataset, signals, longest)),
    )  # fmt: skip


def signal_rows(summary: Summary) -> list[list[str]]:
    """Return the table of signals, columns as in `SIGNAL_HEADERS`."""
    return [
        [one.name, one.role, one.column or "–", one.unit, one.unit_from or "–",
         *(f"{value:.5g}" for value in (one.first, one.last, one.least, one.largest)),
         "–" if one.strongest_hz is None else f"{one.strongest_hz:.4g} Hz"]
        for one in summary.signals
    ]  # fmt: skip


def record_rows(summary: Summary) -> list[list[str]]:
    """Return the table of records, columns as in `RECORD_HEADERS`."""
    return [
        [one.name, one.use + (f", from sample {one.ignore_first}" if one.ignore_first else ""),
         (one.file or "–") + (f": {one.group}" if one.group else ""),
         str(one.rows), str(one.first_row),
         *("–" if value is None else f"{value:.6g} {unit}"
           for value, unit in ((one.rate_hz, "Hz"), (one.duration_s, "s"))), one.gaps]
        for one in summary.records
    ]  # fmt: skip


def strongest_hz(values: FloatArray, period_s: float) -> float | None:
    """Return the frequency [Hz] of the line that stands out of the spectrum of `values` (n,); None: none does.

    The line stands `STANDS_OUT` times above the usual height of what is excited, and above what lies below its own
    frequency (a staircase or a trend falls from the lowest frequency on), or next to nothing else is.
    """
    shown = values[:LONGEST_SPECTRUM]
    if len(shown) < FEWEST_SAMPLES or not np.ptp(shown) > 0.0:
        return None
    length = min(len(shown) // 4, 1 << 14)
    window = np.hanning(length)
    parts = [shown[k : k + length] for k in range(0, len(shown) - length + 1, length // 2)]
    rough = np.sqrt(
        np.mean([np.abs(np.fft.rfft((part - part.mean()) * window)) ** 2 for part in parts], axis=0)
    )[1:]
    excited = rough[rough > EXCITED * rough.max()]
    if len(excited) >= FEW_BINS and (
        rough.max() < STANDS_OUT * np.median(excited) or _only_falls(rough, int(rough.argmax()))
    ):
        return None
    fine = np.abs(np.fft.rfft((shown - shown.mean()) * np.hanning(len(shown))))
    fine[0] = 0.0
    place = int(fine.argmax())
    return place / (len(shown) * period_s) if place >= FEWEST_PERIODS else None


def _only_falls(rough: FloatArray, place: int) -> bool:
    """Return whether a spectrum (bins,) does not rise to its largest bin at `place` from the frequencies below it."""
    below = rough[: place - WIDTH + 1] if place >= WIDTH else rough[:0]
    return not len(below) or float(rough[place]) < RISES * float(np.median(below))


def _manifest(dataset: Dataset) -> Manifest | None:
    try:
        return read_manifest(dataset.path)
    except InputError:  # a dataset that was made in Python
        return None


def _sources(dataset: Dataset, manifest: Manifest) -> dict[str, Source]:
    """Return column and origin of the unit of each signal, by the first file that has it."""
    cache = TableCache()
    found = {}
    for name, table in manifest.signals.items():
        if table.constant is not None:
            found[name] = Source("none: constant", "manifest")
            continue
        column = table.parts[0] if table.parts else table.column or name
        stated = None
        for record in manifest.records:
            path = dataset.path.parent / record.file
            try:
                stated = cache.stated_unit(path, cache.named(path, record.group, column))
                break
            except ValueError:  # an instrument that was not there
                continue
        scaled = ", scaled from counts" if table.counts else ""
        told = f'manifest; file: "{stated}"' if stated else "manifest"
        found[name] = Source(column, told + scaled)
    return found


def _signal(dataset: Dataset, name: str, source: Source, longest: Record) -> SignalSummary:
    parts = [_values(record, name, dataset) for record in dataset.records if record.has(name)]
    shown = next(one for one in (longest, *dataset.records) if one.has(name))
    return SignalSummary(
        name=name, role=dataset.signals[name].role, column=source.column, unit=dataset.units[name],
        unit_from=source.unit_from, first=float(parts[0][0]), last=float(parts[-1][-1]),
        least=float(min(part.min() for part in parts)), largest=float(max(part.max() for part in parts)),
        strongest_hz=None if shown.is_sweep else strongest_hz(shown.signals[name], shown.period_s),
    )  # fmt: skip


def _values(record: Record, name: str, dataset: Dataset) -> FloatArray:
    """Return the numbers of a signal that a person reads: of a sweep one a row, the amplitude of a response."""
    if not record.is_sweep:
        return record.signals[name]
    return record.signals[name][::2] if name in dataset.holds else np.abs(record.complex_amplitudes(name))


def _course(sweep: Record) -> str:
    """Return from where to where a sweep goes."""
    return f"sweep from {sweep.frequencies_hz[0]:.6g} to {sweep.frequencies_hz[-1]:.6g} Hz"


def _notes(dataset: Dataset, signals: Sequence[SignalSummary], longest: Record) -> list[str]:
    """Return what an expert would remark at first sight."""
    notes = []
    for one in signals:
        if one.least == one.largest:
            notes.append(f"{one.name} is {one.least + 0.0:.6g} {one.unit} throughout")
        elif one.strongest_hz is not None and one.role == "output":
            samples = 1.0 / (one.strongest_hz * longest.period_s)
            if samples < FEW_SAMPLES:
                notes.append(
                    f"{one.name}: its strongest line, {one.strongest_hz:.4g} Hz, has {samples:.3g} samples a period"
                )
    for record in () if dataset.has_sweeps else dataset.records:
        for name, values in record.signals.items():
            run = _longest_at_extreme(values)
            if name not in dataset.holds and run >= CLIPPED_RUN and run < 0.5 * len(values):
                notes.append(f"record {record.name}: {name} stays {run} samples at an extreme: clipped?")
    return notes


def _longest_at_extreme(values: FloatArray) -> int:
    """Return the longest run of samples that equal the least or the largest one, where a motion was cut off there."""
    return max(
        (_longest_run(one[a:b] == one.max()) for one in (values, -values) for a, b in find_cut_off(one)),
        default=0,
    )


def _longest_run(there: np.ndarray[Any, Any]) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], there.astype(np.int8), [0]])))
    return int((edges[1::2] - edges[::2]).max(initial=0))
