"""Kinds of plant that can be diagnosed, one file each; a further kind is a further line here."""

from __future__ import annotations

from rtctl.diagnosis.subjects.oscillator import OSCILLATOR
from rtctl.diagnosis.subjects.subject import Subject
from rtctl.diagnosis.subjects.vo2 import VO2

SUBJECTS: dict[str, Subject] = {subject.kind: subject for subject in (OSCILLATOR, VO2)}
