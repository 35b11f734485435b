"""Where a record takes the relays: the identified loops along that path give what the simulation gave."""

from __future__ import annotations

import numpy as np
import pytest
from vo2_model_cases import predict, simulation, stimulus, telegraph


@pytest.mark.parametrize(
    "mechanisms",
    [
        {},
        {"thermal__second_time_constant": {"share": 0.3, "time_constant": 0.02}},
        {"thermal__latent_heat": {"heat": 10.0}},
        {"sensor__lag": {"time_constant": 2e-3}},
    ],
)
def test_a_read_out_along_the_path_gives_the_simulated_deflection(mechanisms):
    made, given = simulation(**mechanisms), stimulus(telegraph())
    path = made.loop_path(given, np.array([one.value for one in made.parameters]))
    read = made.model.deflection_preisach
    assert len(path.sampled) == given.samples
    np.testing.assert_allclose(read.simulate(path.v)[path.sampled], path.deflection, atol=1e-9)
    np.testing.assert_allclose(path.deflection, predict(made, given)[1], atol=1e-9)


def test_the_reading_is_that_of_the_loops_before_any_instrument():
    plain, leaking = simulation(), simulation(sensor__crosstalk={"leak": 3e2})
    given = stimulus(telegraph())
    values = np.array([one.value for one in leaking.parameters])
    reading = leaking.loop_path(given, values).reading
    np.testing.assert_allclose(np.exp(-reading), predict(plain, given)[0], rtol=1e-12)
