"""Generic mechanisms of equations: neutral ones change nothing; a file that says them in its terms moves as they do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from equation_cases import TANKS, simulation_of, written

from plant_sim.equations.model import equations_simulation
from plant_sim.equations.reading import read_equations
from plant_sim.equations.simulation import EquationsSimulation
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.border.mechanisms import Scales
from rtctl.border.model_file import Value
from rtctl.border.simulation import Stimulus
from rtctl.models.provenance import write_checked_model

UNITS = {"u": "mV", "y": "V"}
SCALES = Scales(1.0, 1.0, 1.0, 1.0, 0.02, 1600.0, 4.0, 1.0)


def levels(samples: int = 400) -> FloatArray:
    return 1e3 * (3.0 + np.repeat(np.random.default_rng(3).uniform(-2.0, 2.0, samples // 10), 10))


def stimulus() -> Stimulus:
    return Stimulus(inputs={"u": levels()}, holds={"u": "zero"}, period_s=4.0)


@pytest.fixture(scope="module")
def sized(tmp_path_factory: pytest.TempPathFactory) -> EquationsSimulation:
    plain = simulation_of(tmp_path_factory.mktemp("tanks"), TANKS, UNITS)
    values = np.array([one.value for one in plain.parameters])
    reading = plain.predict(stimulus(), values).outputs["y"][0]
    return plain.sized([stimulus()], [{"y": reading}], SCALES)


def acting(
    simulation: EquationsSimulation, identity: str, share: float = 0.05, **shapes: float
) -> EquationsSimulation:
    """With the first amplitude of a mechanism at a share of its scale, and some shapes."""
    extended = simulation.extended((identity,))
    amplitude = extended.mechanisms[-1].amplitudes[0]
    values = [
        share * one.declared.scale(SCALES)
        if one.name == f"{identity}.{amplitude.name}"
        else shapes.get(one.declared.name, one.value)
        for one in extended.parameters
    ]
    return extended.with_values(np.array(values))


def run(simulation: EquationsSimulation) -> FloatArray:
    values = np.array([one.value for one in simulation.parameters])
    made: FloatArray = simulation.predict(stimulus(), values).outputs["y"][0]
    return made


def test_the_catalogue_has_the_mechanisms_of_the_formats(sized: EquationsSimulation) -> None:
    inputs = ("delay", "lag", "offset", "gain_drift", "saturation", "dead_band", "hold", "backlash")
    outputs = ("offset", "lag", "highpass", "saturation", "hum", "drift", "skew")
    states = ("friction", "quadratic", "cubic", "leak", "limit", "slow", "input")
    expected = {
        *(f"input.u.{one}" for one in inputs),
        *(f"output.y.{one}" for one in outputs),
        *(f"state.x1.{one}" for one in states),
        *("parameter.k1.drift", "parameter.k1.dependence"),
    }
    assert expected <= set(sized.catalogue)


def test_every_mechanism_changes_the_reading_and_none_does_at_neutral(sized: EquationsSimulation) -> None:
    plain = run(sized)
    for identity in sized.catalogue:
        assert run(sized.extended((identity,))) == pytest.approx(plain, abs=1e-9), identity
        if identity != "input.u.hold":
            assert np.abs(run(acting(sized, identity)) - plain).max() > 1e-4, identity


IN_TERMS = (
    "input.u.offset", "input.u.gain_drift", "input.u.dead_band", "output.y.drift", "state.x2.friction",
    "state.x1.limit", "parameter.k1.drift",
)  # fmt: skip
BY_ID = ("input.u.delay", "output.y.lag", "state.x1.slow")


@pytest.mark.parametrize(
    ("identity", "shapes"),
    [
        *((identity, {}) for identity in (*IN_TERMS, *BY_ID)),
        ("output.y.drift", {"settling_time": 300.0}),
        ("input.u.gain_drift", {"settling_time": 300.0}),
    ],
)
def test_a_file_with_a_mechanism_moves_as_it_does(
    identity: str, shapes: dict[str, float], sized: EquationsSimulation, tmp_path: Path
) -> None:
    plain, own = run(sized), acting(sized, identity, **shapes)
    tables = {
        identity: {
            one.declared.name: Value(value=one.value, unit=one.unit)
            for one in own.parameters
            if one.mechanism == identity
        }
    }
    file = tmp_path / "extended.toml"
    write_checked_model(file, own.written(read_equations(written(tmp_path, TANKS)), tables))
    again = read_equations(file)
    assert [one.id for one in again.model.mechanisms] == ([identity] if identity in BY_ID else [])
    change = run(own) - plain
    found = run(equations_simulation(again, UNITS, str(file))) - plain
    assert found == pytest.approx(change, abs=2e-5 * max(float(np.abs(change).max()), 1.0))


def test_an_output_that_was_not_measured_has_no_mechanisms_to_try(tmp_path: Path) -> None:
    two = TANKS.replace("[model.parameters]", 'upper = { unit = "cm", value = "x1" }\n[model.parameters]')
    measured_one = simulation_of(tmp_path, two, UNITS)
    assert not [one for one in measured_one.catalogue if one.startswith("output.upper.")]
    assert measured_one.has("output.upper.lag")
    measured_both = simulation_of(tmp_path, two, {**UNITS, "upper": "mm"})
    assert "output.upper.lag" in measured_both.catalogue


def test_a_mistake_in_a_mechanism_of_a_file_is_said(tmp_path: Path) -> None:
    table = '[[model.mechanisms]]\nid = "{}"\nparameters = {{ {} }}\n'
    for identity, given, said in (
        (
            "input.u.delai",
            "",
            'model.mechanisms.0.id = "input.u.delai" is no mechanism of these equations; did you',
        ),
        ("input.u.delay", 'late = { value = 1.0, unit = "s" }', 'has no parameter "late"'),
        ("input.u.delay", 'delay = { value = 1.0, unit = "cm" }', "parameter delay"),
        ("input.u.delay", "", "lacks its parameter delay [s]"),
    ):
        with pytest.raises(InputError) as caught:
            simulation_of(tmp_path, TANKS + table.format(identity, given), UNITS)
        assert said in str(caught.value)
