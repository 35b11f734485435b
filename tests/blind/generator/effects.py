"""Every oscillator id of formats.md section 5 as the textbooks have it: shape drawn from the seed, amplitude `a` free.

Dimensionless as in equation.py: z and z' are about 1 in rms, u about 1. Each function draws a shape and returns a
Recipe whose `apply(plan, a)` switches the effect on and whose `sizes(a)` names its parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .plan import FloatArray, Input, Plan

Sizes = dict[str, tuple[float, int, int, int]]
"""Name -> (value, powers of length, time and drive in its unit)."""


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """What a draw may depend on."""

    bistable: bool
    well: float
    sample_time: float
    longest: float
    """Time of the longest record."""
    omega0: float
    """rad/s: mains hum has its own frequency."""
    manifest_hold: str
    variant: str | None
    radian: float = np.nan
    """One radian, in L, of a device whose displacement is an angle."""


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """One effect with its shape drawn."""

    id: str
    place: str
    """stiffness | dissipation | mode | drive | sensor: two effects of a pair act at different places."""
    apply: Callable[[Plan, float], Plan]
    sizes: Callable[[float], Sizes]
    variant: str = "usual"
    guess: float = 0.05
    largest: float = 50.0


Draw = Callable[[np.random.Generator, Surroundings], Recipe]


def _on(key: str, name: str, powers: tuple[int, int, int], sign: float = 1.0) -> dict[str, Any]:
    """Apply and sizes of an effect that is one parameter of the equation."""
    return {
        "apply": lambda plan, a: plan.having(**{key: sign * a}),
        "sizes": lambda a: {name: (sign * a, *powers)},
    }


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def stiffness_quadratic(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """z'' + ... + k2 z^2: a spring that is not the same in tension and compression."""
    on = _on("K2", "stiffness_quadratic", (-1, -2, 0), _sign(rng))
    return Recipe(id="stiffness.quadratic", place="stiffness", **on)


def stiffness_cubic(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """z'' + ... + k3 z^3 where the nominal model has none: Duffing, hardening twice as often as softening."""
    on = _on("K3", "stiffness_cubic", (-2, -2, 0), 1.0 if rng.random() < 0.67 else -1.0)
    return Recipe(id="stiffness.cubic", place="stiffness", **on)


def stiffness_quintic(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """z'' + ... + k5 z^5."""
    on = _on("K5", "stiffness_quintic", (-4, -2, 0), 1.0 if rng.random() < 0.67 else -1.0)
    return Recipe(id="stiffness.quintic", place="stiffness", guess=0.01, **on)


def stiffness_parametric(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """z'' + ... + (k + p u) z: the drive modulates the stiffness (delta-E effect; Mathieu)."""
    on = _on("PAR", "stiffness_a_drive", (0, -2, -1), _sign(rng))
    return Recipe(id="stiffness.parametric", place="stiffness", **on)


def stiffness_drift(rng: np.random.Generator, around: Surroundings) -> Recipe:
    """z'' + ... + k (1 + r t) z, t from each record's start: the device warms up in each run."""
    sign = _sign(rng)
    return Recipe(
        id="stiffness.drift",
        place="stiffness",
        apply=lambda plan, a: plan.having(DRIFT=sign * a / around.longest),
        sizes=lambda a: {"relative_rate": (sign * a / around.longest, 0, -1, 0)},
    )


def stiffness_viscoelastic(rng: np.random.Generator, around: Surroundings) -> Recipe:
    """z'' + ... + k z + k1 e, e' = z' - e/tau: a Maxwell arm beside the spring (standard linear solid)."""
    rate = float(np.exp(rng.uniform(np.log(0.05), np.log(1.5))))
    return Recipe(
        id="stiffness.viscoelastic",
        place="stiffness",
        apply=lambda plan, a: plan.having(VE=a, VE_RATE=rate),
        sizes=lambda a: {"stiffness_relaxing": (a, 0, -2, 0), "relaxation_time": (1 / rate, 0, 1, 0)},
    )


