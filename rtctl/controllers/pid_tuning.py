"""PID gains from linear models of a plant at several working points, with a limit on the sensitivity of all.

Of the gains whose maximum sensitivities max |1/(1 + L)| and max |L/(1 + L)| stay below a bound at every working point,
and whose answer to the setpoint has no peak, those with the largest integral gain: the smallest error after a step of a
load. Plants are sampled exactly behind a zero-order hold.

Reference: K. J. Astrom, T. Hagglund, Advanced PID Control, sections 5.3 (setpoint) and 6.7 (MIGO).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import expm

from rtctl.border.arrays import ComplexArray, FloatArray
from rtctl.controllers.pid import PidGains
from rtctl.controllers.tuning import margins_of

ANGLES = np.concatenate((np.geomspace(1e-5, 0.3, 700), np.linspace(0.3, math.pi, 400)[1:]))
SETPOINT_PEAK = 1.05
"""Largest gain from the setpoint to the output, over all frequencies: more is an overshoot."""
DECAYS = 1e-9
"""Distance from the unit circle beyond which a pole decays."""
AT_REST = 1e-5
"""Distance from z = 1 within which a mode of the plant is at rest: slopes at a bend of a rate are not known better."""
CROSSOVERS = 48
INTEGRAL_SHARES = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.5, 2.5, 4.0, 12.0, 50.0)
"""1/(w Ti) at the crossover w."""
DERIVATIVE_SHARES = (0.0, 0.25, 0.5, 1.0, 2.0)
"""w Td at the crossover w."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkingPoint:
    """A plant x' = A x + b u, y = c x + d u around a working point, in units of its command and output."""

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PidTuning:
    """Gains, and their margins at the working point that has the least; both are 0 where the loop is unstable."""

    gains: PidGains
    maximum_sensitivity: float
    gain_margin: float
    phase_margin_deg: float
    crossover_hz: float
    units: tuple[str, str]
    """Units of command and output."""
    notes: tuple[str, ...] = ()

    def with_notes(self, notes: tuple[str, ...]) -> PidTuning:
        """Return the same with what a person must know."""
        return replace(self, notes=notes)

    def describe(self) -> str:
        """Return a sentence for a person."""
        return (
            f"PID: {self.gains.describe(*self.units)}; maximum sensitivity {self.maximum_sensitivity:.2f}, gain "
            f"margin {self.gain_margin:.2f}, phase margin {self.phase_margin_deg:.0f} deg, crossover "
            f"{self.crossover_hz:.3g} Hz" + "".join(f"; {note}" for note in self.notes)
        )


class _Sampled:
    """A working point behind a zero-order hold and a delay of whole periods."""

    def __init__(self, plant: WorkingPoint, period_s: float, delay: int) -> None:
        n = len(plant.b)
        whole = np.zeros((n + 1, n + 1))
        whole[:n, :n], whole[:n, n] = plant.a, plant.b
        moved = expm(whole * period_s)
        self.phi, self.gamma, self.c, self.d, self.delay = (
            moved[:n, :n],
            moved[:n, n],
            plant.c,
            plant.d,
            delay,
        )

    def response(self, angle: FloatArray) -> ComplexArray:
        """Return G(e^(j angle)); what is commanded now shows in the next reading."""
        z = np.exp(1j * angle)
        n = len(self.gamma)
        solved = np.linalg.solve(z[:, None, None] * np.eye(n) - self.phi, self.gamma[None, :, None])[..., 0]
        return np.asarray((solved @ self.c + self.d / z) * z**-self.delay)

    def is_stable(self, gains: PidGains, period_s: float) -> bool:
        """Return whether the closed loop decays, but for modes at rest that the command does not move.

        Equations with hysteresis rest wherever they were left: a mode of the plant at z = 1 that stays in the loop.
        """
        import control

        plant = control.ss(self.phi, self.gamma[:, None], self.c[None, :], 0.0, period_s)
        wire = control.tf([1.0], [1.0] + [0.0] * self.delay, period_s)
        poles = control.feedback(control.ss(wire) * discrete_pid(gains, period_s) * plant, 1).poles()
        lasting = poles[np.abs(poles) >= 1.0 - DECAYS]
        own = np.linalg.eigvals(self.phi)
        at_rest = own[np.abs(own - 1.0) < AT_REST]
        return len(lasting) <= len(at_rest) and bool(np.all(np.abs(lasting - 1.0) < AT_REST))


def discrete_pid(gains: PidGains, period_s: float) -> Any:
    """Return a PID from the error to the command, as a system of the control package."""
    import control

    made = control.tf([gains.kp + gains.ki * period_s, -gains.kp], [1.0, -1.0], period_s)
    if gains.kd != 0.0:
        filter_s = gains.filter_s
        made = made + control.tf([gains.kd, -gains.kd], [filter_s + period_s, -filter_s], period_s)
    return control.ss(made)


def pid_response(gains: PidGains, z: ComplexArray, period_s: float) -> ComplexArray:
    """Return the response of a PID from the error to the command at points `z`."""
    step = 1.0 - 1.0 / z
    filtered = gains.kd * step / (gains.filter_s + period_s - gains.filter_s / z) if gains.kd != 0.0 else 0.0
    return np.asarray(gains.kp + gains.ki * period_s / step + filtered)


def _setpoint_part(gains: PidGains, weight: float, z: ComplexArray, period_s: float) -> ComplexArray:
    """Return the controller from the setpoint to the command."""
    return np.asarray(weight * gains.kp + gains.ki * period_s / (1.0 - 1.0 / z))


