"""Kinds of plant as the diagnosis sees them, asked from the registry."""

from __future__ import annotations

from rtctl.border.errors import InputError
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.subject import Subject
from rtctl.measured.dataset import Dataset
from rtctl.registry import plant_kind, plant_kinds


def subjects_of(kind: str) -> tuple[Subject, ...]:
    """Return the subjects of a kind of plant, the preferred one first. Raises InputError where it has none."""
    record = plant_kind(kind, "model.kind")
    if record.diagnosis is None:
        known = [name for name, one in plant_kinds().items() if one.diagnosis is not None]
        raise InputError(f'a "{kind}" is not diagnosed; those that are: {", ".join(known)}')
    subjects = record.part(record.diagnosis)
    return (subjects,) if isinstance(subjects, Subject) else tuple(subjects)


def subject_of(kind: str) -> Subject:
    """Return the preferred subject of a kind of plant. Raises InputError where it has none."""
    return subjects_of(kind)[0]


def subjects_of_model(simulation: Simulation, dataset: Dataset) -> tuple[Subject, Subject]:
    """Return the subject by which a dataset lets a model be diagnosed, and the preferred one of its kind.

    Raises:
        InputError: Models of this kind are not diagnosed.
    """
    record = plant_kind(simulation.kind, "model.kind")
    made = record.part(record.diagnosis) if record.diagnosis is not None else None
    if callable(made):
        own: Subject = made(simulation, dataset)
        return own, own
    return subject_for(simulation.kind, dataset), subject_of(simulation.kind)


def subject_for(kind: str, dataset: Dataset) -> Subject:
    """Return the first subject of a kind of plant whose signal a fitted record of `dataset` has."""
    subjects = [one for one in subjects_of(kind) if one.is_steady == dataset.has_sweeps]
    if not subjects:
        raise InputError(f'{dataset.path}: a "{kind}" is not diagnosed by sweeps of frequencies')
    fitted = [record for record in dataset.records if record.use == "fit"] or dataset.records
    return next(
        (one for one in subjects if any(record.has(one.required_signal) for record in fitted)), subjects[0]
    )
