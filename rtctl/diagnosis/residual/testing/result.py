"""The result of a statistical test."""

from __future__ import annotations

from typing import Any, NamedTuple


class ResidualTest(NamedTuple):
    """One test of the residual."""

    name: str
    """What was tested, for a person."""
    statistic: float
    """Value of the test statistic."""
    degrees_of_freedom: int
    """Degrees of freedom of the statistic, 1 for a rank correlation; of an F statistic those of the numerator."""
    p_value: float
    """Probability of a statistic at least as large where the null hypothesis holds."""

    def as_json(self) -> dict[str, Any]:
        """Return the test as `diagnosis.json` has it."""
        return {
            "name": self.name,
            "statistic": self.statistic,
            "freedom": self.degrees_of_freedom,
            "p_value": self.p_value,
        }
