"""Sensitivities against SALib's, on the Ishigami function and on the study's own output."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from rtctl.reproduce.me.steps.sensitivity import PERTURBATION, latin_hypercube, sensitivity

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from SALib.analyze import dgsm
    from SALib.sample import finite_diff, latin

LOW, HIGH = np.full(3, 0.5), np.full(3, 3.0)
PROBLEM = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": np.column_stack((LOW, HIGH)).tolist()}


def ishigami(x: np.ndarray) -> np.ndarray:
    return np.asarray(np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0]))


def test_a_latin_hypercube_has_one_point_in_each_part_of_every_range_as_saltelli_s_library_does():
    ours = latin_hypercube(LOW, HIGH, 50, 1)
    theirs = latin.sample(PROBLEM, 50, seed=1)
    for points in (ours, theirs):
        parts = np.floor((points - LOW) / (HIGH - LOW) * 50).astype(int)
        assert (np.sort(parts, axis=0) == np.arange(50)[:, None]).all()


def test_the_bound_of_the_total_index_is_salib_s_at_the_same_points():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        moved = finite_diff.sample(PROBLEM, 256, delta=1e-6, seed=3)
        theirs = dgsm.analyze(PROBLEM, moved, ishigami(moved), num_resamples=2, seed=3)
    ours = sensitivity(ishigami, LOW, HIGH, moved[::4])
    # forward differences of 1e-5 and 1e-6: a curvature times the step
    assert ours.total_bound == pytest.approx(np.asarray(theirs["dgsm"], dtype=float), rel=1e-3)


def test_the_elasticity_of_a_power_law_is_its_exponents():
    found = sensitivity(
        lambda x: x[:, 0] ** 2 * np.sqrt(x[:, 1]) / x[:, 2], LOW, HIGH, latin_hypercube(LOW, HIGH, 20, 2)
    )
    assert found.elasticity == pytest.approx([2.0, 0.5, 1.0], rel=3.0 * PERTURBATION)
