"""Parameters of a user's equations that the records cannot tell from the others: a fit leaves them where they are.

A level that no instrument reads can be traded against its coefficients. Along such a combination the outputs do not
change at all, and what a finite difference shows of it is rounding.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.subject import Records
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.simulation_error.sensitivity import Sensitivity

LEAST_SHARE = 1e-10
"""Share of a parameter's squared sensitivity beyond the other parameters and the initial states, below which the
records do not tell it: finite differences are right to 1e-6 of a derivative, 1e-12 of a square."""
HELD = (
    "these data cannot tell {} from the other parameters: {} and the others are right for that; fix a parameter that "
    "you know, or measure a further output, to choose which"
)


def describe_held(simulation: Any) -> list[str]:
    """Return a note on the parameters that a simulation of equations holds, although its file leaves them free."""
    own = zip(simulation.system.parameters, simulation.parameters, strict=False)
    held = [one for declared, one in own if one.fixed and not declared.fixed]
    if not held:
        return []
    values = " and ".join(f"{one.name} stays at {one.value:.4g} {one.unit}" for one in held)
    return [HELD.format(" and ".join(one.name for one in held), values)]


def undetermined_parameters(simulation: Simulation, records: Records, scales: Scales) -> tuple[str, ...]:
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
    shared, local = ((one * weights[:, None]).reshape(len(one), -1) for one in (line.shared, line.local))
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
