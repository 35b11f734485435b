"""The observer of an extended model: its prediction is the simulation's, its corrections bring the loops back."""

from __future__ import annotations

import dataclasses
import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "simulations"))
from vo2_model_cases import PERIOD_S, predict, simulation, small_model, stimulus, telegraph

from rtctl.border.model_file import Value
from rtctl.estimators import ESTIMATORS
from rtctl.estimators.corrected import CorrectedEstimator
from rtctl.estimators.drive import Drive
from rtctl.estimators.extended_observer import ExtendedObserver
from rtctl.estimators.thermal_path import ThermalPath, path_params
from rtctl.interfaces import Estimate
from rtctl.simulations.vo2 import vo2_simulation
from rtctl.simulations.vo2.loop_dynamics import dynamics_of

CURRENT = telegraph(200, seed=7)
CASES = {
    "thermal__second_time_constant": {"share": 0.3, "time_constant": 9e-3},
    "thermal__nonlinear_loss": {"loss": 0.01},
    "thermal__latent_heat": {"heat": 6.0},
    "thermal__ambient_drift": {"rate": 20.0},
    "thermal__ambient_drift (settles)": {"rate": 60.0, "settling_time": 0.06},
    "heater__tcr": {"tcr": 0.004},
    "actuation__delay": {"delay": 2.3e-3},
    "actuation__deadband": {"width": 0.3},
    "actuation__deadband (held)": {"held": 0.9, "hold": 0.4},
    "thermal__latent_heat (film)": {"heat": 6.0, "film": 0.7},
    "structure__resonance": {"participation": 1.0, "frequency": 90.0, "damping_ratio": 0.05},
    "hysteresis__rate_dependence": {
        "time_constant": 3e-3,
        "activation": 0.03,
        "expansion": 0.4,
        "mixing": 0.3,
    },
    "sensor__self_heating": {"heat": 4.0},
    "sensor__lag": {"time_constant": 2e-3},
    "sensor__ageing": {"rate": 0.5, "slowing_time": 0.05},
    "sensor__crosstalk": {"leak": 900.0},
}

ZONE = {"actuation__deadband": {"zone": 2.5}}


def followed(model, current):
    """Resistance and deflection of the loop's own path, one command after the other."""
    dynamics = dynamics_of(model)
    path, drive = ThermalPath(model, path_params(model, dynamics)), Drive(dynamics)
    path.start(drive.start(current[0]))
    rows, time_s = [(path.resistance, path.deflection)], 0.0
    for command in current[:-1]:
        for heating, duration_s in drive.pieces(command, PERIOD_S):
            path.step(heating, 0.0, time_s, duration_s)
            time_s += duration_s
        rows.append((path.resistance, path.deflection))
    return np.array(rows).T


@pytest.mark.parametrize("identity", CASES)
def test_the_path_of_the_loop_is_the_simulation(identity):
    made = simulation(**{identity.split()[0]: CASES[identity]})
    expected = np.array(predict(made, stimulus(CURRENT)))
    nominal = np.array(predict(simulation(), stimulus(CURRENT)))
    found = followed(made.model, CURRENT)
    for own, report, plain in zip(found, expected, nominal, strict=True):
        effect = np.std(report - plain)
        assert np.std(own - report) < 0.02 * effect + 1e-9 * np.std(plain)


@pytest.mark.parametrize(
    "identity", ["none", *(one for one in CASES if not one.startswith("actuation__deadband"))]
)
def test_beside_a_current_that_does_not_heat_too(identity):
    """Also where nothing else acts: with loops that go over all of the current, the changes differ."""
    beside = {identity.split()[0]: CASES[identity]} if identity != "none" else {}
    made = simulation(**ZONE, **beside)
    expected = np.array(predict(made, stimulus(CURRENT)))
    without = np.array(predict(simulation(**beside), stimulus(CURRENT)))
    for own, report, plain in zip(followed(made.model, CURRENT), expected, without, strict=True):
        assert np.std(report - plain) > 0.02 * np.std(plain)
        assert np.std(own - report) < 0.05 * np.std(report - plain)


def test_all_of_them_at_once_and_the_corrections_too():
    made = simulation(**{name: values for name, values in CASES.items() if " " not in name})
    corrections = {
        "current_gain": Value(value=1.02, unit="dimensionless"),
        "resistance_offset": Value(value=0.03, unit="dimensionless"),
        "deflection_gain": Value(value=0.97, unit="dimensionless"),
        "deflection_offset": Value(value=0.4, unit="um"),
    }
    model = dataclasses.replace(made.model, corrections=corrections)
    expected = np.array(predict(vo2_simulation(model, {}, "case"), stimulus(CURRENT)))
    found = followed(model, CURRENT)
    for own, report in zip(found, expected, strict=True):
        assert np.std(own - report) < 0.02 * np.std(report)


@pytest.mark.parametrize("identity", [*CASES, "zone"])
def test_the_observer_knows_the_deflection_of_a_device_with_the_effect(identity):
    """Readings of the extended simulation: the nominal observer misses what the extended one knows."""
    made = simulation(**(ZONE if identity == "zone" else {identity.split()[0]: CASES[identity]}))
    resistance, deflection = predict(made, stimulus(CURRENT))
    errors = {}
    for name, model in {"nominal": small_model(), "extended": made.model}.items():
        observer = ESTIMATORS["observer"](model)
        found = [observer.start([CURRENT[0]], [resistance[0]]).value]
        for k in range(1, len(CURRENT)):
            found.append(observer.step([CURRENT[k - 1]], [resistance[k]], PERIOD_S).value)
        errors[name] = np.abs(np.array(found) - deflection)[20:].mean()
    assert errors["extended"] < 0.2
    assert errors["extended"] < errors["nominal"] + 0.01
    loud = identity not in ("sensor__lag", "sensor__ageing", "sensor__crosstalk", "sensor__self_heating")
    assert not loud or errors["extended"] < 0.2 * errors["nominal"]


