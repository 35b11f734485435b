"""Estimators: sensed resistance (and known current) to deflection; one method a file, exchangeable by name."""

from __future__ import annotations

from collections.abc import Callable

from rtctl.estimators.composite import CompositeEstimator
from rtctl.estimators.direct import DirectEgpiEstimator, DirectPreisachEstimator
from rtctl.estimators.gap_free import GapFreeEstimator
from rtctl.estimators.observer import ObserverEstimator
from rtctl.interfaces import Estimator
from rtctl.models.vo2 import Vo2Model

ESTIMATORS: dict[str, Callable[[Vo2Model], Estimator]] = {
    "composite": CompositeEstimator,
    "gap_free": GapFreeEstimator,
    "preisach": DirectPreisachEstimator,
    "egpi": DirectEgpiEstimator,
    "observer": ObserverEstimator,
}