def margins_of_gains(
    gains: PidGains, plants: Sequence[WorkingPoint], *, period_s: float, delay: int, units: tuple[str, str]
) -> PidTuning:
    """Return the margins of given gains at the working point that has the largest sensitivity.

    Args:
        gains: Gains in units of command and output.
        plants: Plant at each working point.
        period_s: Sample period [s].
        delay: Periods between a command and the first reading that knows of it, beyond one.
        units: Units of command and output.
    """
    sampled = [_Sampled(one, period_s, delay) for one in plants]
    responses = [one.response(ANGLES) for one in sampled]
    loops = [pid_response(gains, np.exp(1j * ANGLES), period_s) * one for one in responses]
    peaks = [
        float(np.max(1.0 / np.abs(1.0 + loop))) if one.is_stable(gains, period_s) else math.inf
        for one, loop in zip(sampled, loops, strict=True)
    ]
    worst = int(np.argmax(peaks))
    stable = math.isfinite(peaks[worst])
    gain_margin, phase_margin, crossover = margins_of(loops[worst], ANGLES, stable=stable)
    if not stable:
        gain_margin = phase_margin = 0.0
    return PidTuning(
        gains=gains,
        maximum_sensitivity=peaks[worst],
        gain_margin=gain_margin,
        phase_margin_deg=phase_margin,
        crossover_hz=crossover / (2.0 * math.pi * period_s),
        units=units,
    )


def tune_pid(
    plants: Sequence[WorkingPoint],
    *,
    period_s: float,
    delay: int,
    maximum_sensitivity: float,
    setpoint_weight: float,
    units: tuple[str, str],
) -> PidTuning:
    """Return the PID with the largest integral gain whose sensitivity stays below a bound at every working point.

    Args:
        plants: Plant at each working point.
        period_s: Sample period [s].
        delay: Periods between a command and the first reading that knows of it, beyond one.
        maximum_sensitivity: Bound of both sensitivities, > 1.
        setpoint_weight: Share of the setpoint in the proportional term.
        units: Units of command and output.

    Raises:
        ValueError: No gain tried keeps the bound, or the plants' gains have different signs.
    """
    sampled = [_Sampled(one, period_s, delay) for one in plants]
    gains = best_gains(
        np.array([one.response(ANGLES) for one in sampled]),
        lambda gains: all(one.is_stable(gains, period_s) for one in sampled),
        period_s=period_s, maximum_sensitivity=maximum_sensitivity, setpoint_weight=setpoint_weight,
    )  # fmt: skip
    return margins_of_gains(gains, plants, period_s=period_s, delay=delay, units=units)


def best_gains(
    responses: ComplexArray,
    accepts: Callable[[PidGains], bool],
    *,
    period_s: float,
    maximum_sensitivity: float,
    setpoint_weight: float,
) -> PidGains:
    """Return the largest integral gain that keeps a bound with every response, and that `accepts` takes.

    Args:
        responses: Responses (m, angles) of plants at `ANGLES`.
        accepts: What else is asked of gains, such as that the loop is stable.
        period_s: Sample period [s].
        maximum_sensitivity: Bound of both sensitivities, > 1.
        setpoint_weight: Share of the setpoint in the proportional term.

    Raises:
        ValueError: No gain tried keeps the bound, or the plants' gains have different signs.
    """
    sign = _common_sign(responses)
    z = np.exp(1j * ANGLES)
    found = sorted(_candidates(responses, sign, period_s), key=lambda one: -abs(one.ki))
    for gains in found:
        loops = pid_response(gains, z, period_s) * responses
        away = np.abs(1.0 + loops)
        toward = np.abs(_setpoint_part(gains, setpoint_weight, z, period_s) * responses)
        if max(np.max(1.0 / away), np.max(np.abs(loops) / away)) > maximum_sensitivity:
            continue
        if np.max(toward / away) > SETPOINT_PEAK:
            continue
        if accepts(gains):
            return gains
    raise ValueError(
        f"no PID keeps a maximum sensitivity of {maximum_sensitivity:g} at all working points; allow more, narrow the "
        "output's range, or give kp, ki and kd"
    )


def _common_sign(responses: ComplexArray) -> float:
    """Return the sign of the plants' gains at the lowest frequency, by the slope there of an integrating one."""
    signs = []
    for response in responses:
        turned = response[0] * np.exp(0.5j * math.pi * np.round(_integrators(response)))
        signs.append(math.copysign(1.0, turned.real))
    if len(set(signs)) > 1:
        raise ValueError(
            "the output grows with the command at one end of its range and falls at the other; narrow the range"
        )
    return signs[0]


def _integrators(response: ComplexArray) -> float:
    """Return how many integrators a response has: its slope over frequency at the lowest ones."""
    low = np.abs(response[:2])
    return (
        float(max(0.0, math.log(low[0] / low[1]) / math.log(ANGLES[1] / ANGLES[0])))
        if low.min() > 0.0
        else 0.0
    )


def _candidates(responses: ComplexArray, sign: float, period_s: float) -> list[PidGains]:
    """Return gains for crossovers at all frequencies up to a third of half the sample rate, with all shares."""
    found = []
    for angle in np.geomspace(1e-4, 1.2, CROSSOVERS):
        k = int(np.searchsorted(ANGLES, angle))
        size = float(np.abs(responses[:, k]).max())
        rate = ANGLES[k] / period_s
        if not (math.isfinite(size) and size > 0.0):
            continue
        for integral in INTEGRAL_SHARES:
            for derivative in DERIVATIVE_SHARES:
                unit = PidGains(kp=1.0, ki=integral * rate, kd=derivative / rate)
                at = abs(pid_response(unit, np.exp(1j * ANGLES[k : k + 1]), period_s)[0])
                scale = sign / (size * at)
                found.append(PidGains(kp=scale, ki=scale * unit.ki, kd=scale * unit.kd))
    return found
