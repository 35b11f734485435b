"""Limits on the work of a diagnosis: the number of samples to fit, and the time of one run of the model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.errors import InputError
from rtctl.border.simulation import Simulation
from rtctl.border.work import metered
from rtctl.diagnosis.thresholds import ScreeningThresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.sweep_record import shorten

FEWER = (
    "the records to fit hold {} samples, more than the {} that a diagnosis gets through in time: of {} records {} "
    "samples were used, the first ones of each (of a sweep rows from the whole of it); mark other records as use = "
    '"test", or cut them with rows, to choose which'
)
UNRESOLVED = "{}: on record {}: {}. Its samples are {:.3g} s apart: is its rate in Hz, its time in seconds?"
SLOW = (
    "{}: one run of the model over the records to fit takes more than {:.3g} million integration steps, and a "
    "diagnosis makes hundreds: its fastest motion is far quicker than the samples, which are {:.3g} s apart. "
    "Is the time in seconds, the rate in Hz? Are the units of the model's parameters right?"
)


def truncate_records(
    records: tuple[FitRecord, ...], limits: ScreeningThresholds
) -> tuple[tuple[FitRecord, ...], list[str]]:
    """Return as many samples to fit as a diagnosis can use, with notes.

    The initial parts of all records are kept; where these would be too short, those of some records, evenly chosen.
    """
    most, least = limits.max_fit_samples, limits.min_truncated_samples
    total = sum(record.samples for record in records)
    if total <= most:
        return records, []
    kept = records
    if len(records) * least > most:
        evenly = np.linspace(0, len(records) - 1, most // least).round().astype(int)
        kept = tuple(records[k] for k in evenly)
    share = most / sum(record.samples for record in kept)
    if share < 1.0:
        kept = tuple(shorten(record, max(least, int(share * record.samples))) for record in kept)
    used = sum(record.samples for record in kept)
    return kept, [FEWER.format(total, most, len(kept), used)]


def check_speed(
    simulation: Simulation,
    records: Sequence[FitRecord],
    source: str,
    most_steps: float,
) -> None:
    """Raise an error if a free run of the model over the records takes so many steps that no fit would end.

    Args:
        simulation: The model of the file, at its own values.
        records: Records to fit.
        source: Path of the dataset, for the error message.
        most_steps: Work of one run over all records [steps].

    Raises:
        InputError: No sensible step resolves the model, or a run takes more than `most_steps`.
    """
    values = np.array([parameter.value for parameter in simulation.parameters])
    with metered() as meter:
        for record in records:
            try:
                simulation.predict(record.stimulus, values)
            except ValueError as error:
                raise InputError(UNRESOLVED.format(source, record.name, error, record.period_s)) from None
            if meter.steps > most_steps:
                raise InputError(SLOW.format(source, 1e-6 * most_steps, record.period_s))
