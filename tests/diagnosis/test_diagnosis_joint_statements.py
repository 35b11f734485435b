"""Dry friction beside a constant force is friction that depends on the direction, and that is said."""

from __future__ import annotations

import pytest
from diagnosis_cases import FRICTION, device

from rtctl.diagnosis.report.joint_statements import friction_by_direction, joint_statements

OFFSET = {"id": "drive.offset", "parameters": {"offset": {"value": 0.1, "unit": "V"}}}


def test_a_constant_force_helps_one_way_and_hinders_the_other() -> None:
    found = friction_by_direction(device(FRICTION, OFFSET))
    assert found is not None
    # level 450 mm/s^2, gain 450 mm/s^2/V times 0.1 V
    assert (found.forwards, found.backwards) == pytest.approx((405.0, 495.0))
    said = joint_statements(device(FRICTION, OFFSET))["friction.coulomb"][0]
    assert "depends on the direction: 405 mm/s^2 against motion forwards, 495 mm/s^2 against" in said


@pytest.mark.parametrize("mechanisms", [(), (FRICTION,), (OFFSET,)])
def test_nothing_is_said_where_one_of_the_two_is_missing(mechanisms: tuple[dict[str, object], ...]) -> None:
    assert joint_statements(device(*mechanisms)) == {}
