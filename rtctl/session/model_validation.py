"""A model beside a dataset: each record simulated from its first sample, no measured output fed in, and scored.

`error = simulated - measured`; what is scored leaves out a record's `ignore_first`. Records are read one after the
other and simulated on as many threads as the machine has cores, so memory holds that many and the worst one.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError, nearest
from rtctl.border.simulation import Simulation
from rtctl.measured.dataset import Record
from rtctl.measured.repeats import noise_floors
from rtctl.measured.stimulus import make_stimulus
from rtctl.measured.stored import StoredDataset
from rtctl.models.kinds import model_kind
from rtctl.recording import write_parquet
from rtctl.registry import plant_kinds
from rtctl.wiring import build_simulation, read_model


class OutputScore(NamedTuple):
    """Of one output over the scored samples, in its unit; infinite where the simulation diverged."""

    rms_error: float
    rms_signal: float
    max_error: float
    max_signal: float
    integrator_error: float
    """RMS change of the simulation at half the step, in parts of `rms_error`."""

    @property
    def nrmse(self) -> float:
        """The error in parts of the signal; NaN without a signal."""
        return self.rms_error / self.rms_signal if self.rms_signal > 0.0 else math.nan


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ComparedRecord:
    """A record and what the model makes of it."""

    record: Record
    simulated: Mapping[str, FloatArray]
    """Of each measured output (n,), in the dataset's unit; NaN from where it diverged."""
    scores: Mapping[str, OutputScore]
    diverged_at_s: float | None
    """Since the first sample."""

    @property
    def badness(self) -> float:
        """What the worst record is the largest of."""
        if self.diverged_at_s is not None:
            return math.inf
        return max(
            (score.nrmse for score in self.scores.values() if not math.isnan(score.nrmse)), default=0.0
        )


class Comparison(NamedTuple):
    """Of a whole dataset."""

    summary: dict[str, Any]
    worst: ComparedRecord

    @property
    def diverged(self) -> list[tuple[str, float]]:
        """Names of records that diverged, and when [s]."""
        return [
            (row["record"], row["diverged_at_s"])
            for row in self.summary["records"]
            if row["diverged_at_s"] is not None
        ]


def simulation_for(path: Path, dataset: StoredDataset) -> Simulation:
    """Return the model of the file `path` in the dataset's units. Raises InputError where the two do not fit."""
    kind = model_kind(path)
    simulated = [name for name, one in plant_kinds().items() if one.model is not None]
    if kind in simulated and dataset.plant != kind:
        raise InputError(
            f"{path} is a model of {_named(kind)}, {dataset.path} holds data of {_named(dataset.plant)}"
        )
    if kind != dataset.plant:
        raise InputError(
            f'{path}: key "model.kind" is {kind!r}, the data are of a "{dataset.plant}"{nearest(kind, simulated)}'
        )
    try:
        return build_simulation(read_model(path, kind), dataset.units, str(path), kind)
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
    folder: Path,
    stop_requested: Callable[[], bool],
    advance: Callable[[int], None],
    *,
    source: str,
) -> Comparison:
    """Compare every record; writes `folder/<record>.parquet`.

    Raises KeyboardInterrupt where it is asked to stop, InputError that names `source`, the model's file, where no
    sensible step resolves it.
    """
    reading = threading.Lock()  # one file at a time: readers share a cache
    worst: list[ComparedRecord] = []

    def compare(k: int) -> dict[str, Any]:
        with reading:
            record = dataset.read(k)
        try:
            compared = compare_record(simulation, record, dataset.holds)
        except ValueError as error:
            raise InputError(f"{source}: on record {record.name}: {error}") from None
        _write_prediction(folder, compared, dataset)
        with reading:
            worst[:] = [max([*worst, compared], key=lambda one: one.badness)]
        return _summary_row(compared, dataset.units)

    rows = list(_on_all_cores(compare, len(dataset), stop_requested, advance))
    _add_noise_floors(rows, dataset)
    return Comparison({"records": rows, "worst": worst[0].record.name}, worst[0])


def compare_record(simulation: Simulation, record: Record, holds: Mapping[str, str]) -> ComparedRecord:
    """One record. Raises ValueError where no sensible step resolves the model."""
    stimulus = make_stimulus(record, holds)
    values = np.array([parameter.value for parameter in simulation.parameters])
    found = simulation.predict(stimulus, values)
    finer = simulation.predict(stimulus, values, refine=2)
    measured = [name for name in simulation.outputs if record.has(name)]
    simulated = {name: found.outputs[name][0] for name in measured}
    diverged = int(found.diverged_at[0])
    return ComparedRecord(
        record=record,
        simulated=simulated,
        scores={
            name: _score(record.signals[name], simulated[name], finer.outputs[name][0], record.ignore_first)
            for name in measured
        },
        diverged_at_s=None if diverged < 0 else diverged * record.period_s,
    )


def _score(measured: FloatArray, simulated: FloatArray, finer: FloatArray, ignored: int) -> OutputScore:
    signal, error = measured[ignored:], (simulated - measured)[ignored:]
    if not np.isfinite(error).all():
        return OutputScore(math.inf, _rms(signal), math.inf, float(np.abs(signal).max()), math.nan)
    rms_error, change = _rms(error), _rms((finer - simulated)[ignored:])
    share = change / rms_error if rms_error > 0.0 else math.nan
    return OutputScore(
        rms_error, _rms(signal), float(np.abs(error).max()), float(np.abs(signal).max()), share
    )


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
        "samples": record.samples, "ignore_first": record.ignore_first, "sample_rate_hz": 1.0 / record.period_s,
        "diverged_at_s": compared.diverged_at_s, "conditions": dict(record.conditions),
    }  # fmt: skip


def _add_noise_floors(rows: list[dict[str, Any]], dataset: StoredDataset) -> None:
    """Return the part that does not repeat, for each record's error; None where its input was not repeated."""
    floors = noise_floors(dataset)
    for row, head in zip(rows, dataset.heads, strict=True):
        for name, score in row["outputs"].items():
            score["noise_floor"] = floors.get(head.repeat or "", {}).get(name)


def _write_prediction(folder: Path, compared: ComparedRecord, dataset: StoredDataset) -> None:
    """time, inputs; measured, simulated and error of the first output, and of others under their own names."""
    record = compared.record
    table: dict[str, FloatArray] = {"time": record.period_s * np.arange(record.samples, dtype=np.float64)}
    units = {"time": "s", **{name: dataset.units[name] for name in dataset.holds}}
    table |= {name: record.signals[name] for name in dataset.holds}
    for index, (name, simulated) in enumerate(compared.simulated.items()):
        measured = record.signals[name]
        columns = {"measured": measured, "simulated": simulated, "error": simulated - measured}
        for what, values in columns.items():
            column = what if index == 0 else f"{name}_{what}"
            table[column], units[column] = values, dataset.units[name]
    metadata = {"program": "rtctl", "record": record.name, "file": record.file, "use": record.use}
    write_parquet(folder / f"{record.name}.parquet", table, units, metadata)


def _on_all_cores(
    work: Callable[[int], dict[str, Any]],
    count: int,
    stop_requested: Callable[[], bool],
    advance: Callable[[int], None],
) -> Iterator[dict[str, Any]]:
    """`work(k)` of every k, in order. Raises what the first k that fails does; KeyboardInterrupt where stopped."""
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
