"""An oscillator as the diagnosis sees it by sweeps: forces of no name, and backgrounds, in the complex amplitude.

A small force phi(z, v, u) acts on the steady state by its fundamental. The response to a drive whose phasor moves by
dA is dZ/d|A| Re dA + i Z/|A| Im dA, since a shift in time turns both alike; so one neighbour of each row, at a slightly
larger drive, tells what every force does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import ComplexArray, FloatArray
from rtctl.border.simulation import HasCatalogue, Simulation
from rtctl.diagnosis.problem.subject import FittedModel, FittedRecords, Force, Subject
from rtctl.identification.fit_record import derivative_order
from rtctl.measured.dataset import FREQUENCY, SWEEP_PERIOD_S, paired
from rtctl.registry import plant_kind

LARGER = 1e-5
"""Step of the drive, relative to it, by which the response's slope is found."""
FARTHEST = 10.0
"""Slope of the response over the response per drive beyond which a row is at a fold, and tells nothing of a force."""
SCREENED_SAMPLES = 800
"""Samples, two a row, of all sweeps together by which a hypothesis is screened."""
SETTLED = 1e-6
"""Difference of a settled response from itself, simulated again from there, relative to it."""
ANGLES = 2.0 * np.pi * np.arange(64) / 64
FORCES: tuple[tuple[str, str, Callable[[FloatArray, FloatArray], FloatArray]], ...] = (
    ("z^3", "amplitude", lambda z, v: z**3),
    ("z^5", "amplitude", lambda z, v: z**5),
    ("sign z", "amplitude", lambda z, v: np.sign(z)),
    ("v |v|", "velocity", lambda z, v: v * np.abs(v)),
    ("v^3", "velocity", lambda z, v: v**3),
    ("sign v", "velocity_sign", lambda z, v: np.sign(v)),
    ("z^2 v", "amplitude", lambda z, v: z**2 * v),
    ("z |z| v", "amplitude", lambda z, v: np.abs(z) * v),
)
"""Forces of displacement and velocity, each over its size."""
BACKGROUNDS = (
    "background in phase", "background in quadrature", "in phase, along the sweep", "in quadrature, along the sweep",
)  # fmt: skip
"""Readings that are there beside the motion, in proportion to the drive: a feedthrough, and one that changes."""
LINEAR = ("z along the sweep", "v along the sweep", "u along the sweep")
"""Linear forces whose size changes along the sweep: a stiffness, a damping, a gain that drift."""
UNJUDGED = "no sweep of frequencies shows these causes, and the diagnosis did not judge them (records in time do): {}"


def is_at_fold(hypothesis: FittedModel, problem: FittedRecords, index: int) -> NDArray[np.bool_]:
    """Return the samples of a sweep whose rows are at a fold of the response, where any small change moves it much.

    So are rows that have not settled, beyond the fold: simulated again from there, they are elsewhere.
    """
    record, output = problem.records[index], hypothesis.sensitivity.outputs[0]
    response, _, slope, per_drive = _responses(hypothesis, problem, index)
    moves = np.abs(slope) >= FARTHEST * np.abs(per_drive)
    if (guide := record.stimulus.guide.get(output)) is not None:
        there = paired(guide)
        moves |= ~(np.abs(response - there) <= SETTLED * np.abs(there))
    return np.repeat(moves, 2)[record.first :]


def steady_force_sensitivities(hypothesis: FittedModel, problem: FittedRecords, index: int) -> FloatArray:
    """Return what each force and background does to a sweep, (forces, 1, n), each about as strong as the drive."""
    record, output = problem.records[index], hypothesis.sensitivity.outputs[0]
    response, drive, slope, per_drive = _responses(hypothesis, problem, index)
    rate = 2.0 * np.pi * record.stimulus.inputs[FREQUENCY][::2]
    slope = np.where(np.abs(slope) < FARTHEST * np.abs(per_drive), slope, 0.0)
    z = response / (1j * rate) ** derivative_order(output)
    pushes = _pushes(z, rate, problem)
    moved = [slope * push.real + 1j * per_drive * push.imag for push in pushes]
    along = np.linspace(-1.0, 1.0, len(z))
    size = problem.size(output) * drive / (problem.scales.drive or 1.0)
    moved += [np.asarray(turn * one, np.complex128) for one in (size, size * along) for turn in (1.0, 1j)]
    return np.array([_interleaved(one)[None, record.first :] for one in moved])


