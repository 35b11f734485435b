"""In which directions the outputs would move if an effect began to act: of each mechanism, and of forces of no name.

A direction is a derivative at the neutral value, by simulation: no measured signal is differentiated. Those of the
catalogue have a name to claim. Generic forces act where the drive does, phi(z, v, u, t) along the simulated motion;
they catch what is in no catalogue and say along which coordinate it lives.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.mechanisms import Mechanism, Scales
from rtctl.border.simulation import FreeParameter, Simulation, Stimulus
from rtctl.diagnosis.hypothesis import Data, Hypothesis

FloatArray = NDArray[np.float64]
STEP = 1e-4
"""Of a parameter's scale: friction and deadbands have no derivative at 0, only a slope over a small step."""
SHAPES = 4
"""Values of a shape that are tried, evenly in its logarithm."""


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


def catalogue_directions(simulation: Simulation, ids: tuple[str, ...], scales: Scales) -> list[Direction]:
    """Of every mechanism in `ids` that the model does not have yet, amplitude by amplitude, shape by shape."""
    found = []
    for identity in ids:
        extended = simulation.extended((identity,))
        mechanism = extended.mechanisms[-1]
        units = {p.declared.name: p for p in extended.parameters if p.mechanism == identity}
        for shapes in _shape_grid(mechanism, scales):
            for amplitude in mechanism.amplitudes:
                size = _size(units[amplitude.name], scales)
                found.append(Direction(identity, amplitude.name, "", shapes, size))
    return found


def _shape_grid(mechanism: Mechanism, scales: Scales) -> Iterator[dict[str, float]]:
    """Shapes with a default stay there; the others are searched."""
    axes = {}
    for parameter in mechanism.parameters:
        if not parameter.is_shape:
            continue
        if parameter.default is not None:
            axes[parameter.name] = [parameter.default]
        else:
            low, high = parameter.shape_range
            size = abs(parameter.scale(scales)) or 1.0
            axes[parameter.name] = [size * factor for factor in np.geomspace(low, high, SHAPES).tolist()]
    for values in itertools.product(*axes.values()):
        yield dict(zip(axes, values, strict=True))


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
    """(directions, outputs, n) of record `index`, all of one mechanism."""
    identity = directions[0].mechanism
    simulation = hypothesis.simulation.extended((identity,))
    at = {p.declared.name: k for k, p in enumerate(simulation.parameters) if p.mechanism == identity}
    base = np.array([parameter.value for parameter in simulation.parameters])
    lanes = np.tile(base, (2 * len(directions), 1))
    for k, direction in enumerate(directions):
        for name, value in direction.shapes.items():
            lanes[2 * k : 2 * k + 2, at[name]] = value
        lanes[2 * k + 1, at[direction.name]] += STEP * direction.scale
    record = data.records[index]
    run = simulation.predict(
        record.stimulus, lanes, np.tile(hypothesis.starts[index], (len(lanes), 1)), data.steps_per_period
    )
    outputs = np.stack(
        [run.outputs[name][:, record.first :] for name in hypothesis.sensitivity.outputs], axis=1
    )
    slopes: FloatArray = np.nan_to_num((outputs[1::2] - outputs[::2]) / STEP)
    return slopes


def generic_directions() -> list[Direction]:
    """The forces of no name."""
    return [Direction("", name, coordinate, {}, 1.0) for name, coordinate, _ in GENERIC]


def generic_slopes(hypothesis: Hypothesis, data: Data, index: int) -> FloatArray:
    """(generic forces, outputs, n) of record `index`, each as strong as the drive's own force."""
    record = data.records[index]
    values = hypothesis.values
    start = np.atleast_2d(hypothesis.starts[index])
    base = hypothesis.simulation.predict(record.stimulus, values, start, data.steps_per_period)
    scales, u = data.scales, record.stimulus.inputs["drive"]
    z = base.outputs["displacement"][0] / scales.displacement
    v = base.outputs["velocity"][0] / scales.velocity
    t = np.linspace(-1.0, 1.0, record.samples)
    slopes = []
    for _, _, force in GENERIC:
        phi = force(z, v, u / (scales.drive or 1.0), t)
        pushed = u + STEP * (scales.drive or 1.0) * phi
        stimulus = Stimulus(
            inputs={"drive": pushed}, holds=record.stimulus.holds, period_s=record.period_s,
            initial=record.stimulus.initial, peak=record.stimulus.peak,
        )  # fmt: skip
        run = hypothesis.simulation.predict(stimulus, values, start, data.steps_per_period)
        slopes.append(
            [
                (run.outputs[n] - base.outputs[n])[0, record.first :] / STEP
                for n in hypothesis.sensitivity.outputs
            ]
        )
    made: FloatArray = np.nan_to_num(np.array(slopes))
    return made
