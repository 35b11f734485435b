"""Default budgets of a diagnosis, which the command line shows in its help without importing what is heavy."""

from __future__ import annotations

from rtctl.diagnosis.thresholds.budget import BudgetThresholds

WORK: float = BudgetThresholds().search
"""Simulated steps after which no further fit begins."""
SECONDS = 1800.0
"""Outer guard of wall-clock time [s]; an answer that it cut depends on the machine and says so."""
