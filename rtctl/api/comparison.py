"""How far a model is from a dataset: `simulate` and its `Comparison`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rtctl.api.datasets import stored_dataset_of
from rtctl.api.inputs import PathText, path_of
from rtctl.api.model import Model, kind_of, model_of
from rtctl.border.errors import InputError, nearest
from rtctl.extras import can_draw, require
from rtctl.measured.dataset import Dataset
from rtctl.measured.records.instrument import read_alike
from rtctl.output.interrupt import stop_on_interrupt
from rtctl.output.notebook import html_table, number
from rtctl.output.own_files import refuse_foreign, refuse_read
from rtctl.output.progress import Progress, reporter
from rtctl.session.validation.free_run_growth import describe_growth, is_unpredictable
from rtctl.session.validation.model_validation import (
    ComparedRecord,
    OutputScore,
    check_kind,
    compare_dataset,
    simulation_of,
    write_prediction,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rtctl.measured.stored import StoredDataset


class RecordScore(NamedTuple):
    """Errors of one output of one record, over its scored samples, in `unit`."""

    record: str
    use: str
    """"identify", "fit" or "test"."""
    output: str
    unit: str
    rms_error: float
    rms_signal: float
    nrmse: float
    """RMS error divided by the RMS signal."""
    max_error: float
    noise_floor: float | None
    """RMS of what does not repeat; None where the input was not repeated."""
    rms_variation: float
    """RMS of the signal about its mean; of a sweep about zero."""

    @property
    def share(self) -> float:
        """RMS error divided by the variation; NaN where nothing varies."""
        return self.rms_error / self.rms_variation if self.rms_variation > 0.0 else float("nan")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Comparison:
    """A model's free runs beside the measured records."""

    name: str
    """Name of the dataset."""
    summary: Mapping[str, Any]
    """Content of `summary.json`."""
    units: Mapping[str, str]
    """Unit of each signal."""
    inputs: tuple[str, ...]
    """Names of the signals that drive the plant."""
    records: Mapping[str, ComparedRecord]
    """Measured and simulated arrays by record; the worst one only where predictions were written to a folder."""
    _dataset: StoredDataset
    _written: Path | None
    """Folder into which predictions were written already."""

    @property
    def scores(self) -> tuple[RecordScore, ...]:
        """One row for each record and output."""
        return tuple(
            RecordScore(
                row["record"], row["use"], output, score["unit"], score["rms_error"], score["rms_signal"],
                score["nrmse"], score["max_error"], score["noise_floor"], score["rms_variation"],
            )
            for row in self.summary["records"]
            for output, score in row["outputs"].items()
        )  # fmt: skip

    @property
    def worst(self) -> str:
        """Name of the record with the largest error in parts of its variation."""
        return str(self.summary["worst"])

    @property
    def diverged(self) -> Mapping[str, float]:
        """Records whose simulation diverged, and the time after the first sample [s] at which it did."""
        rows = self.summary["records"]
        return {row["record"]: row["diverged_at_s"] for row in rows if row["diverged_at_s"] is not None}

    def plot(self, record: str | None = None, output: str | None = None) -> Figure:
        """Return the figure of one record's output: time, error and spectra.

        Args:
            record: Name of the record; None: the worst one.
            output: Name of the output; None: the one with the largest error in parts of its variation.

        Raises:
            InputError: There is no such record or output.
        """
        require("matplotlib", "Comparison.plot")
        from rtctl.measured.repeats import deviation
        from rtctl.plots.comparison import Compared, comparison_figure

        name = self.worst if record is None else record
        if name not in self.records:
            raise InputError(f'no record "{name}" to plot{nearest(str(name), self.records)}')
        shown = self.records[name]
        output = max(shown.scores, key=lambda one: _order(shown.scores[one])) if output is None else output
        if output not in shown.scores:
            raise InputError(f'record {name} has no output "{output}"{nearest(str(output), shown.scores)}')
        measured = shown.record
        return comparison_figure(
            Compared(
                title=f"{self.name}, {measured.name}",
                output=output,
                unit=self.units[output],
                time_s=measured.period_s * np.arange(measured.samples, dtype=np.float64),
                measured=measured.signals[output],
                simulated=shown.simulated[output],
                ignore_first=measured.ignore_first,
                noise=deviation(self._dataset, measured, output),
                frequency_hz=measured.frequencies_hz if measured.is_sweep else None,
            )
        )

    def save(self, folder: PathText, *, plot: bool = True) -> Path:
        """Write `summary.json`, the predictions that are in memory and, with `plot`, `worst.png` into a folder."""
        from rtctl.evaluation.metrics import write_json

        target = path_of("folder", folder)
        target.mkdir(parents=True, exist_ok=True)
        check_folder(target, self._dataset, None)
        (target / "summary.json").unlink(missing_ok=True)  # of an earlier comparison in the same folder
        for compared in self.records.values() if target != self._written else ():
            write_prediction(target, compared, self.units, self.inputs)
        write_json(target / "summary.json", dict(self.summary), "simulate")
        if plot and can_draw():
            from rtctl.plots.elements.style import save_png

            save_png(self.plot(), target / "worst.png", "simulate")
        return target

    def __repr__(self) -> str:
        worst = max(self.scores, key=lambda one: np.nan_to_num(one.share))
        return (
            f"<Comparison with {self.name}: {len(self.summary['records'])} records, worst {worst.record}: "
            f"{number(worst.rms_error, worst.unit)} RMS, it varies by {number(worst.rms_variation, worst.unit)}>"
        )

    def _repr_html_(self) -> str:
        rows = [
            [
                one.record, one.use, one.output, number(one.rms_error, one.unit), number(one.rms_variation, one.unit),
                f"{100.0 * one.share:.3g} %", number(one.max_error, one.unit),
            ]
            for one in self.scores
        ]  # fmt: skip
        headers = ["record", "use", "output", "RMS error", "variation", "error / variation", "largest error"]
        notes = [f"{record} diverged at {time_s:.4g} s" for record, time_s in self.diverged.items()]
        return html_table(f"Free runs of the model: {self.name}", headers, rows, notes)


