"""Estimators: sensed resistance (and known current) to deflection; one method a file, exchangeable by name."""

from __future__ import annotations

from collections.abc import Callable

from rtctl.estimators.composite import CompositeEstimator
from rtctl.estimators.corrected import CorrectedEstimator
from rtctl.estimators.direct import DirectEgpiEstimator, DirectPreisachEstimator
from rtctl.estimators.extended_observer import ExtendedObserver
from rtctl.estimators.gap_free import GapFreeEstimator
from rtctl.estimators.observer import ObserverEstimator
from rtctl.interfaces import Estimator
from rtctl.models.vo2 import Vo2Model
from rtctl.simulations.vo2.loop_dynamics import dynamics_of


def observer_of(model: Vo2Model) -> Estimator:
    """Return the observer for a model: the compiled one of a nominal model, or that of its mechanisms."""
    dynamics = dynamics_of(model)
    return ObserverEstimator(model) if dynamics.is_plain else ExtendedObserver(model, dynamics)


def corrected(estimator: Callable[[Vo2Model], Estimator]) -> Callable[[Vo2Model], Estimator]:
    """Return `estimator`, behind the sensor of a model if it is an extended one."""

    def of(model: Vo2Model) -> Estimator:
        dynamics = dynamics_of(model)
        return estimator(model) if dynamics.is_plain else CorrectedEstimator(estimator(model), dynamics)

    return of


ESTIMATORS: dict[str, Callable[[Vo2Model], Estimator]] = {
    "composite": corrected(CompositeEstimator),
    "gap_free": corrected(GapFreeEstimator),
    "preisach": corrected(DirectPreisachEstimator),
    "egpi": corrected(DirectEgpiEstimator),
    "observer": observer_of,
}
