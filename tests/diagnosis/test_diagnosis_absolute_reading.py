"""An accelerometer on a device that its base moves reads that motion too, which looks like a leak of the drive."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import write_records
from scipy.signal import lsim

import rtctl
from plant_sim.oscillator.mechanisms import MECHANISMS
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.problem.statement import state_mechanism

RATE_HZ, SAMPLES, INSTANTS = 2048.0, 4096, 8
NATURAL_1_S, DAMPING_RATIO = 2.0 * np.pi * 42.0, 0.025
BY_NATURE = "has it in its reading by nature"
UNITS = {"drive": "g_0", "acceleration": "m/s^2"}


def test_an_absolute_acceleration_is_told_as_that(tmp_path: Path) -> None:
    rng, records = np.random.default_rng(3), []
    t = np.arange(SAMPLES * INSTANTS) / RATE_HZ / INSTANTS
    for use in ("fit", "test"):
        base_g = sum(
            np.sin(2.0 * np.pi * f * t + phase)
            for f, phase in zip(rng.uniform(10.0, 120.0, 8), rng.uniform(0.0, 6.0, 8), strict=True)
        ) * np.minimum(1.0, t / 0.1)
        # the mass against the ground: (2 zeta w s + w^2) / (s^2 + 2 zeta w s + w^2) of the base
        passes = [2.0 * DAMPING_RATIO * NATURAL_1_S, NATURAL_1_S**2]
        _, moved, _ = lsim((passes, [1.0, *passes]), 9.80665 * base_g, t)
        reading = moved[::INSTANTS] + 0.05 * rng.standard_normal(SAMPLES)
        records.append((base_g[::INSTANTS], reading, use))
    manifest = write_records(tmp_path, records, RATE_HZ, UNITS)
    few = "sensor.crosstalk,drive.delay,sensor.lag,mode.second,stiffness.cubic"
    (cause,) = rtctl.diagnose(manifest, mechanisms=few).causes
    assert cause.id == "sensor.crosstalk"
    assert BY_NATURE in cause.statement


@pytest.mark.parametrize(
    ("gain", "unit", "told"),
    [(9.808, "(m/s^2)/(g_0)", True), (-1.0, "1", True), (0.8, "1", False), (1.0, "mm/V", False)],
)
def test_it_is_told_of_the_whole_drive_in_its_own_unit_alone(gain: float, unit: str, told: bool) -> None:
    leak = {"gain": Estimate(gain, gain, gain, unit), "rate": Estimate(0.0, 0.0, 0.0, "s")}
    assert (BY_NATURE in state_mechanism(MECHANISMS["sensor.crosstalk"], leak)) is told