def damping_nonlinear(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """z'' + ... + c2 z^2 z': van der Pol's term, positive."""
    on = _on("CN", "damping_nonlinear", (-2, -1, 0))
    return Recipe(id="damping.nonlinear", place="dissipation", guess=0.02, **on)


def damping_quadratic(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """z'' + ... + cq |z'| z': drag in a fluid."""
    on = _on("CQ", "damping_quadratic", (-1, 0, 0))
    return Recipe(id="damping.quadratic", place="dissipation", guess=0.02, **on)


def friction_coulomb(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """z'' + ... + F sign(z'); at z' = 0 it holds anything up to F: the device sticks."""
    on = _on("FRICTION", "level", (1, -2, 0))
    return Recipe(id="friction.coulomb", place="dissipation", guess=0.02, **on)


def hysteresis_bouc_wen(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """z'' + ... + kh h, h' = z' - beta |z'| h - gamma z' |h| (A = 1, n = 1); h saturates at 1/(beta + gamma)."""
    yields, beta = rng.uniform(0.15, 1.2), rng.uniform(0.5, 1.0)
    shape = {"BW_BETA": beta / yields, "BW_GAMMA": (1 - beta) / yields}
    return Recipe(
        id="hysteresis.bouc_wen",
        place="stiffness",
        apply=lambda plan, a: plan.having(BW=a, **shape),
        sizes=lambda a: {
            "stiffness_hysteretic": (a, 0, -2, 0),
            "beta": (shape["BW_BETA"], -1, 0, 0),
            "gamma": (shape["BW_GAMMA"], -1, 0, 0),
        },
    )


def mode_second(rng: np.random.Generator, around: Surroundings) -> Recipe:
    """parallel: the sensor reads z + q, q'' + c2 q' + w2^2 q = g2 u. attached: a mass mu on the device,
    z'' + ... = mu (c2 (w' - z') + w2^2 (w - z)), w'' = -(c2 (w' - z') + w2^2 (w - z)).
    """
    variant = around.variant or ("parallel" if rng.random() < 0.6 else "attached")
    loss = 1.0 / rng.uniform(8.0, 100.0)
    if variant == "parallel":
        w, key, name, powers, sign = (
            rng.uniform(1.4, 4.0),
            "MODE_GAIN",
            "drive_gain_second",
            (1, -2, -1),
            _sign(rng),
        )
    else:
        w, key, name, powers, sign = rng.uniform(0.6, 2.2), "MODE_MASS", "mass_ratio", (0, 0, 0), 1.0
        w = w if abs(w - 1.0) > 0.1 else 1.2
    return Recipe(
        id="mode.second",
        place="mode",
        variant=variant,
        apply=lambda plan, a: plan.having(**{key: sign * a}, MODE_W2=w * w, MODE_C=loss * w),
        sizes=lambda a: {
            name: (sign * a, *powers),
            "stiffness_second": (w * w, 0, -2, 0),
            "damping_second": (loss * w, 0, -1, 0),
        },
        guess=0.2 if variant == "parallel" else 0.02,
    )


def _static(plan: Plan, law: Callable[[FloatArray], FloatArray]) -> Plan:
    return replace(plan, drive=(*plan.drive, law))


def drive_harmonics(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """u + a2 u^2 + a3 u^3 acts instead of u."""
    angle = rng.uniform(0.0, 2 * np.pi)
    second, third = np.cos(angle), 0.5 * np.sin(angle)
    return Recipe(
        id="drive.harmonics",
        place="drive",
        apply=lambda plan, a: _static(plan, lambda u: u + a * second * u**2 + a * third * u**3),
        sizes=lambda a: {"second": (a * second, 0, 0, -1), "third": (a * third, 0, 0, -2)},
        largest=3.0,
    )


def drive_saturation(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """3 s L(u/s) acts instead of u, L(x) = coth x - 1/x: slope 1 at zero, at most 3 s."""

    def law(u: FloatArray, a: float) -> FloatArray:
        x = a * u
        small = np.abs(x) < 0.05
        safe = np.where(small, 1.0, x)
        return 3.0 / a * np.where(small, x / 3 - x**3 / 45 + 2 * x**5 / 945, 1.0 / np.tanh(safe) - 1.0 / safe)

    return Recipe(
        id="drive.saturation",
        place="drive",
        apply=lambda plan, a: _static(plan, lambda u: law(u, a)),
        sizes=lambda a: {"drive_scale": (1.0 / a, 0, 0, 1)},
        guess=1.0,
    )


def drive_deadband(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """sign(u) max(|u| - d, 0) acts instead of u."""
    return Recipe(
        id="drive.deadband",
        place="drive",
        apply=lambda plan, a: _static(plan, lambda u: np.sign(u) * np.maximum(np.abs(u) - a, 0.0)),
        sizes=lambda a: {"half_width": (a, 0, 0, 1)},
        largest=3.0,
    )


def drive_delay(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """u(t - tau) acts, u held as the manifest says; zero before the record."""
    return Recipe(
        id="drive.delay",
        place="drive",
        apply=lambda plan, a: replace(plan, delay=a),
        sizes=lambda a: {"delay": (a, 0, 1, 0)},
        guess=0.15,
        largest=3.0,
    )


def drive_lag(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """tau d' + d = u, d acts."""
    return Recipe(
        id="drive.lag",
        place="drive",
        apply=lambda plan, a: plan.having(DRIVE_RATE=1.0 / a),
        sizes=lambda a: {"time_constant": (a, 0, 1, 0)},
        guess=0.15,
        largest=3.0,
    )


def drive_offset(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """u + u0 acts, also before the record: the device rests where u0 holds it."""
    sign = _sign(rng)
    return Recipe(
        id="drive.offset",
        place="drive",
        apply=lambda plan, a: _static(plan, lambda u: u + sign * a),
        sizes=lambda a: {"offset": (sign * a, 0, 0, 1)},
        largest=3.0,
    )


def _sees(plan: Plan, law: Callable[[Input, FloatArray, FloatArray], FloatArray]) -> Plan:
    return replace(plan, reading=(*plan.reading, law))


def sensor_saturation(rng: np.random.Generator, around: Surroundings) -> Recipe:
    """s tanh(z/s) is read (variant 'clip': z between -s and s)."""
    variant = around.variant or "tanh"
    if variant == "clip":
        law = lambda y, a: np.clip(y, -1 / a, 1 / a)  # noqa: E731
    else:
        law = lambda y, a: np.tanh(a * y) / a  # noqa: E731
    return Recipe(
        id="sensor.saturation",
        place="sensor",
        variant=variant,
        apply=lambda plan, a: _sees(plan, lambda record, y, t: law(y, a)),
        sizes=lambda a: {"limit": (1.0 / a, 1, 0, 0)},
        guess=0.5,
    )


def sensor_offset(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """z + z0 is read."""
    sign = _sign(rng)
    return Recipe(
        id="sensor.offset",
        place="sensor",
        apply=lambda plan, a: _sees(plan, lambda record, y, t: y + sign * a),
        sizes=lambda a: {"offset": (sign * a, 1, 0, 0)},
    )


def sensor_lag(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """tau s' + s = z, s is read; settled before the record."""
    return Recipe(
        id="sensor.lag",
        place="sensor",
        apply=lambda plan, a: plan.having(SENSOR_RATE=1.0 / a),
        sizes=lambda a: {"time_constant": (a, 0, 1, 0)},
        guess=0.15,
        largest=3.0,
    )


def sensor_hum(rng: np.random.Generator, around: Surroundings) -> Recipe:
    """z + h sin(2 pi f t + phase) is read, f 50 or 60 Hz; one phase a file, running on over slices of it."""
    mains = float(rng.choice([50.0, 60.0]))
    phases = rng.uniform(0.0, 2 * np.pi, 64)
    w = 2 * np.pi * mains / around.omega0
    return Recipe(
        id="sensor.hum",
        place="sensor",
        apply=lambda plan, a: _sees(
            plan, lambda record, y, t: y + a * np.sin(w * t + phases[record.file_number])
        ),
        sizes=lambda a: {"amplitude": (a, 1, 0, 0), "angular_frequency": (w, 0, -1, 0)},
    )


def input_hold(rng: np.random.Generator, around: Surroundings) -> Recipe:
    """Another hold acts than the manifest says. It has no size of its own: the sampling rate sets its share."""
    others = {"linear": ["zero"], "zero": ["linear", "band-limited"], "band-limited": ["zero"]}
    truly = str(rng.choice(others[around.manifest_hold]))
    return Recipe(
        id="input.hold",
        place="drive",
        variant=truly,
        apply=lambda plan, a: replace(plan, hold=truly) if a > 0.0 else plan,
        sizes=lambda a: {},
        guess=np.nan,
    )


CATALOGUE: dict[str, Draw] = {
    "stiffness.quadratic": stiffness_quadratic,
    "stiffness.cubic": stiffness_cubic,
    "stiffness.quintic": stiffness_quintic,
    "stiffness.parametric": stiffness_parametric,
    "stiffness.drift": stiffness_drift,
    "stiffness.viscoelastic": stiffness_viscoelastic,
    "damping.nonlinear": damping_nonlinear,
    "damping.quadratic": damping_quadratic,
    "friction.coulomb": friction_coulomb,
    "hysteresis.bouc_wen": hysteresis_bouc_wen,
    "mode.second": mode_second,
    "drive.harmonics": drive_harmonics,
    "drive.saturation": drive_saturation,
    "drive.deadband": drive_deadband,
    "drive.delay": drive_delay,
    "drive.lag": drive_lag,
    "drive.offset": drive_offset,
    "sensor.saturation": sensor_saturation,
    "sensor.offset": sensor_offset,
    "sensor.lag": sensor_lag,
    "sensor.hum": sensor_hum,
    "input.hold": input_hold,
}

NEVER_TOGETHER = (
    {"drive.delay", "sensor.lag"},
    {"drive.lag", "sensor.lag"},
    {"input.hold", "sensor.lag"},
    {"drive.offset", "sensor.offset"},
)
"""Pairs that one of the two alone describes about as well."""
