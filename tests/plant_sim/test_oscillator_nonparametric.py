"""Laws of no name are what their powers say, and no causes."""

from __future__ import annotations

import numpy as np
import pytest

from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.nonparametric import UNNAMED
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Simulation, Stimulus
from rtctl.wiring_models import build_simulation, mechanism_ids

UNITS = {"drive": "V", "displacement": "mm"}
NOMINAL = {"damping": (8.0, "1/s"), "stiffness": (1.6e4, "1/s^2"), "drive_gain": (450.0, "mm/s^2/V")}
DRIVE = Stimulus(
    inputs={"drive": 20.0 * np.sin(0.2 * np.arange(1200) + 1e-4 * np.arange(1200) ** 2)},
    holds={"drive": "linear"},
    period_s=1e-3,
)


def with_one(mechanism: str, parameter: str, value: float) -> Simulation:
    tables = {
        "kind": "oscillator",
        "parameters": {n: {"value": v, "unit": u} for n, (v, u) in NOMINAL.items()},
    }
    made = build_simulation(ModelFile.model_validate({"model": tables}), UNITS, "case").extended((mechanism,))
    name = f"{mechanism}.{parameter}"
    return made.with_values(np.array([value if one.name == name else one.value for one in made.parameters]))


def motion(made: Simulation) -> np.ndarray:
    values = np.array([one.value for one in made.parameters])
    return made.predict(DRIVE, values, refine=4).outputs["displacement"][0]


@pytest.mark.parametrize(
    ("unnamed", "power", "cause", "parameter", "value"),
    [
        ("nonparametric.spring", "power_2", "stiffness.quadratic", "coefficient", 3e3),
        ("nonparametric.spring", "power_3", "stiffness.cubic", "coefficient", 2e3),
        ("nonparametric.spring", "power_5", "stiffness.quintic", "coefficient", 5e2),
        ("nonparametric.dissipation", "square", "damping.quadratic", "coefficient", 0.05),
    ],
)
def test_a_power_that_has_a_name_is_that(
    unnamed: str, power: str, cause: str, parameter: str, value: float
) -> None:
    nominal, known = motion(with_one(cause, parameter, 0.0)), motion(with_one(cause, parameter, value))
    effect = float(np.std(known - nominal))
    assert effect > 0.01 * np.std(nominal)
    assert motion(with_one(unnamed, power, value)) == pytest.approx(known, abs=0.01 * effect)


def with_stop(above: float, below: float, place: float) -> Simulation:
    made = with_one("nonparametric.stop", "above", above)
    own = {"nonparametric.stop.below": below, "nonparametric.stop.place": place}
    return made.with_values(np.array([own.get(one.name, one.value) for one in made.parameters]))


def test_a_stop_at_the_origin_is_a_stiffer_spring() -> None:
    stiffer = with_one("nonparametric.stop", "above", 0.0)
    stiffer = stiffer.with_values(
        np.array([2e4 if one.name == "stiffness" else one.value for one in stiffer.parameters])
    )
    assert motion(with_stop(4e3, 4e3, 1e-9)) == pytest.approx(
        motion(stiffer), abs=1e-6 * float(np.std(motion(stiffer)))
    )


def test_a_stop_acts_beyond_its_place_on_its_side_alone() -> None:
    free = motion(with_stop(0.0, 0.0, 1.0))
    reached = float(np.abs(free).max())
    assert motion(with_stop(1e5, 1e5, 1.01 * reached)) == pytest.approx(free, abs=1e-9 * reached)
    above, below = motion(with_stop(1e5, 0.0, 0.5 * reached)), motion(with_stop(0.0, 1e5, 0.5 * reached))
    assert above.max() < -0.9 * above.min()
    assert -below.min() < 0.9 * below.max()


def delayed(feedback: float, delay_s: float, parts: int = 50) -> np.ndarray:
    """A force - feedback z(t - delay), by small steps that look back at what they have made."""
    drive, period_s = DRIVE.inputs["drive"], DRIVE.period_s
    h, count = period_s / parts, (len(drive) - 1) * parts
    u = np.interp(np.arange(count + 1) / parts, np.arange(len(drive)), drive)
    damping, stiffness, gain = (NOMINAL[name][0] for name in ("damping", "stiffness", "drive_gain"))
    back, z, v = round(delay_s / h), np.zeros(count + 1), 0.0
    for k in range(count):
        before = z[k - back] if k >= back else 0.0
        v += h * (gain * u[k] - damping * v - stiffness * z[k] - feedback * before)
        z[k + 1] = z[k] + h * v
    return z[::parts]


def test_a_force_that_comes_late_is_one_that_comes_late() -> None:
    """48 times the time of a section, as long as that is short beside the motion."""
    made = with_one("nonparametric.feedback", "late", 1.5e3)
    made = made.with_values(
        np.array(
            [1e-4 if one.name == "nonparametric.feedback.time" else one.value for one in made.parameters]
        )
    )
    expected, nominal = delayed(1.5e3, 48 * 1e-4), delayed(0.0, 0.0)
    effect = float(np.std(expected - nominal))
    assert effect > 0.1 * np.std(nominal)
    assert np.std(motion(made) - expected) < 0.05 * effect


def relaxed(level: float, order: float, time_s: float, parts: int = 50) -> np.ndarray:
    """A force - level sum of 4^(k order) w_k, w_k' = z' - 4^k w_k / time, k = -2 to 2, by small steps."""
    drive, h = DRIVE.inputs["drive"], DRIVE.period_s / parts
    count = (len(drive) - 1) * parts
    u = np.interp(np.arange(count + 1) / parts, np.arange(len(drive)), drive)
    damping, stiffness, gain = (NOMINAL[name][0] for name in ("damping", "stiffness", "drive_gain"))
    k = np.arange(-2.0, 3.0)
    weights, kept, w = level * 4.0 ** (order * k), np.exp(-h * 4.0**k / time_s), np.zeros(5)
    z, v = np.zeros(count + 1), 0.0
    for step in range(count):
        v += h * (gain * u[step] - damping * v - stiffness * z[step] - weights @ w)
        z[step + 1] = z[step] + h * v
        w = kept * w + h * v
    return z[::parts]


def test_many_relaxations_are_the_sum_of_their_sentence() -> None:
    made = with_one("nonparametric.relaxations", "level", 900.0)
    shapes = {"nonparametric.relaxations.order": 0.5, "nonparametric.relaxations.time": 8e-3}
    made = made.with_values(np.array([shapes.get(one.name, one.value) for one in made.parameters]))
    expected, nominal = relaxed(900.0, 0.5, 8e-3), delayed(0.0, 0.0)
    effect = float(np.std(expected - nominal))
    assert effect > 0.1 * np.std(nominal)
    assert np.std(motion(made) - expected) < 0.02 * effect


@pytest.mark.parametrize("power", ["quarter", "half"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_power_below_one_takes_energy_or_gives_it(power: str, sign: float) -> None:
    nominal = float(np.std(motion(with_one("nonparametric.dissipation", power, 0.0))[600:]))
    found = float(np.std(motion(with_one("nonparametric.dissipation", power, 20.0 * sign))[600:]))
    assert (found < 0.99 * nominal) if sign > 0.0 else (found > 1.01 * nominal)


def test_they_are_no_causes() -> None:
    assert not set(UNNAMED) & (set(MECHANISMS) | set(mechanism_ids("oscillator")))
