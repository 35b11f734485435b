"""One fused kernel of the ME resonator: oscillator that drives the coil, coil, magnetisation, beam, lock-in sums.

    theta' = omega                                          the drive's phase, continuous when omega changes
    L i' = R (i_cmd cos theta - i)                          coil current i [A]: it lags, and is smaller
    M = Ms (coth a - 1/a),   a = 3 chi H / Ms,   H = B/mu0  Langevin; chi is the initial susceptibility
    z'' + c z' + k z + k3 z^3 + k5 z^5 = g M                z [um], mass-normalised

State order: i, z, v = z'; classical Runge-Kutta. The steps lie on a grid of the *phase*, `STEPS` a cycle, whatever
omega is; where a hold ends between two grid points a shorter step goes there and another one on to the grid. So a
cycle of the drive always consists of the same `STEPS` phases, and the sums over it

    Z = (2/N) sum z_j exp(-i theta_j),   z = Re[Z exp(i theta)],   likewise I of the current

are its Fourier coefficients: DC and every harmonic up to N - 2 drop out exactly (2 omega among them), also in a cycle
during which the frequency is changed. The lock-in's output is the mean over all whole cycles since the last reading:
the whole number of cycles nearest below the sample period, or above it by the part that the reading before left over.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from plant_sim.kernels import Record, compiled

Array = NDArray[np.void]
Floats = NDArray[np.float64]

STEPS = 80
"""Steps in a cycle of the drive: 64 in a period of the beam where it is driven a fifth below its resonance."""
SERIES_BELOW = 0.3
"""Argument below which Langevin's function is a series: coth a - 1/a loses digits; exact to 4e-9."""

PARAMETERS = np.dtype([(name, np.float64) for name in (
    "rate",  # R/L [1/s]
    "argument",  # a of a current of 1 A
    "force",  # g Ms [um/s^2]
    "damping", "stiffness", "cubic", "quintic",  # c, k, k3, k5 with z in um
    "broken_above",  # |z| [um] at which the model ends
)])  # fmt: skip
STATE = np.dtype(
    [
        ("current", np.float64),  # A
        ("displacement", np.float64),  # um
        ("velocity", np.float64),  # um/s
        ("index", np.int64),  # grid points passed in this cycle
        ("part", np.float64),  # of a step behind that grid point, in phase
        ("diverged", np.int64),
        ("cycle", np.float64, (4,)),  # sums over the cycle under way: z cos, z sin, i cos, i sin
        ("window", np.float64, (4,)),  # of whole cycles since the last reading
        ("cycles", np.int64),  # how many
        ("window_s", np.float64),  # and how long
    ]
)


@compiled
def langevin(a: float) -> float:
    """Return coth a - 1/a."""
    if abs(a) < SERIES_BELOW:
        s = a * a
        return a * (1.0 / 3.0 - s * (1.0 / 45.0 - s * (2.0 / 945.0 - s / 4725.0)))
    return 1.0 / math.tanh(a) - 1.0 / a


@compiled
def slopes(p: Record, i: float, z: float, v: float, voltage: float) -> tuple[float, float]:
    """Return i' [A/s] and v' [um/s^2]; `voltage` as the current [A] that it would drive at rest."""
    s = z * z
    force = p.force * langevin(p.argument * i)
    return p.rate * (voltage - i), force - p.damping * v - z * (p.stiffness + s * (p.cubic + s * p.quintic))


# 8 parameters because the state and three voltages are plain numbers, which a kernel keeps in registers
@compiled
def rk4(  # noqa: PLR0913
    p: Record, i: float, z: float, v: float, h: float, start: float, middle: float, end: float
) -> tuple[float, float, float]:
    """Take one step of `h` [s]; return the state.

    Not the integrator of `plant_sim.oscillator`: that one is a template over lanes whose state is displacement and
    velocity, and may contract a*b + c; this one has a current as a third state and a fixed arithmetic.

    Args:
        p: parameters.
        i: current [A].
        z: displacement [um].
        v: velocity [um/s].
        h: step [s].
        start: voltage at the start of the step, as a current [A].
        middle: the same in the middle.
        end: the same at the end.
    """
    i1, v1 = slopes(p, i, z, v, start)
    z2 = v + 0.5 * h * v1
    i2, v2 = slopes(p, i + 0.5 * h * i1, z + 0.5 * h * v, z2, middle)
    z3 = v + 0.5 * h * v2
    i3, v3 = slopes(p, i + 0.5 * h * i2, z + 0.5 * h * z2, z3, middle)
    z4 = v + h * v3
    i4, v4 = slopes(p, i + h * i3, z + h * z3, z4, end)
    sixth = h / 6.0
    return (
        i + sixth * (i1 + 2.0 * (i2 + i3) + i4),
        z + sixth * (v + 2.0 * (z2 + z3) + z4),
        v + sixth * (v1 + 2.0 * (v2 + v3) + v4),
    )


