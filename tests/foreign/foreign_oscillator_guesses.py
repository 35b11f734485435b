"""A middling size of each effect on a bench, with its smallest and largest, and the numbers beside it."""

from __future__ import annotations

import numpy as np
from foreign_common import log_uniform
from foreign_oscillator_device import HOLDS, Effect, natural_square, steps_of
from foreign_oscillator_styles import Bench

MAINS_Hz = (50.0, 60.0)
SIGNED = {
    "stiffness.quadratic",
    "stiffness.cubic",
    "stiffness.quintic",
    "stiffness.parametric",
    "drive.offset",
    "sensor.offset",
    "timing.skew",
}


def first_guess(bench: Bench, name: str, rng: np.random.Generator) -> tuple[Effect, float, float]:
    """An effect of a middling size, the smallest and the largest; ValueError where the bench cannot have it."""
    if not possible(bench, name):
        raise ValueError(f"{name} cannot act on this {bench.style}")
    values = beside(bench, name, rng)
    sign = values.get("sign", 1.0)
    z, u, o = bench.displacement_unit, bench.drive_unit, bench.device.period_s
    w2, A, U = natural_square(bench.device.law), bench.largest, bench.largest_drive
    w = np.sqrt(w2)
    h = o / steps_of(bench.device, bench.device.law)
    raised = (w * A) ** values.get("exponent", 1.0)
    # unit, then what a size of 1 in the comparison with the linear force is, then smallest, middling, largest
    unit, scale, low, start, high = {
        "stiffness.quadratic": (f"1/({z}*s^2)", w2 / A, 1e-3, 0.1, 0.45),
        "stiffness.cubic": (f"1/({z}^2*s^2)", w2 / A**2, 1e-3, 0.1, 3.0 if sign > 0 else 0.3),
        "stiffness.quintic": (f"1/({z}^4*s^2)", w2 / A**4, 1e-3, 0.2, 3.0 if sign > 0 else 0.15),
        "stiffness.parametric": (f"1/({u}*s^2)", w2 / U, 1e-4, 0.05, 0.8),
        "stiffness.drift": ("1/s^2", w2, 1e-4, 0.01, 0.5),
        "stiffness.viscoelastic": ("1/s^2", w2, 1e-3, 0.1, 3.0),
        "damping.nonlinear": (f"1/({z}^2*s)", w / A**2, 1e-4, 0.03, 5.0),
        "damping.quadratic": (f"1/{z}", 1.0 / A, 1e-4, 0.03, 5.0),
        "friction.coulomb": (f"{z}/s^2", w2 * A, 1e-5, 0.01, 0.4),
        "friction.coulomb:smooth": (f"{z}/s^2", w2 * A, 1e-5, 0.01, 0.4),
        "friction.stribeck": (f"{z}/s^2", w2 * A, 1e-5, 0.01, 0.4),
        "friction.presliding": (f"{z}/s^2", w2 * A, 1e-5, 0.01, 0.4),
        "hysteresis.bouc_wen": (f"{z}/s^2", w2 * A, 1e-5, 0.02, 0.6),
        "mode.second": ("1", 1.0, 1e-4, 0.02, 1.0),
        "drive.harmonics": ("1", 1.0, 1e-3, 0.2, 1.0),
        "drive.saturation": ("1", 1.0, 0.1, 2.0, 30.0),
        "drive.deadband": (u, U, 1e-3, 0.05, 0.6),
        "drive.delay": ("s", 1.0 / w, w * h, max(0.2, w * h), 6.0),
        "drive.lag": ("s", 1.0 / w, 1e-2, 0.3, 10.0),
        "drive.offset": (u, U, 1e-4, 0.05, 0.5),
        "sensor.saturation": ("1", 1.0, 1e-2, 0.3, 0.9 if values.get("hard") else 3.0),
        "sensor.offset": (z, A, 1e-3, 0.03, 0.5),
        "sensor.lag": ("s", 1.0 / w, 1e-2, 0.3, 10.0),
        "sensor.hum": (z, A, 1e-3, 0.03, 0.3),
        "input.hold": ("1", 1.0, 1.0, 1.0, 1.0),
        "stiffness.clearance": (z, A, 1e-4, 0.01, 0.3),
        "stop.one_sided": ("1", 1.0, 1e-2, 0.2, 0.9),
        "stop.two_sided": ("1", 1.0, 1e-2, 0.2, 0.9),
        "stiffness.gravity": ("1/s^2", w2, 0.1, 0.7, 1.0),
        "damping.power": (f"{z}^{1 - values.get('exponent', 1.0):g}*s^{values.get('exponent', 1.0) - 2:g}",
                          w2 * A / raised, 1e-5, 0.01, 2.0),
        "base.motion": (f"{z}/s^2", w2 * A, 1e-5, 0.01, 1.0),
        "actuator.backlash": (u, U, 1e-3, 0.05, 0.6),
        "timing.skew": ("s", o, 0.05, 0.7, 6.0),
        "sensor.highpass": ("Hz", w / (2.0 * np.pi), 1e-3, 0.05, 3.0),
        "sensor.drift": (z, A, 1e-3, 0.05, 1.0),
        "sensor.quantisation": (z, A, 1e-3, 0.1, 0.7),
        "input.gain_drift": ("1", 1.0, 1e-3, 0.1, 0.9),
    }[name]  # fmt: skip
    return Effect(name=name, size=start * scale, unit=unit, values=values), low * scale, high * scale


