"""Thresholds of the verification on test records: each with its unit, its reason and the measurement that chose it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class VerificationThresholds:
    """Numbers of the verification on test records."""
