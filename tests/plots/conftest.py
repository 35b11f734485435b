"""Fixtures of the figures' tests."""

from __future__ import annotations

import pytest
from plots_cases import SteadyStates, damped_oscillation


@pytest.fixture(scope="session")
def steady_states() -> SteadyStates:
    """The simulated device at the ends of the holds of a damped oscillation."""
    return damped_oscillation()