def possible(bench: Bench, name: str) -> bool:
    """Whether this device can have the effect at all."""
    law, rows = bench.device.law, bench.records[0].drive.size
    if name == "stiffness.gravity":
        return bench.displacement_unit == "rad" and bench.largest > 0.5
    if name == "stiffness.clearance":
        return law.stiffness > 0.0
    if name == "sensor.hum":
        return 2.0 / rows < MAINS_Hz[0] * bench.device.period_s and MAINS_Hz[1] * bench.device.period_s < 0.4
    return True


def beside(bench: Bench, name: str, rng: np.random.Generator) -> dict[str, float]:
    """Numbers of an effect that are drawn, not sized."""
    w, A = float(np.sqrt(natural_square(bench.device.law))), bench.largest
    top, natural = w * A, w / (2.0 * np.pi)
    length = bench.records[0].drive.size * bench.device.period_s
    sign, settles = float(rng.choice([-1.0, 1.0])), float(rng.random() < 0.5)
    over = length * float(rng.uniform(0.2, 1.0)) if settles else length
    drift = {"sign": sign, "over_s": over, "settles": settles}
    quadratic, cubic = ((1.0, 0.0), (0.0, sign), (1.0, 0.5 * sign))[int(rng.integers(3))]
    others = [HOLDS.index(hold) for hold in HOLDS if hold != bench.device.hold]
    mode_Hz = natural * float(rng.uniform(1.5, 2.4) if rng.random() < 0.75 else rng.uniform(0.5, 0.7))
    loop, order = float(rng.uniform(0.5, 0.95)), float(rng.choice([1.0, 1.0, 2.0]))
    stop = bench.device.law.stiffness * log_uniform(rng, 3.0, 30.0)
    lines = float(rng.choice([1.0, 1.0, 2.0, 40.0]))
    return {
        "stiffness.drift": drift,
        "stiffness.viscoelastic": {"tau_s": log_uniform(rng, 0.3, 6.0) / w},
        "friction.coulomb:smooth": {"speed": top * log_uniform(rng, 0.004, 0.06)},
        "friction.stribeck": {
            "breakaway": float(rng.uniform(1.3, 2.2)),
            "speed": top * log_uniform(rng, 0.02, 0.2),
        },
        "friction.presliding": {"yielding": A * log_uniform(rng, 0.01, 0.2)},
        "hysteresis.bouc_wen": {"yielding": A * log_uniform(rng, 0.05, 0.5), "loop": loop, "order": order},
        "mode.second": {
            "carried": float(rng.random() < 0.4),
            "frequency_Hz": mode_Hz,
            "ratio": log_uniform(rng, 0.005, 0.05),
        },
        "drive.harmonics": {"a": quadratic, "b": cubic, "U": bench.largest_drive},
        "drive.saturation": {"U": bench.largest_drive},
        "sensor.saturation": {"hard": float(rng.random() < 0.4), "A": A},
        "sensor.hum": {"frequency_Hz": float(rng.choice(MAINS_Hz))},
        "input.hold": {"hold": float(rng.choice(others))},
        "stop.one_sided": {"A": A, "stiffness": abs(stop), "damping": 0.05 * np.sqrt(abs(stop))},
        "stop.two_sided": {"A": A, "stiffness": abs(stop), "damping": 0.05 * np.sqrt(abs(stop))},
        "damping.power": {"exponent": float(rng.choice([0.5, 1.5, 3.0]))},
        "base.motion": {
            "frequency_Hz": natural * log_uniform(rng, 0.3, 1.8),
            "lines": lines,
            "spread": float(rng.uniform(0.05, 0.3)),
        },
        "sensor.drift": {"sign": sign, "exponent": float(rng.choice([0.5, 1.0]))},
        "input.gain_drift": drift,
    }.get(name, {"sign": sign} if name in SIGNED else {})
