"""A fit with a further mechanism is no worse than without it, however far off its first step was."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import device, friction_case

from rtctl.diagnosis.approach import fitted_nominal
from rtctl.diagnosis.checks import split
from rtctl.diagnosis.hypothesis import Data, Hypothesis
from rtctl.diagnosis.race import Runner, race
from rtctl.diagnosis.subjects import SUBJECTS
from rtctl.identification.scales import scales_of
from rtctl.measured import read_dataset


@pytest.fixture(scope="module")
def fitted_case(tmp_path_factory: pytest.TempPathFactory) -> tuple[Data, Hypothesis]:
    folder: Path = tmp_path_factory.mktemp("race")
    records, _, _ = split(read_dataset(friction_case(folder)), SUBJECTS["oscillator"])
    data = Data(
        subject=SUBJECTS["oscillator"], records=records, scales=scales_of(records), steps_per_period=64.0
    )
    nominal = fitted_nominal(data, device(), ())
    assert nominal is not None
    return data, nominal


def runner(nominal: Hypothesis, coefficient: float) -> Runner:
    """With a cubic spring of so many [1/(mm^2 s^2)] at the start."""
    neutral = nominal.simulation.extended(("stiffness.cubic",))
    values = np.array([parameter.value for parameter in neutral.parameters])
    values[-1] = coefficient
    return Runner(
        mechanisms=("stiffness.cubic",), simulation=neutral.with_values(values), starts=nominal.starts,
        still=frozenset(), neutral=neutral, parent=nominal,
    )  # fmt: skip


def test_a_step_to_another_branch_is_taken_again_shorter(fitted_case: tuple[Data, Hypothesis]) -> None:
    data, nominal = fitted_case
    (near,) = race(data, [runner(nominal, 0.0)], lambda text: None)
    (astray,) = race(data, [runner(nominal, 1e7)], lambda text: None)
    assert near.cost <= nominal.cost
    assert astray.cost == pytest.approx(near.cost, rel=1e-3)


def test_a_shorter_step_ends_between_the_parent_and_the_first(fitted_case: tuple[Data, Hypothesis]) -> None:
    _, nominal = fitted_case
    whole = runner(nominal, 200.0)
    part = whole.shorter(0.1)
    assert part.simulation.parameters[-1].value == pytest.approx(20.0)
    np.testing.assert_allclose(part.starts, nominal.starts)
    assert whole.shorter(1.0).simulation.parameters == whole.simulation.parameters
