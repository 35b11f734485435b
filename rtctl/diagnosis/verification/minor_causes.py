"""Causes of a partial explanation that the unknown rest may as well have made."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.residual.noise_floor import noise_cost_of
from rtctl.diagnosis.search.holdout_support import sum_squared_errors
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.identification.fit_record import FitRecord


def list_minor_causes(search: SearchResult, problem: Problem, tests: Sequence[FitRecord]) -> tuple[str, ...]:
    """Return the causes that remove less than is left beyond the noise, of fitted records and of test records.

    What is left has a cause that is not known, and a small law of the catalogue takes up a part of it, whichever it is.
    The cause that removes most is not among them. Both have to say so: free runs over whole test records may drift for
    other reasons.

    Args:
        search: Outcome of a search whose set does not pass the residual tests.
        problem: Records that were fitted.
        tests: Records that took no part in a fit.
    """
    chosen = search.chosen.hypothesis
    if search.passes or not tests or len(search.leave_one_out) < 2:
        return ()
    share = problem.thresholds.search.shown_share if _has_own_parameters(search) else 0.0
    error = sum_squared_errors(chosen, problem, tests, share)
    returning, fitted = {}, {}
    for one in search.leave_one_out:
        (name,) = set(chosen.mechanisms) - set(one.mechanisms)
        returning[name] = _common_sum(sum_squared_errors(one, problem, tests, share) - error)
        fitted[name] = one.cost - chosen.cost
    beyond = 1.0 - min(noise_cost_of(search.chosen) / chosen.cost, 1.0)
    left = beyond * _common_sum(error)
    largest = max(fitted, key=lambda name: fitted[name])
    return tuple(
        name
        for name, back in returning.items()
        if back < left and fitted[name] < beyond * chosen.cost and name != largest
    )


def _has_own_parameters(search: SearchResult) -> bool:
    parameters = search.chosen.hypothesis.simulation.parameters
    return any(parameter.declared.per_record for parameter in parameters)


def _common_sum(squares: np.ndarray) -> float:
    """Return the sum over the records that can be simulated; infinite where none can."""
    seen = np.isfinite(squares)
    return float(squares[seen].sum()) if seen.any() else float("inf")
