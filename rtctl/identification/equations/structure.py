"""Parameters of equations that no data of their outputs tell: only combinations of them act on what is measured.

A level that no instrument reads can be traded against its coefficients. Along such a combination the outputs do not
change at all, and what a finite difference shows of it is rounding. Whether another input would tell them apart is
seen under a random staircase over the range of the inputs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import Simulation
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.identification.simulation_error.sensitivity import Sensitivity

LEAST_SHARE = 1e-10
"""Share of a parameter's squared sensitivity beyond the other parameters and the initial states, below which the
records do not tell it: finite differences are right to 1e-6 of a derivative, 1e-12 of a square."""
LEVELS, MOST_SAMPLES, SEED = 20, 600, 1
"""Levels and samples of the staircase under which it is seen whether another input would tell more, and its seed."""


def structurally_undetermined(simulation: Simulation, records: Sequence[FitRecord]) -> tuple[str, ...]:
    """Return the parameters that neither these records nor a random staircase of the inputs tell from the others.

    () where nothing drives the model, or where it diverges under the staircase.
    """
    first = records[0]
    if not first.stimulus.inputs:
        return ()
    drive, output = next(iter(first.stimulus.inputs)), next(iter(first.measured))
    scales = estimate_scales(records, output, drive)
    driven = _under_staircase(simulation, records)
    return () if driven is None else undetermined_parameters(simulation, [*records, driven], scales)


def _under_staircase(simulation: Simulation, records: Sequence[FitRecord]) -> FitRecord | None:
    """Return a record of random levels over the range of each input, with the outputs of the model as measured."""
    rng, first = np.random.default_rng(SEED), records[0]
    samples = min(first.samples, MOST_SAMPLES)
    inputs = {}
    for name in first.stimulus.inputs:
        seen = np.concatenate([one.stimulus.inputs[name] for one in records])
        levels = rng.uniform(float(seen.min()), float(seen.max()), LEVELS)
        inputs[name] = np.repeat(levels, -(-samples // LEVELS))[:samples]
    stimulus = replace(first.stimulus, inputs=inputs, holds=dict.fromkeys(inputs, "zero"), onward={})
    values = np.array([one.value for one in simulation.parameters])
    run = simulation.predict(stimulus, values)
    if run.diverged_at[0] >= 0:
        return None
    return FitRecord(
        name="staircase", stimulus=stimulus, measured={name: run.outputs[name][0] for name in first.measured}
    )


def undetermined_parameters(
    simulation: Simulation, records: Sequence[FitRecord], scales: Scales
) -> tuple[str, ...]:
    """Return the names of parameters that are not fixed and not determined beside the others, at their own values."""
    sensitivity = Sensitivity.of(simulation, records, scales=scales)
    names = [simulation.parameters[k].name for k in sensitivity.free]
    if not names:
        return ()
    gram = np.zeros((len(names), len(names)))
    for record in records:
        found = _beyond_start(sensitivity, simulation, record)
        if found is None:
            return ()
        gram += found
    size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    kept = _most_visible(gram / size[:, None] / size)
    return tuple(name for k, name in enumerate(names) if k not in kept and gram[k, k] > 0.0)


def _beyond_start(sensitivity: Sensitivity, simulation: Simulation, record: FitRecord) -> FloatArray | None:
    """Return the Gram matrix (p, p) of the outputs' derivatives beyond the initial state's; None: it diverges."""
    values = sensitivity.current_values
    start = simulation.starting(record.stimulus, values)
    line = sensitivity.linearise(record, values[sensitivity.free] / sensitivity.scale, start)
    if line is None:
        return None
    weights = 1.0 / np.array([float(np.std(record.measured[name])) or 1.0 for name in sensitivity.outputs])
    samples = weights.size * line.shared.shape[2]  # not -1: there is no start where all states are fixed
    shared, local = ((one * weights[:, None]).reshape(len(one), samples) for one in (line.shared, line.local))
    if len(local):
        size = np.sqrt(np.sum(local**2, axis=1, keepdims=True))
        basis, strength, _ = np.linalg.svd((local / np.where(size > 0.0, size, 1.0)).T, full_matrices=False)
        basis = basis[:, strength > 1e-7 * strength[:1]]
        shared = shared - (shared @ basis) @ basis.T
    found: FloatArray = shared @ shared.T
    return found


def _most_visible(gram: FloatArray) -> set[int]:
    """Return the rows of a normalised Gram matrix that are no combination of others, the most visible ones first."""
    left, kept = gram.copy(), set[int]()
    for _ in range(len(gram)):
        rest = np.diag(left).copy()
        rest[list(kept)] = -np.inf
        k = int(np.argmax(rest))
        if not rest[k] > LEAST_SHARE:
            break
        kept.add(k)
        left = left - np.outer(left[:, k], left[k]) / left[k, k]
    return kept
