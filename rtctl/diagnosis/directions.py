"""In which directions the outputs would move if an effect began to act: of each mechanism, and of forces of no name.

A direction is a derivative at the neutral value, by simulation: no measured signal is differentiated. Those of the
catalogue have a name to claim. Generic forces act where the drive does, phi(z, v, u, t) along the simulated motion;
they catch what is in no catalogue and say along which coordinate it lives.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import FreeParameter, Simulation
from rtctl.diagnosis.hypothesis import Data, Hypothesis, rms
from rtctl.diagnosis.shapes import shape_grid

FloatArray = NDArray[np.float64]
STEP = 1e-4
"""Of a parameter's scale: friction and deadbands have no derivative at 0, only a slope over a small step."""
STEPS = (STEP, 1e-7)
"""The second where the first lets the motion escape or turn chaotic."""
LARGEST_MOVE = 0.3
"""Of the outputs' RMS, by one step."""


class Direction(NamedTuple):
    """One way to depart from a hypothesis."""

    mechanism: str
    """Id, or "" for a generic force."""
    name: str
    """Parameter that moves, or the force."""
    coordinate: str
    """Along which a generic force lives; "" for a mechanism."""
    shapes: Mapping[str, float]
    scale: float
    """Size of one unit along it: parameter = scale x step."""
    record: int = -1
    """Of which it is the own; `ALL`: of all."""
    trials: int = 1
    """From how many shapes the data chose this one."""


ALL = -1


GENERIC: tuple[tuple[str, str, Callable[..., FloatArray]], ...] = (
    ("z^2", "displacement", lambda z, v, u, t: z**2),
    ("z^3", "displacement", lambda z, v, u, t: z**3),
    ("z^5", "displacement", lambda z, v, u, t: z**5),
    ("|z|", "displacement", lambda z, v, u, t: np.abs(z)),
    ("sign z", "displacement", lambda z, v, u, t: np.tanh(10.0 * z)),
    ("v |v|", "velocity", lambda z, v, u, t: v * np.abs(v)),
    ("v^3", "velocity", lambda z, v, u, t: v**3),
    ("v^2", "velocity", lambda z, v, u, t: v**2),
    ("sign v", "velocity_sign", lambda z, v, u, t: np.tanh(20.0 * v)),
    ("z^2 v", "amplitude", lambda z, v, u, t: z**2 * v),
    ("z v", "state", lambda z, v, u, t: z * v),
    ("v^2 z", "amplitude", lambda z, v, u, t: v**2 * z),
    ("1", "drive", lambda z, v, u, t: np.ones_like(z)),
    ("u^2", "drive", lambda z, v, u, t: u**2),
    ("u^3", "drive", lambda z, v, u, t: u**3),
    ("du", "drive_rate", lambda z, v, u, t: np.gradient(u)),
    ("u z", "drive", lambda z, v, u, t: u * z),
    ("u v", "drive", lambda z, v, u, t: u * v),
    ("t z", "time", lambda z, v, u, t: t * z),
    ("t v", "time", lambda z, v, u, t: t * v),
    ("t u", "time", lambda z, v, u, t: t * u),
    ("t", "time", lambda z, v, u, t: t),
)


def catalogue_directions(
    simulation: Simulation, ids: tuple[str, ...], data: Data, residuals: Sequence[FloatArray]
) -> list[Direction]:
    """Of every mechanism in `ids` that the model does not have yet, amplitude by amplitude, shape by shape."""
    found = []
    for identity in ids:
        extended = simulation.extended((identity,))
        mechanism = extended.mechanisms[-1]
        units = {p.declared.name: p for p in extended.parameters if p.mechanism == identity}
        for shapes, trials in shape_grid(mechanism, data, residuals):
            for amplitude in mechanism.amplitudes:
                size = _size(units[amplitude.name], data.scales)
                records = range(len(data.records)) if amplitude.of_record else (ALL,)
                found += [
                    Direction(identity, amplitude.name, "", shapes, size, record, trials)
                    for record in records
                ]
    return found