def simulate(
    model: Model | PathText,
    dataset: Dataset | PathText,
    *,
    out: PathText | None = None,
    progress: Progress = False,
) -> Comparison:
    """Simulate every record of a dataset from its first sample and compare; no measured output is fed in.

    Args:
        model: A model or its file.
        dataset: A dataset or its manifest; a manifest's records are read one at a time.
        out: Folder for one Parquet file a record, written at once; memory then keeps the worst record only.
        progress: True shows a bar, a callable hears (text, share that is done).

    Raises:
        InputError: A file is wrong, model and data do not fit, or a file of another origin is in the way.
        KeyboardInterrupt: Ctrl-C; a comparison of half the records would not say which one is the worst.
    """
    folder = None if out is None else path_of("out", out)
    report = reporter(progress)
    source = _source(model)
    stored = stored_dataset_of(dataset)
    check_kind(kind_of(model), stored, source)
    model = model_of(model)
    if not isinstance(dataset, Dataset):
        stored = read_alike(stored)
    simulation = simulation_of(model.kind, model.content, stored, source)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        check_folder(folder, stored, model.source)
        (folder / "summary.json").unlink(missing_ok=True)  # of an earlier comparison in the same folder
    with stop_on_interrupt() as stop, report.bar(stored.name, len(stored)) as advance:
        found = compare_dataset(simulation, stored, folder, stop, advance, source=source)
    remarks = [*stored.remarks, *_unpredictable_records(found.summary)]
    return Comparison(
        name=stored.name,
        summary={**found.summary, **({"remarks": remarks} if remarks else {})},
        units=dict(stored.units),
        inputs=tuple(stored.holds),
        records=found.records or {found.worst.record.name: found.worst},
        _dataset=stored,
        _written=folder,
    )


def check_folder(folder: Path, dataset: StoredDataset, model: Path | None) -> None:
    """Raise InputError where a comparison would replace a file that it reads or that no comparison wrote."""
    names = ("summary.json", "worst.png", *(f"{head.name}.parquet" for head in dataset.heads))
    targets = [folder / name for name in names]
    beside = dataset.path.parent
    files = [beside / head.file for head in dataset.heads if head.file]
    refuse_read(targets, [dataset.path, *files, *([] if model is None else [model])])
    for target in targets:
        refuse_foreign(target, "simulate")


def _unpredictable_records(summary: Mapping[str, Any]) -> list[str]:
    """Return a remark on each record whose free run cannot be predicted."""
    return [
        describe_growth(row["record"], row["growth"])
        for row in summary["records"]
        if is_unpredictable(row["growth"])
    ]


def _source(model: Model | PathText) -> str:
    """Return how messages call the model: by its file if there is one."""
    if isinstance(model, Model):
        return "the model" if model.source is None else str(model.source)
    return str(path_of("model", model))


def _order(score: OutputScore) -> float:
    """Return the error in parts of the variation, infinite where the simulation diverged."""
    return float("inf") if np.isinf(score.rms_error) else float(np.nan_to_num(score.share))
