"""How large the error is that named causes leave beside the noise, and whether it matters.

With a residual of r times the noise s (RMS), s sqrt(r^2 - 1) is left beside it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rtctl.diagnosis.report.words.noise import Noise
from rtctl.output.readable_units import readable

SMALL, ALIKE = 0.5, 2.0
"""What is left over the noise, up to which it is small beside it, and up to which it is of its size."""


class Remainder(NamedTuple):
    """What is left beside the noise (RMS)."""

    output: str
    unit: str
    over_noise: float
    """What is left over the noise."""
    noise: Noise
    size: float
    """The reading itself, in `unit`."""

    @classmethod
    def of(cls, residual_over_noise: float, output: str, unit: str, noise: Noise, size: float) -> Remainder:
        """Return what is left where the whole residual is so many times the noise."""
        over = math.sqrt(max(residual_over_noise**2 - 1.0, 0.0))
        return cls(output, unit, over, noise, size)

    @property
    def in_words(self) -> str:
        """Return its size and whether it matters, as a sentence."""
        if self.noise.may_hold_misfit:
            whole = self.noise.rms * math.hypot(self.over_noise, 1.0)
            certain = self._size(self.noise.unpredictable_rms)
            return (
                f"What is left is {self._size(whole)} (RMS), {self._share(whole)}. Only {certain} of it is certainly "
                "noise, which cannot be predicted from what came before; the rest is as smooth as a motion, and may be "
                "slow noise or what the model lacks."
            )
        rms = self.over_noise * self.noise.rms
        return f"What is left beside the noise is {self._size(rms)} (RMS), {self._share(rms)}: {self._judgement}."

    def _size(self, rms: float) -> str:
        return f"{100.0 * rms:.2g} %" if self.unit.startswith("ln(") else readable(rms, self.unit, 3)

    def _share(self, rms: float) -> str:
        return f"{100.0 * rms / self.size:.2g} % of the {self.output.replace('_', ' ')} itself"

    @property
    def _judgement(self) -> str:
        times = f"{self.over_noise:.2g} times the noise"
        if self.over_noise <= SMALL:
            return (
                f"{times}, so nothing to worry about for predictions. It is there, and says only that the causes "
                "named are not the exact law"
            )
        if self.over_noise <= ALIKE:
            return f"about the size of the noise ({times}), so predictions can get a little better at most"
        return f"{times}, so it matters: the model still lacks something that can be seen"