def _responses(
    hypothesis: FittedModel, problem: FittedRecords, index: int
) -> tuple[ComplexArray, FloatArray, ComplexArray, ComplexArray]:
    """Return response, drive, the response's slope along the drive, and response per drive, of each row (rows,)."""
    record = problem.records[index]
    inputs = record.stimulus.inputs
    output = hypothesis.sensitivity.outputs[0]
    larger = replace(record.stimulus, inputs={**inputs, "drive": (1.0 + LARGER) * inputs["drive"]})
    values, steps = hypothesis.values_of(index), problem.steps_per_period
    runs = [
        paired(hypothesis.simulation.predict(one, values, None, steps).outputs[output][0])
        for one in (record.stimulus, larger)
    ]
    drive = inputs["drive"][::2]
    return runs[0], drive, (runs[1] - runs[0]) / (LARGER * drive), runs[0] / drive


def _pushes(z: ComplexArray, rate: FloatArray, problem: FittedRecords) -> list[ComplexArray]:
    """Return the fundamentals (rows,) of each force along the motion, in the drive's unit."""
    scales, turn = problem.scales, np.exp(1j * ANGLES)
    course = np.real(z[:, None] * turn) / scales.displacement
    speed = np.real(1j * rate[:, None] * z[:, None] * turn) / scales.velocity
    strength = scales.drive or 1.0
    found = [strength * 2.0 * np.mean(force(course, speed) / turn, axis=1) for _, _, force in FORCES]
    along = np.linspace(-1.0, 1.0, len(z))
    relative = z / scales.displacement
    found += [strength * along * one for one in (relative, 1j * relative, np.ones_like(relative))]
    return found


def _interleaved(amplitudes: ComplexArray) -> FloatArray:
    """Return samples (2 n,) of complex amplitudes (n,)."""
    return np.column_stack([amplitudes.real, amplitudes.imag]).reshape(-1)


def describe_unjudged(simulation: Simulation) -> Sequence[str]:
    """Return the note on causes that leave no trace in a steady state."""
    kind = plant_kind(simulation.kind)
    catalogue = simulation.catalogue if isinstance(simulation, HasCatalogue) else ()
    missing = [one for one in kind.part(kind.model.mechanisms) if one not in catalogue] if kind.model else []
    return (UNJUDGED.format(", ".join(missing)),) if missing else ()


def by_steady_state(subject: Subject) -> Subject:
    """Return how a kind of plant is diagnosed by sweeps, from how it is diagnosed by records in time."""
    return replace(
        subject,
        is_steady=True,
        screening_samples=SCREENED_SAMPLES,
        tells_nothing=is_at_fold,
        clippable_outputs=(),
        spike_outputs=(),
        forces=(
            *(Force(name, coordinate) for name, coordinate, _ in FORCES),
            *(Force(name, "frequency") for name in LINEAR),
            *(Force(name, "background") for name in BACKGROUNDS),
        ),
        force_sensitivities=steady_force_sensitivities,
        memory_forces=None,
        nonparametric_alternatives=(),
        lag_s=lambda scales: 2.0 * SWEEP_PERIOD_S,
        slower_sampling=(),
        growth_is_misfit=False,
        resonances=lambda simulation: (),
        offset_mechanism="",
        levels={},
        reads_initial_states=False,
        takes_scenarios=False,
        describe_screened=describe_unjudged,
    )
