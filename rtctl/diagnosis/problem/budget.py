"""How much processor time a diagnosis may search: what is done by then is told, and that time ran out is said."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

SECONDS = 66.0
"""Of a diagnosis, so that what is under way then and the answer are done by 90 s."""
AFTER = 15.0
"""So much later [s] no further comparison goes on, unless it had less than LEAST."""
LEAST = 3.0
"""Of a further comparison [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """Asked before each fit and between its steps; what is best by then is tested by the gate."""

    seconds: float
    clock: Callable[[], float]
    begun: float

    @classmethod
    def of(cls, seconds: float = SECONDS, clock: Callable[[], float] | None = None) -> Budget:
        """`seconds` [s] from now on; of `working_time`, so that an answer depends neither on what else runs nor on
        whether a kernel is compiled already.
        """
        if clock is None:
            from rtctl.diagnosis.problem.compile_time import working_time

            clock = working_time
        return cls(seconds=seconds, clock=clock, begun=clock())

    def further(self, seconds: float) -> Budget:
        """For a comparison of `seconds` from now on, which may outlast this one by AFTER."""
        left = self.begun + self.seconds + AFTER - self.clock()
        return Budget.of(min(seconds, max(LEAST, left)), self.clock)

    @property
    def left(self) -> float:
        """Seconds."""
        return self.seconds - (self.clock() - self.begun)

    @property
    def spent(self) -> bool:
        """Whether it is used up."""
        return self.left <= 0.0
