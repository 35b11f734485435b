"""Records to fit and records to test on, and what the data do not allow: the first part of the screening."""

from __future__ import annotations

from collections.abc import Sequence

from rtctl.border.errors import InputError
from rtctl.diagnosis.problem.subject import Subject
from rtctl.diagnosis.screening.excitation_checks import (
    note_clipping,
    note_constant_drive,
    note_single_tone,
    note_standing_readings,
)
from rtctl.diagnosis.screening.record_checks import (
    drop_constant_records,
    drop_short_records,
    note_impossible_readings,
    note_inconsistent_velocities,
    note_late_velocities,
    unmark_false_repeats,
)
from rtctl.diagnosis.screening.screened import RecordCheck, Screened, apply_checks
from rtctl.diagnosis.screening.spikes import replace_drive_spikes, replace_spikes
from rtctl.diagnosis.thresholds import ScreeningThresholds
from rtctl.identification.fit_record import make_fit_record
from rtctl.identification.sweep_record import prepare_sweep
from rtctl.measured.dataset import Dataset, Record

NO_TESTS = 'no record has use = "test": {} was held out of the fit to measure the gain'
ONE_RECORD = (
    'the only record is fitted, none has use = "test": the gain could not be measured; add a record at another '
    "amplitude"
)


def split_records(
    dataset: Dataset, subject: Subject, thresholds: ScreeningThresholds | None = None
) -> Screened:
    """Check the records of `dataset`, and divide them into those to fit and those to test on.

    The last record is held out where none is marked as a test.

    Raises:
        InputError: No record is left to fit, or nothing drives any of them.
    """
    thresholds = thresholds or ScreeningThresholds()
    of_drive: tuple[RecordCheck, ...] = (
        lambda records: replace_drive_spikes(
            records, subject.drive, subject.output, dataset.units, thresholds
        ),
        lambda records: unmark_false_repeats(records, subject.drive, thresholds),
    )
    checks: tuple[RecordCheck, ...] = (
        lambda records: drop_short_records(records, thresholds),
        lambda records: replace_spikes(records, subject.spike_outputs, dataset.units, thresholds),
        lambda records: drop_constant_records(records, subject.required_signal),
        *(of_drive if subject.drive else ()),
        lambda records: note_impossible_readings(records, dataset.units),
        lambda records: note_inconsistent_velocities(records, thresholds),
        lambda records: note_late_velocities(records, thresholds),
    )
    usable, notes = apply_checks(dataset.records, checks)
    fit = [record for record in usable if record.use == "fit"]
    fit = fit or [record for record in usable if record.use != "test"]
    tests = [record for record in usable if record.use == "test"]
    _require_excited_record(dataset, subject, fit, notes, thresholds.min_samples)
    said = [*notes]
    if not tests and len(fit) > 1:
        tests = [fit.pop()]
        said.append(NO_TESTS.format(tests[0].name))
    elif not tests:
        said.append(ONE_RECORD)
    for name in subject.clippable_outputs:
        said += note_clipping((*fit, *tests), name, dataset.units[name], thresholds)
        said += note_standing_readings((*fit, *tests), name, dataset.units[name], thresholds)
    if subject.drive and not subject.is_steady:
        said += note_constant_drive(fit, subject.drive, rests=subject.is_at_rest_undriven)
        said += note_single_tone(fit, subject.drive, thresholds)
    to_fit, to_test = (
        tuple(prepare_sweep(make_fit_record(one, dataset.holds)) for one in ones) for ones in (fit, tests)
    )
    return Screened(to_fit, to_test, tuple(said))


def _require_excited_record(
    dataset: Dataset, subject: Subject, fit: Sequence[Record], notes: Sequence[str], min_samples: int
) -> None:
    """Raise InputError where no record is left to fit, or none of them is driven at all."""
    if not fit:
        reason = (
            f'{dataset.path}: no record with use = "fit" can be diagnosed; {min_samples} samples of a '
            f"moving {subject.required_signal} are needed"
        )
        raise InputError("\n".join([reason, *notes]))
    if subject.is_at_rest_undriven and not any(record.signals[subject.drive].any() for record in fit):
        raise InputError(
            f"{dataset.path}: the {subject.drive} of every record to fit is 0 {dataset.units[subject.drive]}: nothing "
            f"acts on the device, and nothing can be diagnosed. Is the {subject.drive} in the right column? If so, "
            "record with one that changes"
        )