@compiled
def step_part(p: Record, s: Record, current: float, h: float, part: float) -> None:
    """Take a step of `part` of a grid step (`h` [s]) from where the state stands, without sums."""
    width = 2.0 * math.pi / STEPS
    at = width * (s.index + s.part)
    start, middle = math.cos(at), math.cos(at + 0.5 * width * part)
    end = math.cos(at + width * part)
    s.current, s.displacement, s.velocity = rk4(
        p, s.current, s.displacement, s.velocity, part * h, current * start, current * middle, current * end
    )


@compiled
def pass_grid_point(p: Record, s: Record, cosine: float, sine: float, period_s: float) -> None:
    """Add one more grid point to the sums; at a cycle's end they move on, and divergence is checked."""
    s.index += 1
    s.part = 0.0
    s.cycle[0] += s.displacement * cosine
    s.cycle[1] += s.displacement * sine
    s.cycle[2] += s.current * cosine
    s.cycle[3] += s.current * sine
    if s.index == STEPS:
        s.index = 0
        for k in range(4):
            s.window[k] += s.cycle[k] * 2.0 / STEPS
            s.cycle[k] = 0.0
        s.cycles += 1
        s.window_s += period_s
        if not abs(s.displacement) + abs(s.velocity) / math.sqrt(p.stiffness) < p.broken_above:
            s.diverged = 1


@compiled
def hold(
    parameters: Array, state: Array, waves: Floats, current_A: float, frequency_hz: float, dt_s: float
) -> None:
    """Hold a current amplitude and a frequency.

    Args:
        parameters: (1,) of `PARAMETERS`.
        state: (1,) of `STATE`, advanced in place.
        waves: from `half_grid`.
        current_A: amplitude of the command [A].
        frequency_hz: frequency [Hz], > 0.
        dt_s: how long they are held [s].
    """
    p, s = parameters[0], state[0]
    h = 1.0 / (frequency_hz * STEPS)
    left = dt_s / h  # in grid steps
    while left > 1e-9 and s.diverged == 0:
        part = min(1.0 - s.part, left)
        if s.part == 0.0 and left >= 1.0:
            k = 2 * s.index
            s.current, s.displacement, s.velocity = rk4(
                p, s.current, s.displacement, s.velocity, h,
                current_A * waves[k, 0], current_A * waves[k + 1, 0], current_A * waves[k + 2, 0],
            )  # fmt: skip
        else:
            step_part(p, s, current_A, h, part)
        left -= part
        s.part += part
        if s.part >= 1.0 - 1e-9:
            k = 2 * (s.index + 1)
            pass_grid_point(p, s, waves[k, 0], waves[k, 1], STEPS * h)


@compiled
def demodulated(state: Array, phasors: Floats) -> float:
    """Write mean Z and I [um, A] of the whole cycles since the last call to `phasors` (re Z, im Z, re I, im I).

    Returns:
        Their duration [s]; 0 if no cycle has ended, `phasors` stays as it is then.
    """
    s = state[0]
    if s.cycles == 0:
        return 0.0
    phasors[0], phasors[1] = s.window[0] / s.cycles, -s.window[1] / s.cycles
    phasors[2], phasors[3] = s.window[2] / s.cycles, -s.window[3] / s.cycles
    duration_s: float = s.window_s
    for k in range(4):
        s.window[k] = 0.0
    s.cycles = 0
    s.window_s = 0.0
    return duration_s


def half_grid() -> Floats:
    """Return cosine and sine (2 STEPS + 1, 2) at grid points and halfway between them, over one cycle."""
    theta = np.pi * np.arange(2 * STEPS + 1) / STEPS
    return np.column_stack((np.cos(theta), np.sin(theta)))
