"""Comparison of a model with a dataset: each record is simulated from its first sample and scored.

No measured output is fed into the simulation. `error = simulated - measured`; a record's first `ignore_first` samples
are not scored. Records are read one after the other and simulated on as many threads as the machine has cores, so
memory holds that many and the worst one.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError, nearest
from rtctl.border.simulation import Simulation
from rtctl.measured.dataset import Dataset, Record
from rtctl.measured.repeats import noise_floors
from rtctl.measured.stimulus import make_stimulus
from rtctl.measured.stored import StoredDataset
from rtctl.models.kinds import model_kind
from rtctl.recording import write_parquet
from rtctl.registry import plant_kinds
from rtctl.session.validation.free_run_growth import measure_growth
from rtctl.wiring_models import build_simulation, read_model

ASKED_FROM = 0.05
"""Error in parts of the variation from which it is asked whether the free run can be predicted at all: an error of
less says that it was."""


class OutputScore(NamedTuple):
    """Errors of one output over the scored samples, in its unit; infinite where the simulation diverged."""

    rms_error: float
    rms_signal: float
    max_error: float
    max_signal: float
    integrator_error: float
    """RMS change of the simulation with half the step, divided by `rms_error`."""
    rms_variation: float
    """RMS of the signal about its mean; of a sweep, whose samples are amplitudes, about zero."""

    @property
    def share(self) -> float:
        """RMS error divided by the variation; NaN where nothing varies."""
        return self.rms_error / self.rms_variation if self.rms_variation > 0.0 else math.nan

    @property
    def nrmse(self) -> float:
        """RMS error divided by the RMS signal; NaN without a signal."""
        return self.rms_error / self.rms_signal if self.rms_signal > 0.0 else math.nan


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ComparedRecord:
    """A record and its simulation by the model."""

    record: Record
    simulated: Mapping[str, FloatArray]
    """Each measured output as simulated, (n,), in the dataset's unit; NaN from where the simulation diverged."""
    scores: Mapping[str, OutputScore]
    """Errors of each measured output."""
    diverged_at_s: float | None
    """Time since the first sample [s] at which the simulation diverged; None: it did not."""
    growth: float = 0.0
    """How far a small difference of the start grows; 0 where the errors are so small that it was not asked."""

    @property
    def badness(self) -> float:
        """The largest error of an output in parts of its variation; infinite where the simulation diverged."""
        if self.diverged_at_s is not None:
            return math.inf
        return max(
            (score.share for score in self.scores.values() if not math.isnan(score.share)), default=0.0
        )


class DatasetComparison(NamedTuple):
    """The scores of all records of a dataset."""

    summary: dict[str, Any]
    """Content of `summary.json`."""
    worst: ComparedRecord
    """The record with the largest error in parts of its variation."""
    records: Mapping[str, ComparedRecord]
    """Every record by its name, in the dataset's order; empty unless they were to be kept."""

    @property
    def diverged(self) -> list[tuple[str, float]]:
        """Names of the records that diverged, and the time since the first sample [s] at which they did."""
        return [
            (row["record"], row["diverged_at_s"])
            for row in self.summary["records"]
            if row["diverged_at_s"] is not None
        ]


def simulation_for(path: Path, dataset: Dataset | StoredDataset) -> Simulation:
    """Return the model of the file `path` in the dataset's units. Raises InputError where the two do not fit."""
    kind = model_kind(path)
    check_kind(kind, dataset, str(path))
    return simulation_of(kind, read_model(path, kind), dataset, str(path))


def check_kind(kind: str, dataset: Dataset | StoredDataset, source: str) -> None:
    """Raise InputError where a model of this kind, from the file `source`, does not fit the dataset."""
    simulated = [name for name, one in plant_kinds().items() if one.model is not None]
    if kind in simulated and dataset.plant != kind:
        raise InputError(
            f"{source} is a model of {_named(kind)}, {dataset.path} holds data of {_named(dataset.plant)}"
        )
    if kind != dataset.plant:
        raise InputError(
            f'{source}: key "model.kind" is {kind!r}, the data are of a "{dataset.plant}"{nearest(kind, simulated)}'
        )


