"""Where a record of a heated film begins: cold, on the way, or at rest in its first current."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from vo2_model_cases import PERIOD_S, TAU_S, simulation, small_model, telegraph

from rtctl.border.simulation import Stimulus
from rtctl.identification.fit_record import FitRecord
from rtctl.plants.vo2.initial_temperature import find_initial_temperature
from rtctl.plants.vo2.log_resistance import LOG_RESISTANCE, LogReading

MODEL = LogReading(plain=simulation(), floor=1.0)


def record_from(start_mA: float | None, noise: float = 0.002) -> FitRecord:
    """Of the small model, at rest where `start_mA` is None, heated here by the closed form."""
    current, draw = telegraph(400, seed=2), np.random.default_rng(1)
    s, v = (current[0] if start_mA is None else start_mA) ** 2, []
    for held in current:
        v.append(np.sqrt(s))
        s = held**2 + (s - held**2) * np.exp(-PERIOD_S / TAU_S)
    model, path = small_model(), np.array(v)
    measured = {
        LOG_RESISTANCE: -model.resistance_preisach.simulate(path) + noise * draw.normal(size=400),
        "deflection": model.deflection_preisach.simulate(path) + 20.0 * noise * draw.normal(size=400),
    }
    stimulus = Stimulus(inputs={"current": current}, holds={"current": "zero"}, period_s=PERIOD_S)
    return FitRecord(name="r", stimulus=stimulus, measured=measured)


@pytest.mark.parametrize("start_mA", [5.5, 7.5, 8.2])
def test_a_start_elsewhere_is_found(start_mA: float) -> None:
    found = find_initial_temperature(MODEL, record_from(start_mA))
    assert found.stimulus.initial["surrogate"] == pytest.approx(start_mA, abs=0.1)
    values = np.array([one.value for one in MODEL.parameters])
    run = MODEL.predict(found.stimulus, values)
    error = run.outputs["deflection"][0] - found.measured["deflection"]
    assert np.sqrt(np.mean(error**2)) < 0.2
    before = MODEL.predict(record_from(start_mA).stimulus, values).outputs["deflection"][0]
    assert np.abs(before - found.measured["deflection"]).max() > 1.0


def test_a_record_that_begins_at_rest_stays_as_it_is() -> None:
    record = record_from(None)
    assert find_initial_temperature(MODEL, record) is record


def test_a_start_that_is_given_is_not_asked_again() -> None:
    record = find_initial_temperature(MODEL, record_from(7.5))
    assert find_initial_temperature(MODEL, record) is record


def test_a_start_that_is_colder_than_the_loops_were_identified_is_not_scored_until_it_is_forgotten() -> None:
    cold = find_initial_temperature(MODEL, record_from(0.0))
    lowest = small_model().current.low
    assert cold.stimulus.initial["surrogate"] < lowest
    assert cold.first == int(np.ceil(6.0 * TAU_S / PERIOD_S))
    assert find_initial_temperature(MODEL, record_from(7.5)).first == 0


def test_a_first_resistance_higher_than_any_identified_is_that_of_a_colder_film() -> None:
    """The first current is the lowest one: no simulation of the loops begins where the film was."""
    record = record_from(None)
    readings = dict(record.measured)
    colder = readings[LOG_RESISTANCE].copy()
    high = np.log(small_model().resistance.high)
    colder[:4] = high + 0.8 * np.exp(-PERIOD_S * np.arange(4) / TAU_S)
    found = find_initial_temperature(MODEL, replace(record, measured={**readings, LOG_RESISTANCE: colder}))
    assert found.first == int(np.ceil(6.0 * TAU_S / PERIOD_S))
