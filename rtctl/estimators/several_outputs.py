"""Estimates of several controlled outputs beside the loop's own one."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rtctl.interfaces import Estimate, Estimator

Further = Callable[[Sequence[float], Sequence[float]], tuple[float, ...]]
"""Function of levels and readings that returns the further outputs, each in its unit."""


class SeveralEstimates(Estimate):
    """An estimate that the loop records as any other one, with those of further outputs."""

    further: tuple[float, ...]
    """Each in its unit."""


class SeveralOutputs:
    """`rtctl.interfaces.Estimator` that asks for the further outputs after each step of another one."""

    def __init__(self, estimator: Estimator, further: Further) -> None:
        """Build the estimator.

        Args:
            estimator: Estimator of the loop's own output.
            further: What the other outputs are after its step.
        """
        self.surrogate = estimator.surrogate
        self._estimator, self._further = estimator, further

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """See `Estimator`."""
        return self._with_further(self._estimator.start(levels, sensed), levels, sensed)

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """See `Estimator`."""
        return self._with_further(self._estimator.step(levels, sensed, elapsed_s), levels, sensed)

    def _with_further(self, one: Estimate, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        made = SeveralEstimates(*one)
        made.further = self._further(levels, sensed)
        return made