def _size(parameter: FreeParameter, scales: Scales) -> float:
    with np.errstate(all="ignore"):
        try:
            size = abs(float(parameter.declared.scale(scales)))
        except ZeroDivisionError:
            size = 0.0
    return size if np.isfinite(size) and size > 0.0 else 1.0


def mechanism_slopes(
    hypothesis: Hypothesis, directions: list[Direction], data: Data, index: int
) -> FloatArray:
    """(directions, outputs, n) of record `index`, all of one mechanism; zero where it is another record's own."""
    identity = directions[0].mechanism
    simulation = hypothesis.simulation.extended((identity,))
    at = {p.declared.name: k for k, p in enumerate(simulation.parameters) if p.mechanism == identity}
    neutral = [p.value for p in simulation.parameters[len(hypothesis.simulation.parameters) :]]
    base = np.append(hypothesis.values_of(index), neutral)
    record = data.records[index]
    outputs = hypothesis.sensitivity.outputs
    slopes = np.zeros((len(directions), len(outputs), record.samples - record.first))
    left = [k for k, direction in enumerate(directions) if direction.record in (ALL, index)]
    for step in STEPS:
        lanes = np.tile(base, (1 + len(left), 1))
        for lane, k in enumerate(left, 1):
            for name, value in directions[k].shapes.items():
                lanes[lane, at[name]] = value
            lanes[lane, at[directions[k].name]] += step * directions[k].scale
        start = np.tile(hypothesis.start(index), (len(lanes), 1))
        run = simulation.predict(record.stimulus, lanes, start, data.steps_per_period)
        moved = np.stack([run.outputs[name][:, record.first :] for name in outputs], axis=1)
        moved = moved[1:] - moved[0]
        tame = _tame(moved, data, outputs)
        slopes[[k for k, good in zip(left, tame, strict=True) if good]] = moved[tame] / step
        left = [k for k, good in zip(left, tame, strict=True) if not good]
        if not left:
            break
    return slopes


def _tame(moved: FloatArray, data: Data, outputs: Sequence[str]) -> NDArray[np.bool_]:
    """(lanes,) of which differences (lanes, outputs, n) are small beside the motion: a derivative, not an escape."""
    sizes = np.array([rms(data.records, name) for name in outputs])
    with np.errstate(invalid="ignore", over="ignore"):
        largest = np.abs(moved).max(axis=2) / sizes
        tame: NDArray[np.bool_] = (largest < LARGEST_MOVE).all(axis=1)
    return tame


def generic_directions() -> list[Direction]:
    """The forces of no name."""
    return [Direction("", name, coordinate, {}, 1.0) for name, coordinate, _ in GENERIC]


def generic_slopes(hypothesis: Hypothesis, data: Data, index: int) -> FloatArray:
    """(generic forces, outputs, n) of record `index`, each as strong as the drive's own force."""
    record = data.records[index]
    values = hypothesis.values_of(index)
    start = np.atleast_2d(hypothesis.start(index))
    base = hypothesis.simulation.predict(record.stimulus, values, start, data.steps_per_period)
    scales, u = data.scales, record.stimulus.inputs["drive"]
    z = base.outputs["displacement"][0] / scales.displacement
    v = base.outputs["velocity"][0] / scales.velocity
    t = np.linspace(-1.0, 1.0, record.samples)
    outputs = hypothesis.sensitivity.outputs
    slopes = np.zeros((len(GENERIC), len(outputs), record.samples - record.first))
    for k, (_, _, force) in enumerate(GENERIC):
        phi = force(z, v, u / (scales.drive or 1.0), t)
        for step in STEPS:
            stimulus = replace(record.stimulus, inputs={"drive": u + step * (scales.drive or 1.0) * phi})
            run = hypothesis.simulation.predict(stimulus, values, start, data.steps_per_period)
            moved = np.array([(run.outputs[n] - base.outputs[n])[:, record.first :] for n in outputs])
            if _tame(moved.swapaxes(0, 1), data, outputs)[0]:
                slopes[k] = moved[:, 0] / step
                break
    return slopes
