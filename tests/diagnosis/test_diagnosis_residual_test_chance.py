"""The chance of a sum of squares beside what is allowed is defined everywhere."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.diagnosis.residual.testing.metrics import score_p_value
from rtctl.diagnosis.thresholds import ResidualThresholds

LEAST = ResidualThresholds().least_noncentral_share


def test_a_direction_that_removes_nothing_is_no_finding_however_much_is_allowed() -> None:
    assert score_p_value(1.4e-8, 1, 1353.0, LEAST) == 1.0
    for allowance in np.geomspace(1e-3, 1e6, 19):
        for statistic in (0.0, 1e-300, *np.geomspace(1e-12, 1e7, 39)):
            for freedom in (1, 22, 60):
                assert 0.0 <= score_p_value(float(statistic), freedom, float(allowance), LEAST) <= 1.0


def test_it_is_that_of_shifted_normal_squares() -> None:
    normal = np.random.default_rng(0).standard_normal((40_000, 3))
    normal[:, 0] += 2.0
    draws = normal**2
    for statistic in (1.0, 6.0, 15.0):
        share = float(np.mean(draws.sum(axis=1) > statistic))
        assert score_p_value(statistic, 3, 4.0, LEAST) == pytest.approx(share, abs=0.01)