def simulation_of(kind: str, model: Any, dataset: Dataset | StoredDataset, source: str) -> Simulation:
    """Return a model in the dataset's units. Raises InputError where the two do not fit.

    Args:
        kind: Kind of plant of the model.
        model: The model, as its kind's reader returns it.
        dataset: The data that it is to be compared with.
        source: The model's file, for messages.
    """
    try:
        return build_simulation(model, dataset.units, source, kind)
    except InputError as error:
        if "not compatible" not in str(error):
            raise
        units = ", ".join(f"{name} in {unit}" for name, unit in dataset.units.items())
        raise InputError(f"{error}\n(the data in {dataset.path} have {units})") from None


def _named(kind: str) -> str:
    return f'a{"n" if kind[0] in "aeiou" else ""} "{kind}"'


def compare_dataset(
    simulation: Simulation,
    dataset: StoredDataset,
    folder: Path | None,
    stop_requested: Callable[[], bool],
    advance: Callable[[int], None],
    *,
    source: str,
) -> DatasetComparison:
    """Simulate and score every record.

    Args:
        simulation: The model, bound to the dataset's units.
        dataset: The records.
        folder: Where each prediction is written as `<record>.parquet`; None: all are kept in memory instead.
        stop_requested: Asked several times a second; True ends the comparison.
        advance: Takes the number of records that are done.
        source: The model's file, for messages.

    Raises:
        KeyboardInterrupt: A stop was requested.
        InputError: No sensible step resolves the model; the message names `source`.
    """
    reading = threading.Lock()  # one file at a time: readers share a cache
    worst: list[ComparedRecord] = []
    kept: dict[str, ComparedRecord] = {}

    def compare(k: int) -> dict[str, Any]:
        with reading:
            record = dataset.read(k)
        try:
            compared = compare_record(simulation, record, dataset.holds)
        except ValueError as error:
            raise InputError(f"{source}: on record {record.name}: {error}") from None
        if folder is not None:
            write_prediction(folder, compared, dataset.units, dataset.holds)
        with reading:
            worst[:] = [max([*worst, compared], key=lambda one: one.badness)]
            if folder is None:
                kept[record.name] = compared
        return _summary_row(compared, dataset.units)

    rows = list(_on_all_cores(compare, len(dataset), stop_requested, advance))
    _add_noise_floors(rows, dataset)
    in_order = {head.name: kept[head.name] for head in dataset.heads if head.name in kept}
    return DatasetComparison({"records": rows, "worst": worst[0].record.name}, worst[0], in_order)


def compare_record(simulation: Simulation, record: Record, holds: Mapping[str, str]) -> ComparedRecord:
    """Simulate and score one record. Raises ValueError where no sensible step resolves the model."""
    stimulus = make_stimulus(record, holds)
    values = np.array([parameter.value for parameter in simulation.parameters])
    prediction = simulation.predict(stimulus, values)
    finer = simulation.predict(stimulus, values, refine=2)
    measured = [name for name in simulation.outputs if record.has(name)]
    simulated = {name: prediction.outputs[name][0] for name in measured}
    diverged = int(prediction.diverged_at[0])
    scores = {name: _score(record, name, simulated[name], finer.outputs[name][0]) for name in measured}
    asked = diverged < 0 and not record.is_sweep and any(one.share > ASKED_FROM for one in scores.values())
    course = prediction.outputs[simulation.outputs[0]][0]
    return ComparedRecord(
        record=record,
        simulated=simulated,
        scores=scores,
        diverged_at_s=None if diverged < 0 else diverged * record.period_s,
        growth=measure_growth(simulation, stimulus, values, course) if asked else 0.0,
    )


