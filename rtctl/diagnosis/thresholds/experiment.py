"""Thresholds of the design of the next experiment: each with its unit, its reason and the measurement that chose it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentThresholds:
    """Numbers of the design of the next experiment."""
