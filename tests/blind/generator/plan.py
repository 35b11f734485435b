"""A device with effects switched on, and one record of it: all that a noise-free output depends on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .equation import S_D, S_Q, S_S, P, slots, static_force
from .holds import NODES, drive_at_nodes, sample_grid
from .integrator import cubic_coefficients, integrate

FloatArray = NDArray[np.float64]
Static = Callable[[FloatArray], FloatArray]
Reading = Callable[[FloatArray, FloatArray], FloatArray]
"""(reading, time since the start of the record's file) -> reading"""
Jumps = Callable[[int, int], FloatArray]
"""(record's number, samples) -> relative change of stiffness in each sample"""


@dataclass(frozen=True, kw_only=True)
class Input:
    """One record before anything has moved, dimensionless."""

    number: int
    """Repeats share it."""
    excitation: str
    use: str
    drive: FloatArray
    displaced: float
    """Initial displacement from rest (ring-down), else 0."""
    file_start: int = 0
    """Samples of the same file before it: mains hum runs on over slices."""
    file_number: int = 0


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The truth of one case, dimensionless; effects are set on copies of it."""

    parameters: FloatArray
    hold: str
    """What truly acts between samples."""
    samples_a_period: float
    rest: float
    """Where the device rests without drive (a well, for a bistable one)."""
    delay: float = 0.0
    """Of the drive, in 1/omega0."""
    drive: tuple[Static, ...] = field(default=())
    reading: tuple[Callable[[Input, FloatArray, FloatArray], FloatArray], ...] = field(default=())
    jumps: Jumps | None = None
    push: Callable[[Input, FloatArray], FloatArray] | None = None
    """Force of no drive, of the record and the time since its start."""
    finer: int = 1
    """Times as many steps as usual, for an effect that is over within one."""

    @property
    def sample_time(self) -> float:
        """In 1/omega0."""
        return 2 * np.pi / self.samples_a_period

    def having(self, **values: float) -> Plan:
        """A copy with parameters of the equation set, by their names in P."""
        parameters = self.parameters.copy()
        for name, value in values.items():
            parameters[P[name]] = value
        return replace(self, parameters=parameters)


class LeftDeviceError(Exception):
    """The motion ran away: this case cannot be measured."""


def resting_place(plan: Plan, drive_at_rest: float) -> float:
    """Nearest equilibrium to `plan.rest` with effects and no commanded drive: found by Newton's method."""
    p = plan.parameters
    force = p[P.G] * drive_at_rest
    y = plan.rest
    for _ in range(60):
        width = 1e-6
        slope = (static_force(y + width, p) - static_force(y - width, p)) / (2 * width)
        slope += p[P.PAR] * drive_at_rest + p[P.FEEDBACK]
        slope = slope or 1.0  # inside free play there is none
        change = (static_force(y, p) + (p[P.PAR] * drive_at_rest + p[P.FEEDBACK]) * y - force) / slope
        y -= float(np.clip(change, -0.5, 0.5))
        if abs(change) < 1e-12:
            break
    return float(y)


def simulate(
    plan: Plan, record: Input, samples: int | None = None, nudge: float = 0.0
) -> tuple[FloatArray, float]:
    """Noise-free reading of the displacement sensor and the true initial displacement.

    `samples` cuts the record short, `nudge` is added to the initial displacement. The device rests in its equilibrium
    before the record (memories relaxed there), displaced by `record.displaced` and let go.
    """
    u = record.drive[:samples]
    delay = plan.delay / plan.sample_time
    grid = sample_grid(plan.samples_a_period, delay, plan.finer)
    nodes = drive_at_nodes(u, plan.hold, grid, delay)
    idle = np.zeros(1)
    for static in plan.drive:
        nodes = static(nodes)
        idle = static(idle)
    p = plan.parameters
    if plan.push is not None:
        inside = grid.begin[:, None] + grid.length[:, None] * NODES
        t_nodes = (np.arange(u.size - 1)[:, None, None] + inside[None]) * plan.sample_time
        nodes = nodes + plan.push(record, t_nodes) / p[P.G]
    slot = slots(p)
    start = np.zeros(slot[0])
    start[0] = resting_place(plan, float(idle[0])) + record.displaced + nudge
    seen = start[0]
    if slot[S_D] >= 0:
        start[slot[S_D]] = idle[0]
    if slot[S_Q] >= 0:
        attached = p[P.MODE_MASS] != 0.0
        start[slot[S_Q]] = start[0] if attached else p[P.MODE_GAIN] * idle[0] / p[P.MODE_W2]
        seen += 0.0 if attached else start[slot[S_Q]]
    if slot[S_S] >= 0:
        start[slot[S_S]] = seen
    softer = np.zeros(u.size) if plan.jumps is None else plan.jumps(record.number, u.size)
    y, v = np.empty(u.size), np.empty(u.size)
    steps = grid.length * plan.sample_time
    if not integrate(p, slot, start, cubic_coefficients(nodes), steps, softer, y, v):
        raise LeftDeviceError
    t = (record.file_start + np.arange(u.size)) * plan.sample_time
    for reading in plan.reading:
        y = reading(record, y, t)
    return y, float(start[0])
