"""Rows of the equation of motion along what was measured: over bumps of a record in time, by fundamentals of a sweep.

Every force per mass is a column, linear in its amplitude. In a record in time the rows are those of the weak form (see
`weak_form`). In a sweep a row of the record gives two, the balance of the fundamental of its sine: nothing is followed
from row to row there, so a fold of the response, which ends what a simulation can follow, is a row like any other. Each
row is divided by what a force of one unit does to the response (C. Sanathanan, J. Koerner, IEEE Trans. Automatic
Control 8 (1963) 56), taken from the measurement: drive over response.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from rtctl.border.arrays import ComplexArray, FloatArray
from rtctl.border.simulation import HasForces, Simulation
from rtctl.identification.fit_record import FitRecord, derivative_order, response_of
from rtctl.identification.regression.weak_form import TERMS, Sampled, sample_motion, weak_gram
from rtctl.measured.dataset import FREQUENCY, paired

READINGS = 32
"""Readings of a period of a sweep's sine."""
SETTLED = READINGS
"""Readings at the start after which the states of a force (a hysteresis, a lag of the drive) repeat themselves."""


class EquationRows(Protocol):
    """The equation of motion along the motion of one record."""

    @property
    def reference(self) -> Mapping[str, float]:
        """Coefficients of terms whose forces are taken off the acceleration beforehand."""
        ...

    @property
    def samples(self) -> int:
        """Samples of the motion at which a force is taken."""
        ...

    def forces(self, model: HasForces, extended: Simulation, lanes: FloatArray) -> FloatArray | None:
        """Return the forces per mass (lanes, m) of the last mechanism of `extended`; None where it exerts none."""
        ...

    def gram(self, names: Sequence[str], forces: FloatArray) -> tuple[FloatArray, float]:
        """Return the Gram matrix of the acceleration less the reference, the terms and forces (k, m), and its noise.

        The noise is what the readings' noise adds to the acceleration's square, where it is known.
        """
        ...


class RowsInTime:
    """Rows of the weak form of a record in time."""

    reference: Mapping[str, float] = {}

    def __init__(self, record: FitRecord, half_width_s: float) -> None:
        """Keep a record; `half_width_s` is that of the bumps."""
        self.record, self.half_width_s = record, half_width_s
        self.samples = record.samples

    def forces(self, model: HasForces, extended: Simulation, lanes: FloatArray) -> FloatArray | None:
        """See `EquationRows.forces`."""
        motion = sample_motion(self.record, self.half_width_s)
        found = model.forces_along(extended, self.record.stimulus, lanes, *motion)
        return None if found is None else np.pad(found, ((0, 0), (0, 1)), mode="edge")

    def gram(self, names: Sequence[str], forces: FloatArray) -> tuple[FloatArray, float]:
        """See `EquationRows.gram`."""
        return weak_gram(self.record, names, self.half_width_s, forces.reshape(-1, self.record.samples))


class RowsOfSweep:
    """Fundamentals of the equation in each row of a sweep.

    Near a sharp resonance inertia and stiffness cancel to a thousandth or less, so the forces at the model's own values
    are taken off row by row, before anything is squared.
    """

    def __init__(self, record: FitRecord, reference: Mapping[str, float]) -> None:
        """Keep a sweep; `reference` are the nominal model's coefficients."""
        self.record, self.reference = record, reference
        output = response_of([record])
        self.rate = 2.0 * np.pi * record.stimulus.inputs[FREQUENCY][::2]
        self.drive = record.stimulus.inputs["drive"][::2]
        self.z = paired(record.measured[output]) / (1j * self.rate) ** derivative_order(output)
        self.samples = 2 * READINGS * len(self.rate)
        self._turn = np.exp(2j * np.pi * np.arange(2 * READINGS + 1) / READINGS)

    def forces(self, model: HasForces, extended: Simulation, lanes: FloatArray) -> FloatArray | None:
        """See `EquationRows.forces`; in-phase and quadrature parts of all rows (lanes, 2 rows)."""
        found = np.empty((len(lanes), len(self.rate)), np.complex128)
        for row, (rate, drive, z) in enumerate(zip(self.rate, self.drive, self.z, strict=True)):
            stimulus = replace(
                self.record.stimulus,
                inputs={"drive": drive * self._turn.real},
                holds={"drive": "linear"},
                period_s=2.0 * np.pi / (rate * READINGS),
                guide={},
            )
            motion = (z * self._turn).real, (1j * rate * z * self._turn).real
            means = model.forces_along(extended, stimulus, lanes, *motion)
            if means is None:
                return None
            found[:, row] = _fundamental_of_means(means[:, SETTLED:])
        return self._weighted(found)

    def gram(self, names: Sequence[str], forces: FloatArray) -> tuple[FloatArray, float]:
        """See `EquationRows.gram`; the noise is not known."""
        terms = {name: self._term(name) for name in {*names, *self.reference}}
        taken = sum((value * terms[name] for name, value in self.reference.items()), np.zeros_like(self.z))
        left = -(self.rate**2) * self.z - taken
        rows = self._weighted(np.array([left, *(terms[name] for name in names)]))
        columns = np.vstack([rows, forces.reshape(-1, rows.shape[1])])
        return columns @ columns.T, 0.0

    def _term(self, name: str) -> ComplexArray:
        """Return the fundamentals (rows,) of a term, per unit of its coefficient."""
        term, turn = TERMS[name], self._turn[:READINGS]
        course = (self.z[:, None] * turn).real
        speed = (1j * self.rate[:, None] * self.z[:, None] * turn).real
        feature = term.feature(Sampled(course, speed, self.drive[:, None] * turn.real, 0.0))
        fundamental = 2.0 * np.mean(feature / turn, axis=1) * (1j * self.rate) ** term.order
        return np.asarray(term.sign * fundamental, np.complex128)

    def _weighted(self, amplitudes: ComplexArray) -> FloatArray:
        """Return in-phase and quadrature parts (k, 2 rows) of amplitudes (k, rows), each row by its weight."""
        drive = np.abs(self.drive)
        driven = drive > 0.0  # what is read without a drive tells nothing of its response
        scaled = amplitudes * np.where(driven, np.abs(self.z) / np.where(driven, drive, 1.0), 0.0)
        return np.hstack([scaled.real, scaled.imag])


def _fundamental_of_means(means: FloatArray) -> ComplexArray:
    """Return the complex amplitudes (k,) of one period whose means (k, READINGS) from reading to reading are given."""
    half = np.pi / READINGS
    middle = np.exp(-1j * (2.0 * half * np.arange(READINGS) + half))
    return np.asarray(2.0 / READINGS * (means @ middle) * half / np.sin(half), np.complex128)
