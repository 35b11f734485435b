"""How much processor time a diagnosis may search: what is done by then is told, and that time ran out is said."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

SECONDS = 70.0
"""Of a diagnosis, so that what is under way then and the answer are done by 90 s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """Asked before each fit; the fit under way is finished, and what is best by then is tested by the gate."""

    seconds: float
    clock: Callable[[], float]
    begun: float

    @classmethod
    def of(cls, seconds: float = SECONDS, clock: Callable[[], float] = time.process_time) -> Budget:
        """`seconds` [s] from now on; of processor time, so that an answer does not depend on what else runs."""
        return cls(seconds=seconds, clock=clock, begun=clock())

    @property
    def spent(self) -> bool:
        """Whether it is used up."""
        return self.clock() - self.begun >= self.seconds
