"""A dataset without its spikes, before a model is fitted: by the same rules as before a diagnosis."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from rtctl.measured.dataset import Dataset


class Cleaned(NamedTuple):
    """A dataset without spikes, and the notes on those that it had."""

    dataset: Dataset
    notes: tuple[str, ...]


def without_spikes(dataset: Dataset) -> Cleaned:
    """Replace single readings far from all others: of responses, and of one drive that no response follows.

    Accelerations beside a motion stay as they are, as impacts make such readings of them.
    """
    from rtctl.diagnosis.screening.spikes import replace_drive_spikes, replace_spikes  # slow to import
    from rtctl.diagnosis.thresholds import ScreeningThresholds

    if dataset.has_sweeps:
        return Cleaned(dataset, ())
    thresholds = ScreeningThresholds()
    outputs = [name for name in dataset.units if name not in dataset.holds]
    smooth = [name for name in outputs if name != "acceleration"] or outputs
    kept = replace_spikes(dataset.records, smooth, dataset.units, thresholds)
    notes = list(kept.notes)
    if len(dataset.holds) == 1:
        kept = replace_drive_spikes(
            kept.records, next(iter(dataset.holds)), smooth[0], dataset.units, thresholds
        )
        notes += kept.notes
    return (
        Cleaned(replace(dataset, records=tuple(kept.records)), tuple(notes))
        if notes
        else Cleaned(dataset, ())
    )
