"""The screening: from a dataset to the records that a diagnosis may use, in the outputs that it compares."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.sample_budget import check_speed, truncate_records
from rtctl.diagnosis.problem.subject import Reader, Subject
from rtctl.diagnosis.screening.screened import Screened, apply_steps
from rtctl.diagnosis.screening.split import split_records
from rtctl.diagnosis.screening.unknown_initial_state import (
    has_two_wells,
    skip_unknown_history,
    warm_up_moving_records,
)
from rtctl.diagnosis.thresholds import Thresholds
from rtctl.measured.dataset import Dataset

NO_SIGNAL = "no record to fit has a {0}: the diagnosis used the {1} alone"
OF_LOGARITHM = ", and the gain is that of the {}'s logarithm"
NOT_AT_REST = (
    "{} of {} records do not begin at rest in their first current: the temperature at which they begin was taken from "
    "their first readings, and what is colder than the model was identified is not scored"
)


class ScreenedData(NamedTuple):
    """Records that may be used, and the model that they are compared with."""

    records: Screened
    simulation: Simulation
    """With outputs whose errors are of one size over the whole range."""
    scales: Scales
    """Sizes of what the records to fit show."""


def screen_dataset(
    dataset: Dataset,
    simulation: Simulation,
    subject: Subject,
    usual_signal: str,
    thresholds: Thresholds,
) -> ScreenedData:
    """Check the dataset, keep what can be diagnosed, and bring its readings into comparable form.

    Args:
        dataset: Records as they were read.
        simulation: The model of the file.
        subject: Kind of plant, as these records let it be diagnosed.
        usual_signal: Signal that this kind of plant is usually diagnosed by.
        thresholds: Thresholds of the diagnosis.

    Raises:
        InputError: Nothing is left that could be diagnosed, or the model cannot be simulated in time.
    """
    limits = thresholds.screening

    def note_missing_signal(records: Screened) -> Screened:
        signal = subject.required_signal
        if signal == usual_signal:
            return records._replace(notes=())
        note = NO_SIGNAL.format(usual_signal, signal)
        note += OF_LOGARITHM.format(signal) if subject.output != signal else ""
        return records._replace(notes=(note,))

    def skip_what_history_decides(records: Screened) -> Screened:
        if subject.is_steady:
            return records._replace(notes=())
        if subject.is_at_rest_undriven:
            return skip_unknown_history(records, comparable, limits)
        wells = has_two_wells(comparable)
        return warm_up_moving_records(records, scales.rate, limits, two_wells=wells)

    def find_initial_states(records: Screened) -> Screened:
        find = subject.find_initial_state
        if find is None:
            return records
        fit, tests = (tuple(find(comparable, one) for one in ones) for ones in (records.fit, records.tests))
        begun = sum(
            new.stimulus is not old.stimulus
            for new, old in zip((*fit, *tests), (*records.fit, *records.tests), strict=True)
        )
        notes = (NOT_AT_REST.format(begun, len(fit) + len(tests)),) if begun else ()
        return Screened(fit, tests, notes)

    def limit_samples(records: Screened) -> Screened:
        fit, notes = truncate_records(records.fit, limits)
        return records._replace(fit=fit, notes=tuple(notes))

    records = split_records(dataset, subject, limits)
    records = apply_steps(records, (note_missing_signal, limit_samples))
    check_speed(simulation, records.fit, str(dataset.path), thresholds.budget.one_run)
    comparable, read = subject.to_comparable(simulation, records.fit)
    records = _read_comparably(records, read)
    scales = subject.scales(records.fit, comparable)
    records = apply_steps(records, (find_initial_states, skip_what_history_decides))
    return ScreenedData(records, comparable, scales)


def _read_comparably(records: Screened, read: Reader) -> Screened:
    """Return the records with their readings in the form of the comparable simulation's outputs."""
    fit, tests = (
        tuple(replace(one, measured=read(one.measured)) for one in ones)
        for ones in (records.fit, records.tests)
    )
    return Screened(fit, tests, records.notes)
