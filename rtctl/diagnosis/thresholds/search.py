"""Thresholds of the stepwise search: each with its unit, its reason and the measurement that chose it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchThresholds:
    """Numbers of the stepwise search."""
