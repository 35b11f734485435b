"""How large the error is that named causes leave beside the noise, and whether it matters.

With a residual of r times the noise s (RMS), s sqrt(r^2 - 1) is left beside it. It is that of the fitted records or, of
free runs, that of the test records: predictions are judged by whichever is more times the noise.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rtctl.diagnosis.report.words.noise import Noise
from rtctl.output.readable_units import readable

SMALL, ALIKE = 0.5, 2.0
"""What is left over the noise, up to which it is small beside it, and up to which it is of its size."""


class RecordsError(NamedTuple):
    """Error over the fitted records, or of free runs over the test records (RMS), in the reading's unit."""

    rms: float
    noise_rms: float
    """RMS of the noise in it."""

    @property
    def over_noise(self) -> float:
        """What is left beside the noise, over the noise; 0 where no noise is known."""
        if not (self.noise_rms > 0.0 and math.isfinite(self.rms)):
            return 0.0
        return math.sqrt(max((self.rms / self.noise_rms) ** 2 - 1.0, 0.0))


class Remainder(NamedTuple):
    """What is left beside the noise (RMS)."""

    output: str
    unit: str
    over_noise: float
    """What is left on the fitted records over the noise."""
    noise: Noise
    size: float
    """The reading itself, in `unit`."""
    tests: RecordsError | None = None
    """Error on the test records; None: there are none."""

    @classmethod
    def of(  # 6 parameters because it is what two kinds of records leave of one reading
        cls,
        residual_over_noise: float,
        output: str,
        unit: str,
        noise: Noise,
        size: float,
        tests: RecordsError | None = None,
    ) -> Remainder:
        """Return what is left where the whole residual of the fitted records is so many times the noise."""
        over = math.sqrt(max(residual_over_noise**2 - 1.0, 0.0))
        return cls(output, unit, over, noise, size, tests)

    @property
    def in_words(self) -> str:
        """Return its size, on which records, and whether it matters, as a sentence."""
        shown, place = self._shown, "on the test records" if self._is_by_tests else "on the fitted records"
        is_beyond_noise = self._is_by_tests and shown.over_noise > ALIKE
        if self.noise.may_hold_misfit and not is_beyond_noise:
            certain = self._size(self.noise.unpredictable_rms)
            return (
                f"What is left {place} is {self._size(shown.rms)} (RMS), {self._share(shown.rms)}. Only {certain} of "
                "it is certainly noise, which cannot be predicted from what came before; the rest is as smooth as a "
                "motion, and may be slow noise or what the model lacks."
            )
        rms = shown.over_noise * shown.noise_rms
        return (
            f"What is left beside the noise {place} is {self._size(rms)} (RMS), {self._share(rms)}: "
            f"{self._judgement}."
        )

    @property
    def _shown(self) -> RecordsError:
        """Error of those records that show more over the noise."""
        if self.tests is not None and self.tests.over_noise > self.over_noise:
            return self.tests
        return RecordsError(self.noise.rms * math.hypot(self.over_noise, 1.0), self.noise.rms)

    @property
    def _is_by_tests(self) -> bool:
        """Whether the test records show more than the fitted ones."""
        return self._shown is self.tests

    def _size(self, rms: float) -> str:
        return f"{100.0 * rms:.2g} %" if self.unit.startswith("ln(") else readable(rms, self.unit, 3)

    def _share(self, rms: float) -> str:
        return f"{100.0 * rms / self.size:.2g} % of the {self.output.replace('_', ' ')} itself"

    @property
    def _judgement(self) -> str:
        """Whether predictions suffer from it; in free runs over the test records, small differences grow as well."""
        over, fitted = self._shown.over_noise, ""
        if self._is_by_tests:
            fitted = f". On the fitted records it is {self.over_noise:.2g} times the noise"
        times = f"{over:.2g} times the noise"
        if self.tests is not None and not math.isfinite(self.tests.rms):
            return f"{times}, but free runs over the test records diverge, so no prediction holds there"
        if over <= SMALL:
            return (
                f"{times}, so nothing to worry about for predictions. It is there, and says only that the causes "
                "named are not the exact law"
            )
        if over <= ALIKE:
            said = f"about the size of the noise ({times}), so predictions can get a little better at most"
        elif fitted and self.over_noise <= ALIKE:
            said = f"{times}, so predictions are off by more than the noise"
            fitted += ": the model lacks what shows on the test records alone, or its small errors grow in long runs"
        else:
            said = f"{times}, so it matters: the model still lacks something that can be seen"
        return said + fitted