def _score(record: Record, name: str, simulated: FloatArray, finer: FloatArray) -> OutputScore:
    measured = record.signals[name]
    signal, error = measured[record.ignore_first :], (simulated - measured)[record.ignore_first :]
    size, largest = _rms(signal), float(np.abs(signal).max())
    variation = size if record.is_sweep else float(np.std(signal))
    if not np.isfinite(error).all():
        return OutputScore(math.inf, size, math.inf, largest, math.nan, variation)
    rms_error, change = _rms(error), _rms((finer - simulated)[record.ignore_first :])
    share = change / rms_error if rms_error > 0.0 else math.nan
    return OutputScore(rms_error, size, float(np.abs(error).max()), largest, share, variation)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _summary_row(compared: ComparedRecord, units: Mapping[str, str]) -> dict[str, Any]:
    record = compared.record
    outputs = {
        name: {"unit": units[name], "nrmse": score.nrmse, **score._asdict()}
        for name, score in compared.scores.items()
    }
    return {
        "file": record.file, "use": record.use, "outputs": outputs, "record": record.name,
        "samples": record.samples, "ignore_first": record.ignore_first,
        "sample_rate_hz": None if record.is_sweep else 1.0 / record.period_s,
        "diverged_at_s": compared.diverged_at_s, "growth": compared.growth, "conditions": dict(record.conditions),
    }  # fmt: skip


def _add_noise_floors(rows: list[dict[str, Any]], dataset: StoredDataset) -> None:
    """Add the noise floor from repeats beside each record's error; None where its input was not repeated."""
    floors = noise_floors(dataset)
    for row, head in zip(rows, dataset.heads, strict=True):
        for name, score in row["outputs"].items():
            score["noise_floor"] = floors.get(head.repeat or "", {}).get(name)


def write_prediction(
    folder: Path, compared: ComparedRecord, signal_units: Mapping[str, str], inputs: Iterable[str]
) -> None:
    """Write `folder/<record>.parquet`: time, inputs, and measured, simulated and error of each output.

    Columns of outputs after the first one begin with the output's name.
    """
    record = compared.record
    if record.is_sweep:
        _write_sweep(folder, compared, signal_units)
        return
    inputs = tuple(inputs)
    table: dict[str, FloatArray] = {"time": record.period_s * np.arange(record.samples, dtype=np.float64)}
    units = {"time": "s", **{name: signal_units[name] for name in inputs}}
    table |= {name: record.signals[name] for name in inputs}
    for index, (name, simulated) in enumerate(compared.simulated.items()):
        measured = record.signals[name]
        columns = {"measured": measured, "simulated": simulated, "error": simulated - measured}
        for what, values in columns.items():
            column = what if index == 0 else f"{name}_{what}"
            table[column], units[column] = values, signal_units[name]
    metadata = {"record": record.name, "file": record.file, "use": record.use}
    write_parquet(folder / f"{record.name}.parquet", table, units, metadata, "simulate")


def _write_sweep(folder: Path, compared: ComparedRecord, signal_units: Mapping[str, str]) -> None:
    """Write `folder/<record>.parquet` of a sweep: frequency, drive, and the two parts of each complex amplitude."""
    record = compared.record
    table = {"frequency": record.frequencies_hz, "drive": record.signals["drive"][::2]}
    units = {"frequency": "Hz", "drive": signal_units["drive"]}
    for name, simulated in compared.simulated.items():
        measured = record.signals[name]
        for what, values in (
            ("measured", measured),
            ("simulated", simulated),
            ("error", simulated - measured),
        ):
            for part, first in (("in_phase", 0), ("quadrature", 1)):
                table[f"{what}_{part}"], units[f"{what}_{part}"] = values[first::2], signal_units[name]
    metadata = {"record": record.name, "file": record.file, "use": record.use}
    write_parquet(folder / f"{record.name}.parquet", table, units, metadata, "simulate")


def _on_all_cores(
    work: Callable[[int], dict[str, Any]],
    count: int,
    stop_requested: Callable[[], bool],
    advance: Callable[[int], None],
) -> Iterator[dict[str, Any]]:
    """Return `work(k)` of every k, in order.

    Raises:
        Exception: What the first k that fails raises.
        KeyboardInterrupt: A stop was requested.
    """
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        futures = [pool.submit(work, k) for k in range(count)]
        pending: set[Future[dict[str, Any]]] = set(futures)
        try:
            while pending:
                done, pending = wait(pending, timeout=0.2, return_when=FIRST_COMPLETED)
                if any(future.exception() for future in done):
                    for future in futures:  # begun in order: those before it end, and may fail too
                        future.result()
                advance(count - len(pending))
                if stop_requested():
                    raise KeyboardInterrupt
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
    return iter([future.result() for future in futures])
