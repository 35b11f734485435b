"""Effects that no id of formats.md names. A diagnosis should say `unexplained`, or at least claim nothing false."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .effects import Draw, Recipe, Surroundings
from .equation import FRACTIONAL_RATES
from .plan import FloatArray
from .truth import OUTSIDE


def stop(rng: np.random.Generator, around: Surroundings, both: float | None = None) -> Recipe:
    """An elastic stop, ks (z - gap) beyond a gap, on one side or both; z from the device's rest.

    The catalogue has it by now; it is drawn from here still, so that a seed keeps its case.
    """
    gap, drawn = rng.uniform(0.6, 1.6), float(rng.random() < 0.4)
    both = drawn if both is None else both
    return Recipe(
        id="stop.two_sided" if both else "stop.one_sided",
        variant="stop",
        place="stiffness",
        apply=lambda plan, a: plan.having(STOP=a, STOP_GAP=gap, STOP_BOTH=both, STOP_CENTRE=around.well),
        sizes=lambda a: {"stop_stiffness": (a, 0, -2, 0), "gap": (gap, 1, 0, 0)},
        guess=0.5,
    )


def cube_root_damping(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """c z'^(1/3), made linear under 1 % of the rms speed: in the catalogue since it has powers of the speed."""
    return Recipe(
        id="damping.power",
        variant="cube_root_damping",
        place="dissipation",
        apply=lambda plan, a: plan.having(CBRT=a),
        sizes=lambda a: {"level": (a, 0, 0, 0)},
        guess=0.02,
    )


def delayed_feedback(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """k_f z(t - tau), tau of half a period to several: a loop around the device."""
    tau, sign = rng.uniform(3.0, 25.0), float(rng.choice([-1.0, 1.0]))
    return Recipe(
        id=OUTSIDE,
        variant="delayed_feedback",
        place="stiffness",
        apply=lambda plan, a: plan.having(FEEDBACK=sign * a, FEEDBACK_TIME=tau),
        sizes=lambda a: {"feedback": (sign * a, 0, -2, 0), "delay": (tau, 0, 1, 0)},
        guess=0.005,
    )


def cogging(rng: np.random.Generator, around: Surroundings) -> Recipe:
    """b sin(kappa z): a cosine potential with several teeth in the range of motion."""
    kappa = rng.uniform(2.5, 6.0)
    return Recipe(
        id=OUTSIDE,
        variant="cogging",
        place="stiffness",
        apply=lambda plan, a: plan.having(RIPPLE=a, RIPPLE_KAPPA=kappa, STOP_CENTRE=around.well),
        sizes=lambda a: {"level": (a, 1, -2, 0), "wave_number": (kappa, -1, 0, 0)},
    )


def exponential_force(rng: np.random.Generator, around: Surroundings) -> Recipe:
    """b (exp(z/l) - 1), l well under the range: a magnet or a wall that is felt near one end only."""
    length = rng.uniform(0.35, 0.7)
    return Recipe(
        id=OUTSIDE,
        variant="exponential_force",
        place="stiffness",
        apply=lambda plan, a: plan.having(EXP=a, EXP_LENGTH=length, STOP_CENTRE=around.well),
        sizes=lambda a: {"level": (a, 1, -2, 0), "length": (length, 1, 0, 0)},
        guess=0.005,
    )


def stiffness_jumps(rng: np.random.Generator, around: Surroundings) -> Recipe:
    """k (1 + r s(t)), s a random telegraph of 0 and 1 that dwells tens of periods: a loose contact."""
    seed = int(rng.integers(2**31))
    dwell = rng.uniform(20.0, 80.0) * 2 * np.pi / around.sample_time

    def telegraph(number: int, samples: int) -> FloatArray:
        own = np.random.default_rng([seed, number])
        lengths = own.exponential(dwell, int(4 * samples / dwell) + 20).astype(np.int64) + 1
        states = (np.arange(lengths.size) + own.integers(2)) % 2
        return np.resize(np.repeat(states.astype(float), lengths), samples)

    return Recipe(
        id=OUTSIDE,
        variant="stiffness_jumps",
        place="stiffness",
        apply=lambda plan, a: replace(plan, jumps=lambda number, samples: a * telegraph(number, samples)),
        sizes=lambda a: {"relative_jump": (a, 0, 0, 0)},
        guess=0.01,
    )


def fractional_damping(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """c D^alpha z by seven relaxing elements f_i' = z' - r_i f_i weighted r_i^alpha, r from 0.03 to 30."""
    order = rng.uniform(0.3, 0.7)
    width = np.log(FRACTIONAL_RATES[1] / FRACTIONAL_RATES[0])
    scale = np.sin(np.pi * order) / np.pi * width
    return Recipe(
        id=OUTSIDE,
        variant="fractional_damping",
        place="dissipation",
        apply=lambda plan, a: plan.having(FRACTIONAL=a * scale, FRACTIONAL_ORDER=order),
        sizes=lambda a: {"coefficient": (a, 0, 0, 0), "order": (order, 0, 0, 0)},
        guess=0.02,
    )


def drive_dependent_damping(rng: np.random.Generator, _: Surroundings) -> Recipe:
    """c |u| z': losses that the drive brings with it (eddy currents, domain walls)."""
    return Recipe(
        id=OUTSIDE,
        variant="drive_dependent_damping",
        place="dissipation",
        apply=lambda plan, a: plan.having(CU=a),
        sizes=lambda a: {"damping_a_drive": (a, 0, -1, -1)},
        guess=0.02,
    )


OUTSIDE_CATALOGUE: dict[str, Draw] = {
    "stop": stop,
    "cube_root_damping": cube_root_damping,
    "delayed_feedback": delayed_feedback,
    "cogging": cogging,
    "exponential_force": exponential_force,
    "stiffness_jumps": stiffness_jumps,
    "fractional_damping": fractional_damping,
    "drive_dependent_damping": drive_dependent_damping,
}
