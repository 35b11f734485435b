"""When a row's readings are taken, and at what temperature a record begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from vo2_dense_oracle import STEPS, dense
from vo2_model_cases import PERIOD_S, TAU_S, predict, simulation, small_model, stimulus, telegraph

from rtctl.border.simulation import Stimulus
from rtctl.simulations.vo2 import Vo2Simulation

CURRENT = telegraph(200, seed=3)  # its first five levels are equal: at rest


def read_after(made: Vo2Simulation, rows: float = 1.0) -> Vo2Simulation:
    """The same device, its rows read at the ends of their periods."""
    return replace(made, model=replace(made.model, timing_skew_rows=rows))


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_a_row_that_is_read_at_the_end_of_its_period_is_the_next_row_read_at_its_start(hold: str) -> None:
    late = predict(read_after(simulation()), stimulus(CURRENT, hold))
    usual = predict(simulation(), stimulus(np.append(CURRENT, CURRENT[-1]), hold))
    for one, other in zip(late, usual, strict=True):
        np.testing.assert_allclose(one, other[1:], rtol=1e-12)


@pytest.mark.parametrize("late_s", [0.3e-3, -0.7e-3, 1.6e-3])
def test_a_skewed_reading_is_the_film_at_another_instant(late_s: float) -> None:
    skewed = predict(simulation(timing__skew={"resistance": late_s, "deflection": late_s}), stimulus(CURRENT))
    film, rows = dense(np.append(CURRENT, np.full(3, CURRENT[-1]))), np.arange(5, len(CURRENT) - 5)
    at = rows * STEPS + round(late_s / PERIOD_S * STEPS)
    nominal = predict(simulation(), stimulus(CURRENT))[1][rows]
    effect = float(np.std(film.deflection[at] - nominal))
    assert effect > 0.5
    assert np.std(skewed[1][rows] - film.deflection[at]) < 0.02 * effect
    assert np.std(np.log(skewed[0][rows]) + film.reading[at]) < 0.02 * float(np.std(film.reading))


def test_one_signal_may_be_skewed_and_the_other_not() -> None:
    both = predict(simulation(), stimulus(CURRENT))
    late = predict(simulation(timing__skew={"deflection": 1e-3, "resistance": 0.0}), stimulus(CURRENT))
    assert (late[0] == both[0]).all()
    np.testing.assert_allclose(late[1][:-1], both[1][1:], rtol=1e-12)


def test_readings_that_are_early_by_a_delay_are_one_law_with_it() -> None:
    delayed = predict(simulation(actuation__delay={"delay": 0.4e-3}), stimulus(CURRENT))
    early = predict(
        simulation(timing__skew={"deflection": -0.4e-3, "resistance": -0.4e-3}), stimulus(CURRENT)
    )
    for one, other in zip(delayed, early, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)


@pytest.mark.parametrize("mechanisms", [{}, {"heater__tcr": {"tcr": 1e-9}}], ids=["plain", "heat balance"])
def test_a_record_begins_at_the_temperature_of_its_stimulus(mechanisms: dict[str, dict[str, float]]) -> None:
    start_mA, held_mA, model = 4.5, 7.4, small_model()
    current = np.full(30, held_mA)
    given = Stimulus(
        inputs={"current": current}, holds={"current": "zero"}, period_s=PERIOD_S,
        initial={"surrogate": start_mA},
    )  # fmt: skip
    resistance, deflection = predict(simulation(**mechanisms), given)
    decay = np.exp(-PERIOD_S * np.arange(30) / TAU_S)
    v = np.sqrt(held_mA**2 + (start_mA**2 - held_mA**2) * decay)
    np.testing.assert_allclose(deflection, model.deflection_preisach.simulate(v), atol=1e-5)
    np.testing.assert_allclose(np.log(resistance), -model.resistance_preisach.simulate(v), atol=1e-6)


def test_the_instrument_lags_the_deflection_alone() -> None:
    plain = predict(simulation(), stimulus(CURRENT))
    lagging = predict(simulation(sensor__deflection_lag={"time_constant": 2e-3}), stimulus(CURRENT))
    np.testing.assert_allclose(lagging[0], plain[0], rtol=1e-9)
    fine = dense(CURRENT).deflection
    read, behind = [fine[0]], float(fine[0])
    for value in fine[1:]:
        behind = value + (behind - value) * float(np.exp(-PERIOD_S / STEPS / 2e-3))
        read.append(behind)
    expected = np.array(read)[::STEPS]
    assert np.std(lagging[1] - expected) < 0.02 * np.std(expected - plain[1])
