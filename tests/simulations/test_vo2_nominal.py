"""The nominal simulation is the identified model, and neutral mechanisms are not there, both to the last bit."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import quad
from vo2_model_cases import PERIOD_S, TAU_S, UNITS, predict, simulation, small_model, stimulus, telegraph

from rtctl.border.errors import InputError
from rtctl.border.model_file import MechanismTable, Value
from rtctl.identification.vo2.heating import simulate_heating
from rtctl.models.vo2 import read_model, write_model
from rtctl.simulations.vo2 import MECHANISMS, extended_model, vo2_simulation


def moved(made, **values):
    """The values of a simulation with some of them changed."""
    return np.array([values.get(one.name, one.value) for one in made.parameters])


def test_the_nominal_simulation_is_the_identified_model_to_the_bit():
    current, model = telegraph(), small_model()
    resistance, deflection = predict(simulation(), stimulus(current))
    v = simulate_heating(current, PERIOD_S, TAU_S)
    assert (resistance == np.exp(-model.resistance_preisach.simulate(v))).all()
    assert (deflection == model.deflection_preisach.simulate(v)).all()


@pytest.mark.parametrize("identity", list(MECHANISMS))
def test_a_neutral_mechanism_is_not_there_to_the_bit(identity):
    given = stimulus(telegraph())
    nominal = predict(simulation(), given)
    for one, other in zip(predict(simulation().extended((identity,)), given), nominal, strict=True):
        assert (one == other).all()


def test_a_linear_current_heats_by_the_square_between_its_samples():
    current = np.array([4.0, 6.0, 5.0, 8.0, 8.0])
    model = small_model()
    _, deflection = predict(simulation(), stimulus(current, "linear"))
    times = np.arange(5) * PERIOD_S

    def power(t):
        return np.interp(t, times, current) ** 2

    s = [16.0]
    for end in times[1:]:
        found = 0.0
        for begin in times[times < end]:
            found += quad(
                lambda t, end=end: power(t) * np.exp((t - end) / TAU_S) / TAU_S, begin, begin + PERIOD_S,
                epsabs=1e-13, epsrel=1e-12,
            )[0]  # fmt: skip
        s.append(found + 16.0 * np.exp(-end / TAU_S))
    assert deflection == pytest.approx(model.deflection_preisach.simulate(np.sqrt(s)), abs=1e-9)


def test_a_band_limited_current_that_is_slow_is_nearly_a_linear_one():
    current = 6.0 + 2.0 * np.sin(np.linspace(0.0, 6.0, 800))
    linear, limited = (
        predict(simulation(), stimulus(current, hold))[1] for hold in ("linear", "band-limited")
    )
    assert np.abs(limited - linear).max() < 2e-3


def test_gains_turn_about_the_middle_and_offsets_add():
    made, given = simulation(), stimulus(telegraph())
    resistance, deflection = predict(made, given)
    values = moved(
        made, resistance_gain=1.1, resistance_offset=0.2, deflection_gain=0.9, deflection_offset=2.0
    )
    found = made.predict(given, values).outputs
    middle = 0.5 * (np.log(11.2e3) + np.log(130.0e3))
    expected = middle + 1.1 * (np.log(resistance) - middle) + 0.2
    assert np.log(found["resistance"][0]) == pytest.approx(expected, abs=1e-12)
    assert found["deflection"][0] == pytest.approx(27.0 + 0.9 * (deflection - 27.0) + 2.0, abs=1e-11)
    current = made.predict(given, moved(made, current_gain=1.02, current_offset=0.1)).outputs["deflection"][0]
    other = 6.1 + 1.02 * (given.inputs["current"] - 6.1) + 0.1
    assert current == pytest.approx(predict(made, stimulus(other))[1], abs=1e-10)


def test_extended_models_are_written_and_read_back(tmp_path):
    made = simulation(sensor__lag={"time_constant": 2e-3})
    made = made.with_values(moved(made, time_constant=2e-3, deflection_gain=1.01))
    model = extended_model(made, {"sensor.lag.time_constant": (1.9e-3, 2.1e-3)})
    write_model(model, tmp_path / "model.toml")
    again = vo2_simulation(read_model(tmp_path / "model.toml"), UNITS, "again")
    assert [(one.name, one.value) for one in again.parameters] == [
        (one.name, one.value) for one in made.parameters
    ]
    assert again.model.mechanisms[0].parameters["time_constant"].high == 2.1e-3
    assert list(again.model.corrections) == ["deflection_gain"]


@pytest.mark.parametrize(
    ("identity", "parameters", "words"),
    [
        ("sensor.lg", {}, ['"sensor.lg" is no mechanism of a vo2', "sensor.lag"]),
        ("sensor.lag", {}, ["need at least one of time_constant"]),
        ("sensor.lag", {"time_constnt": Value(value=1.0, unit="s")}, ["time_constnt", "time_constant"]),
        ("sensor.lag", {"time_constant": Value(value=1.0, unit="mA")}, ['unit "mA" is not compatible with s']),
        ("sensor.lag", {"time_constant": Value(value=-1.0, unit="ms")}, ["-0.001 s must lie between 0 and 1000 s"]),
    ],
)  # fmt: skip
def test_wrong_mechanisms_are_named(identity, parameters, words):
    model = dataclasses.replace(
        small_model(), mechanisms=(MechanismTable(id=identity, parameters=parameters),)
    )
    with pytest.raises(InputError) as error:
        vo2_simulation(model, UNITS, "bad.toml")
    assert [word for word in ["bad.toml: model.mechanisms.0", *words] if word not in str(error.value)] == []
