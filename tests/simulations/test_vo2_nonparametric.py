"""Laws of no name against their sentences, written out a second time."""

from __future__ import annotations

import numpy as np
import pytest
from vo2_dense_oracle import STEPS, dense
from vo2_model_cases import predict, simulation, stimulus, telegraph

from rtctl.simulations.vo2 import MECHANISMS, Vo2Simulation
from rtctl.simulations.vo2.nonparametric import UNNAMED
from rtctl.wiring_models import mechanism_ids

CURRENT = telegraph(120, seed=4)


def balanced(**values: float) -> Vo2Simulation:
    made = simulation().extended(("nonparametric.heat_balance",))
    own = [values.get(one.declared.name, 0.0) if one.mechanism else one.value for one in made.parameters]
    return made.with_values(np.array(own))


@pytest.mark.parametrize(
    ("values", "oracle"),
    [
        ({"cooling": 1.5}, {"cooling": 1.5}),
        ({"cooling": -0.5}, {"cooling": -0.5}),
        ({"heat": 4.0, "cooling": 0.5}, {"latent": 4.0, "cooling": 0.5}),
        ({"sharpness": 20.0}, {"sharpness": 20.0}),
        ({"film": 4.0}, {"film_heat": 4.0}),
    ],
)
def test_the_film_follows_as_fast_as_its_state_and_direction_let_it(
    values: dict[str, float], oracle: dict[str, float]
) -> None:
    _, nominal = predict(simulation(), stimulus(CURRENT))
    _, deflection = predict(balanced(**values), stimulus(CURRENT))
    expected = dense(CURRENT, **oracle).deflection[::STEPS]
    effect = np.std(expected - nominal)
    assert effect > 1e-3 * np.std(nominal)
    assert np.std(deflection - expected) < 0.05 * effect


def test_where_it_comes_to_rest_does_not_depend_on_them() -> None:
    slow = np.repeat([4.0, 6.0, 7.5, 8.2, 6.5, 5.0], 80)
    nominal = predict(simulation(), stimulus(slow))[1][79::80]
    found = predict(balanced(heat=5.0, film=3.0, cooling=1.0, sharpness=10.0), stimulus(slow))[1][79::80]
    assert found == pytest.approx(nominal, abs=0.01 * np.ptp(nominal))


def test_the_capacity_that_grows_with_the_change_of_phase_is_latent_heat() -> None:
    _, latent = predict(simulation(thermal__latent_heat={"heat": 4.0}), stimulus(CURRENT))
    assert predict(balanced(heat=4.0), stimulus(CURRENT))[1] == pytest.approx(latent, abs=1e-12)


def test_a_model_that_has_latent_heat_keeps_it() -> None:
    latent = simulation(thermal__latent_heat={"heat": 4.0})
    _, alone = predict(latent, stimulus(CURRENT))
    both = latent.extended(("nonparametric.heat_balance",))
    own = [1e-9 if one.declared.name == "cooling" else one.value for one in both.parameters]
    assert predict(both.with_values(np.array(own)), stimulus(CURRENT))[1] == pytest.approx(alone, abs=1e-6)


def test_they_are_no_causes() -> None:
    assert not set(UNNAMED) & (set(MECHANISMS) | set(mechanism_ids("vo2")))
