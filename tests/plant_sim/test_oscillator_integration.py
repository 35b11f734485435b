"""The integrator is not the error: its order, the energy it keeps, the drive that it sees, its kernels' names."""

from __future__ import annotations

import math

import numpy as np
import pytest
from duffing_cases import CUBIC, GAIN, PERIOD_S, STIFFNESS, FloatArray, lane, multisine, simulation

from plant_sim.oscillator.equation.memory import combined
from plant_sim.oscillator.equation.terms import TERMS, nominal
from plant_sim.oscillator.integration.rk4 import bind_rk4
from plant_sim.oscillator.integration.steps import Plan
from plant_sim.oscillator.mechanism import Driven
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.motion import Equation
from rtctl.border.simulation import Stimulus


def free_mass(
    drive: FloatArray, hold: str, *mechanisms: str, **values: float
) -> tuple[FloatArray, FloatArray]:
    """Displacement and velocity of a mass that nothing holds: its velocity is the integral of what drives it."""
    bound = simulation(*mechanisms, damping=0.0, stiffness=0.0, stiffness_cubic=0.0)
    own = lane(bound, {name.replace("__", "."): value for name, value in values.items()})
    record = Stimulus(inputs={"drive": drive}, holds={"drive": hold}, period_s=PERIOD_S)
    found = bound.predict(record, own).outputs
    return found["displacement"][0], found["velocity"][0]


@pytest.mark.parametrize(
    "mechanisms", [(), ("stiffness.viscoelastic",)], ids=["without states", "with states"]
)
def test_the_error_falls_with_the_fourth_power_of_the_step(mechanisms: tuple[str, ...]) -> None:
    bound = simulation(*mechanisms)
    shapes = {f"{name}.{key}": 0.3 * STIFFNESS if key == "stiffness" else 0.02
              for name in mechanisms for key in ("stiffness", "time_constant")}  # fmt: skip
    equation = Equation.of(
        bound.parameters, [MECHANISMS[name] for name in mechanisms], lane(bound, shapes)[None, :]
    )
    ends = {}
    for steps in (8, 16, 32, 64, 1024):  # of an interval of 1/64 s, a quarter of a period
        t = (np.arange(8 * steps)[:, None] + 0.5 * np.arange(3)) / steps / 64.0
        drive = Driven(3.0 * np.cos(70.0 * t), 1.0 / 64.0 / steps)
        z, v = equation.integrate(drive, Plan(steps, False), np.array([[0.1, 5.0]]))
        ends[steps] = np.array([z[0, -1], v[0, -1] / 100.0])
    errors = [np.abs(ends[steps] - ends[1024]).max() for steps in (8, 16, 32, 64)]
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert slopes[-1] == pytest.approx(4.0, abs=0.15)
    assert slopes.min() > 3.5


@pytest.mark.parametrize(
    ("stiffness", "cubic", "start"),
    [(STIFFNESS, CUBIC, 0.2), (STIFFNESS, 2.0, 0.2), (-STIFFNESS, CUBIC, 0.1), (-STIFFNESS, CUBIC, 0.2)],
    ids=["strong", "weak", "in one well", "over both wells"],
)
def test_an_undamped_orbit_keeps_its_energy_within_a_millionth_over_a_thousand_periods(
    stiffness: float, cubic: float, start: float
) -> None:
    bound = simulation(damping=0.0, stiffness=stiffness, stiffness_cubic=cubic)
    samples = 60 * 100 + 1  # of 10 to 26 Hz, so less than a half-period apart
    record = Stimulus(
        inputs={"drive": np.zeros(samples)},
        holds={"drive": "linear"},
        period_s=1.0 / 60.0,
        initial={"displacement": start},
    )
    found = bound.predict(record, lane(bound, {})).outputs
    z, v = found["displacement"][0], found["velocity"][0]
    potential = stiffness * z**2 / 2 + cubic * z**4 / 4
    depth = stiffness**2 / (4 * cubic) if stiffness < 0.0 else 0.0  # energy counts from the bottom of a well
    energy = v**2 / 2 + potential + depth
    assert np.count_nonzero(np.diff(np.sign(v))) > 2 * 1000
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-6


def test_a_linear_hold_pushes_by_its_trapezia_and_a_zero_hold_by_its_rectangles() -> None:
    drive = np.random.default_rng(1).standard_normal(40)
    linear, held = (free_mass(drive, hold)[1] for hold in ("linear", "zero"))
    trapezia = np.concatenate(([0.0], np.cumsum(0.5 * (drive[1:] + drive[:-1])))) * GAIN * PERIOD_S
    rectangles = np.concatenate(([0.0], np.cumsum(drive[:-1]))) * GAIN * PERIOD_S
    assert np.allclose(linear, trapezia, rtol=0.0, atol=1e-13)
    assert np.allclose(held, rectangles, rtol=0.0, atol=1e-13)


def test_a_held_drive_moves_the_mass_by_parabolas() -> None:
    drive = np.random.default_rng(2).standard_normal(40)
    z, v = free_mass(drive, "zero")
    moved = v[:-1] * PERIOD_S + 0.5 * GAIN * drive[:-1] * PERIOD_S**2
    assert np.allclose(np.diff(z), moved, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("intervals", [0.3, 1.0, 2.71])
def test_a_delayed_held_drive_keeps_its_impulse(intervals: float) -> None:
    drive = np.random.default_rng(3).standard_normal(40)
    drive[:4] = drive[-4:] = 0.0
    _, v = free_mass(drive, "zero", "drive.delay", drive__delay__delay=intervals * PERIOD_S)
    at = np.arange(40) - intervals
    whole = np.clip(np.floor(at).astype(int), 0, 39)
    before = np.array([drive[:k].sum() for k in whole]) + drive[whole] * (at - np.floor(at))
    assert np.allclose(v, GAIN * PERIOD_S * before, rtol=0.0, atol=1e-13)
    assert v[-1] == pytest.approx(GAIN * PERIOD_S * drive.sum(), abs=1e-13)


def test_a_band_limited_drive_is_the_multisine_that_was_sampled() -> None:
    samples = multisine(odd=True)  # which the continuation of its ends goes on with
    base = math.pi / (PERIOD_S * (len(samples) - 1))
    t = PERIOD_S * np.arange(len(samples))
    impulse = sum(
        GAIN * amplitude * (1.0 - np.cos(k * base * t)) / (k * base)
        for k, amplitude in ((3, 1.1), (7, 0.9), (11, -0.8))
    )
    peak = np.abs(impulse).max()
    band_limited, linear = (
        np.abs(free_mass(samples, hold)[1] - impulse).max() / peak for hold in ("band-limited", "linear")
    )
    assert linear > 1e-4  # what is to be gained
    assert band_limited < 1e-6


def test_kernels_of_two_memories_are_kept_on_disk_under_their_own_names() -> None:
    names = []
    for identity in ("stiffness.viscoelastic", "hysteresis.bouc_wen"):
        memory = MECHANISMS[identity].memory
        assert memory is not None
        law = combined(nominal, [(memory.law, len(TERMS), memory.states)])
        names.append(bind_rk4(law, memory.states).py_func.__name__)
    assert len(set(names)) == 2
