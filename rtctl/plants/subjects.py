"""Kinds of plant that can be diagnosed, one file each; a further kind is a further line here."""

from __future__ import annotations

from rtctl.diagnosis.problem.subject import Subject
from rtctl.measured.dataset import Dataset
from rtctl.plants.oscillator.diagnosis import OSCILLATOR
from rtctl.plants.vo2.diagnosis import BY_RESISTANCE, VO2

SUBJECTS: dict[str, Subject] = {subject.kind: subject for subject in (OSCILLATOR, VO2)}
_FALLBACKS: dict[str, Subject] = {VO2.kind: BY_RESISTANCE}


def subject_for(kind: str, dataset: Dataset) -> Subject:
    """Of this kind; by its other output where no record that is fitted has the first."""
    subject = SUBJECTS[kind]
    fit_hypothesis = [record for record in dataset.records if record.use == "fit"] or dataset.records
    if kind in _FALLBACKS and not any(record.has(subject.signal) for record in fit_hypothesis):
        return _FALLBACKS[kind]
    return subject
