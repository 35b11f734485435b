"""Thresholds of the checks of the data before any fit: each with its unit, its reason and its measurement."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ScreeningThresholds:
    """Numbers of the checks of the data before any fit."""
