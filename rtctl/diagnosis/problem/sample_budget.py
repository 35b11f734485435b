"""What a diagnosis gets through: so many samples, and a model that runs over them in no time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.errors import InputError
from rtctl.border.simulation import Simulation
from rtctl.border.work import metered
from rtctl.diagnosis.thresholds import BudgetThresholds
from rtctl.identification.fit_record import FitRecord

MOST_SAMPLES = 100_000
"""Of all records to fit: hundreds of fits are made of them, and what 100,000 samples do not show is small."""
LEAST_SAMPLES = 1_000
"""Of a record."""
FEWER = (
    "the records to fit hold {} samples, more than the {} that a diagnosis gets through in time: of {} records {} "
    'samples were used, the first ones of each; mark other records as use = "test", or cut them with rows, to choose '
    "which"
)
UNRESOLVED = "{}: on record {}: {}. Its samples are {:.3g} s apart: is its rate in Hz, its time in seconds?"
SLOW = (
    "{}: one run of the model over the records to fit takes more than {:.3g} million integration steps, and a "
    "diagnosis makes hundreds: its fastest motion is far quicker than the samples, which are {:.3g} s apart. "
    "Is the time in seconds, the rate in Hz? Are the units of the model's parameters right?"
)


def fewer(records: tuple[FitRecord, ...]) -> tuple[tuple[FitRecord, ...], list[str]]:
    """`records`, or the beginnings of them, or of as many as have one of LEAST_SAMPLES; and what is to be said."""
    total = sum(record.samples for record in records)
    if total <= MOST_SAMPLES:
        return records, []
    kept = records
    if len(records) * LEAST_SAMPLES > MOST_SAMPLES:
        evenly = np.linspace(0, len(records) - 1, MOST_SAMPLES // LEAST_SAMPLES).round().astype(int)
        kept = tuple(records[k] for k in evenly)
    share = MOST_SAMPLES / sum(record.samples for record in kept)
    if share < 1.0:
        kept = tuple(record.truncate(max(LEAST_SAMPLES, int(share * record.samples))) for record in kept)
    used = sum(record.samples for record in kept)
    return kept, [FEWER.format(total, MOST_SAMPLES, len(kept), used)]


def check_speed(
    simulation: Simulation,
    records: Sequence[FitRecord],
    source: str,
    most_steps: float = BudgetThresholds().one_run,
) -> None:
    """Refuse a model of which a free run over the records takes so many steps that no fit ends.

    Args:
        simulation: The model of the file, at its own values.
        records: Records to fit.
        source: The dataset, as an error names it.
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