def test_what_the_beam_swings_is_told_apart_from_where_it_settles():
    """A loop behind the observer sees what it would see of a beam without mass."""
    identity = "structure__resonance"
    resistance, deflection = predict(simulation(**{identity: CASES[identity]}), stimulus(CURRENT))
    observers = [
        ESTIMATORS["observer"](one)
        for one in (small_model(), simulation(**{identity: CASES[identity]}).model)
    ]
    plain, swinging = [[one.start([CURRENT[0]], [resistance[0]])] for one in observers]
    for k in range(1, len(CURRENT)):
        for observer, answers in zip(observers, (plain, swinging), strict=True):
            answers.append(observer.step([CURRENT[k - 1]], [resistance[k]], PERIOD_S))
    assert np.std([one.swing for one in swinging]) > 0.1 * np.std(deflection)
    assert all(one.settled == one.value for one in plain)
    expected = np.array([one.value for one in plain])
    assert np.abs(np.array([one.settled for one in swinging]) - expected).max() < 0.2, "um"


def test_a_model_without_mechanisms_keeps_the_compiled_observer():
    assert not isinstance(ESTIMATORS["observer"](small_model()), ExtendedObserver)
    assert isinstance(
        ESTIMATORS["observer"](simulation(sensor__lag={"time_constant": 1e-3}).model), ExtendedObserver
    )


@pytest.mark.parametrize("reading", [math.nan, math.inf, -1.0, 0.0])
def test_a_bad_reading_is_flagged_and_moves_nothing(reading):
    observer = ESTIMATORS["observer"](simulation(sensor__lag={"time_constant": 1e-3}).model)
    observer.start([5.0], [1e5])
    before = observer.memory.filter.copy()
    estimate = observer.step([5.0], [reading], 0.0)
    assert estimate.status & 8
    assert math.isfinite(estimate.value)
    assert observer.memory.filter.tolist() == before.tolist()


class Listening:
    """An estimator that keeps the resistances that it is given; its surrogate is the applied current."""

    surrogate = ("surrogate", "mA")

    def __init__(self):
        self.readings = []

    def start(self, levels, sensed):
        return self.step(levels, sensed, 0.0)

    def step(self, levels, sensed, elapsed_s):
        self.readings.append(sensed[0])
        return Estimate(10.0, levels[0], 0.1, 0)


def test_resistance_alone_is_given_back_what_the_sensor_took():
    """A lag, a leak, ageing and an offset taken back: what is left is the film's own resistance."""
    made = simulation(
        sensor__lag={"time_constant": 2e-3},
        sensor__ageing={"rate": 1.5, "slowing_time": 0.2},
        sensor__crosstalk={"leak": 900.0},
    )
    corrections = {"resistance_offset": Value(value=0.1, unit="dimensionless")}
    model = dataclasses.replace(made.model, corrections=corrections)
    slow = 6.0 + 2.0 * np.sin(np.arange(3000) / 400.0)
    film = predict(simulation(), stimulus(slow))[0]
    sensed = predict(vo2_simulation(model, {}, "case"), stimulus(slow))[0]
    inner = Listening()
    estimator = CorrectedEstimator(inner, dynamics_of(model))
    estimator.start([slow[0]], [sensed[0]])
    for k in range(1, len(slow)):
        estimator.step([slow[k - 1]], [sensed[k]], PERIOD_S)
    left = np.abs(np.log(np.array(inner.readings) / film))[5:]
    assert left.max() < 0.03, "a sample of a slow sine lies between R and where the lag puts it"
    assert np.abs(np.log(sensed / film)).max() > 0.3


@pytest.mark.parametrize("kind", ["composite", "gap_free", "preisach", "egpi"])
def test_every_estimator_of_an_extended_model_has_its_sensor_corrected(kind):
    extended = simulation(sensor__lag={"time_constant": 2e-3}).model
    assert isinstance(ESTIMATORS[kind](extended), CorrectedEstimator)
    assert not isinstance(ESTIMATORS[kind](small_model()), CorrectedEstimator)


@pytest.mark.parametrize("delay_s", [0.0, 3.1e-3, 50e-3])
def test_the_drive_of_a_whole_record_is_that_of_its_samples(delay_s: float) -> None:
    dynamics = dynamics_of(simulation(actuation__deadband={"width": 0.4}).model)
    here, there = (Drive(dataclasses.replace(dynamics, delay_s=delay_s)) for _ in range(2))
    rng, n = np.random.default_rng(1), 2000
    levels = 8.0 + rng.standard_normal(n).cumsum() * 0.1
    elapsed_s = np.where(rng.random(n) < 0.02, rng.choice([0.0, 2e-3, 3e-3], n), 1e-3)
    heat = rng.random(n)
    for one in (here, there):
        one.start(2.0)
    wanted = [
        (float(row), current, duration_s, heat[row])
        for row in range(n)
        for current, duration_s in (here.pieces(levels[row], elapsed_s[row]) or [(0.0, 0.0)])
    ]
    assert np.array_equal(there.all_pieces(levels, elapsed_s, heat), np.array(wanted))
