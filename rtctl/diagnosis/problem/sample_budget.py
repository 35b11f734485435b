"""What a diagnosis gets through: so many samples, and a model that runs over them in no time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.errors import InputError
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.compile_time import working_time
from rtctl.identification.fit_record import FitRecord

MOST_SAMPLES = 100_000
"""Of all records to fit: hundreds of fits are made of them, and what 100,000 samples do not show is small."""
LEAST_SAMPLES = 1_000
"""Of a record."""
MOST_RUNS_SECONDS = 4.0
"""Of processor time [s] that one run over the records to fit may take; a fit takes some hundred."""
SHORT = 64
"""Samples that a kernel is compiled with."""
FEWER = (
    "the records to fit hold {} samples, more than the {} that a diagnosis gets through in time: of {} records {} "
    'samples were used, the first ones of each; mark other records as use = "test", or cut them with rows, to choose '
    "which"
)
UNRESOLVED = "{}: on record {}: {}. Its samples are {:.3g} s apart: is its rate in Hz, its time in seconds?"
SLOW = (
    "{}: one run of the model over the records to fit takes more than {:g} s of processor time, and a diagnosis makes "
    "hundreds: its fastest motion is far quicker than the samples, which are {:.3g} s apart. Is the time in seconds, "
    "the rate in Hz? Are the units of the model's parameters right?"
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
        kept = tuple(record.beginning(max(LEAST_SAMPLES, int(share * record.samples))) for record in kept)
    used = sum(record.samples for record in kept)
    return kept, [FEWER.format(total, MOST_SAMPLES, len(kept), used)]


def check_speed(simulation: Simulation, records: Sequence[FitRecord], source: str) -> None:
    """Raises InputError, naming `source`, where no sensible step resolves the model, or so many that no fit ends."""
    values = np.array([parameter.value for parameter in simulation.parameters])
    begun = None
    for record in records:
        try:
            if begun is None:
                simulation.predict(record.beginning(SHORT).stimulus, values)
                begun = working_time()
            simulation.predict(record.stimulus, values)
        except ValueError as error:
            raise InputError(UNRESOLVED.format(source, record.name, error, record.period_s)) from None
        if working_time() - begun > MOST_RUNS_SECONDS:
            raise InputError(SLOW.format(source, MOST_RUNS_SECONDS, record.period_s))
