"""Records whose recorded drive holds noise that the device never felt, with that noise taken off.

The simulation answers such noise and the device does not. A cause that silences a drive near zero, a dead zone, then
explains as much as the noise itself: between the blows of an impact hammer nothing else is left.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.input_noise import InputNoise, find_input_noise, separate_noise
from rtctl.diagnosis.residual.testing.analysis import analyse_residual
from rtctl.identification.fit_record import FitRecord


class Quiet(NamedTuple):
    """Records with quiet drives, and what was taken off."""

    problem: Problem
    """Records to fit."""
    tests: tuple[FitRecord, ...]
    noise: InputNoise

    def bears_out(self, before: Hypothesis, after: Hypothesis) -> bool:
        """Return whether the re-fitted nominal model leaves less by what the noise is said to have made of it."""
        least = self.problem.thresholds.residual.least_noise_gone
        return after.cost < (1.0 - least * self.problem.taken_off) * before.cost


def take_off_drive_noise(problem: Problem, tests: tuple[FitRecord, ...], nominal: Hypothesis) -> Quiet | None:
    """Return the records with quiet drives, and what was taken off.

    Args:
        problem: Records to fit.
        tests: Test records.
        nominal: The re-fitted nominal model.

    Returns:
        None where the residual does not show noise of the drive, or where the device felt a part of it.
    """
    drive, subject = problem.subject.drive, problem.subject
    if not drive or subject.is_steady or problem.allowed:
        return None
    if any(one.stimulus.holds.get(drive) == "zero" for one in problem.records):
        return None  # what a converter puts out, and no reading
    if not any(separate_noise(one.stimulus.inputs.get(drive, np.empty(0))).any() for one in problem.records):
        return None
    try:
        found = find_input_noise(analyse_residual(nominal, problem, ()))
    except ArithmeticError:
        return None
    low, high = problem.thresholds.residual.unfelt_noise_shares
    if found is None or not low < found[1].share < high:
        return None
    records = tuple(_quiet(one, drive) for one in problem.records)
    quiet = replace(problem, records=records, taken_off=found[1].left ** 2)
    return Quiet(quiet, tuple(_quiet(one, drive) for one in tests), found[1])


def _quiet(record: FitRecord, drive: str) -> FitRecord:
    """Return a record without what stands at the floor of its drive's spectra."""
    inputs = record.stimulus.inputs
    if drive not in inputs:
        return record
    values: FloatArray = inputs[drive] - separate_noise(inputs[drive])
    return replace(record, stimulus=replace(record.stimulus, inputs={**inputs, drive: values}))
