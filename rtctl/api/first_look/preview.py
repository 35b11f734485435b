"""What was read of a dataset, as tables and a picture: `preview`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtctl.api.datasets import dataset_of
from rtctl.api.inputs import PathText, path_of
from rtctl.extras import can_draw, require
from rtctl.measured.dataset import Dataset
from rtctl.measured.summary import (
    RECORD_HEADERS,
    SIGNAL_HEADERS,
    RecordSummary,
    SignalSummary,
    Source,
    Summary,
    record_rows,
    signal_rows,
    summarise,
)
from rtctl.output.notebook import html_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Preview:
    """A dataset at first sight."""

    dataset: Dataset
    summary: Summary

    @property
    def signals(self) -> tuple[SignalSummary, ...]:
        """Of each signal: column, role, unit and who states it, first and last value, least and largest."""
        return self.summary.signals

    @property
    def records(self) -> tuple[RecordSummary, ...]:
        """Of each record: use, file, rows, rate, duration, gaps."""
        return self.summary.records

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader should look at."""
        return self.summary.notes

    def to_dict(self) -> dict[str, Any]:
        """Return the tables as the command line's `--json` prints them."""
        from rtctl.evaluation.metrics import finite

        content: dict[str, Any] = finite(self.summary.to_dict())
        return content

    def plot(self) -> Figure:
        """Return the figure: of every signal the first periods, the whole, and its spectrum."""
        require("matplotlib", "Preview.plot")
        from rtctl.plots.frequency.sweep import sweeps_figure
        from rtctl.plots.preview import preview_figure

        if self.dataset.has_sweeps:
            count = len(self.dataset.records)
            return sweeps_figure(
                self.dataset, f"{self.summary.name}: {count} sweep{'s' if count > 1 else ''}"
            )
        return preview_figure(self.dataset, self.summary)

    def save(self, path: PathText) -> Path | None:
        """Write the picture (PNG); None where matplotlib is not installed.

        Raises:
            InputError: A file is there that is no such picture.
        """
        target = path_of("path", path)
        if not can_draw():
            return None
        from rtctl.plots.elements.style import save_png

        save_png(self.plot(), target, "preview")
        return target

    def __repr__(self) -> str:
        return f"<Preview of {self.summary.name}: {len(self.records)} records, {len(self.signals)} signals>"

    def _repr_html_(self) -> str:
        signals = html_table(self.summary.name, SIGNAL_HEADERS, signal_rows(self.summary))
        return signals + html_table("", RECORD_HEADERS, record_rows(self.summary), self.notes)


def preview(dataset: Dataset | PathText) -> Preview:
    """Return what was read of a dataset: its tables, its remarks, and a picture.

    Args:
        dataset: A dataset or its manifest.

    Raises:
        InputError: The manifest or a file is wrong.
    """
    return preview_with(dataset_of(dataset), None)


def preview_with(dataset: Dataset, sources: Mapping[str, Source] | None) -> Preview:
    """Return the preview of a dataset of which the caller knows where its units come from."""
    return Preview(dataset=dataset, summary=summarise(dataset, sources))
