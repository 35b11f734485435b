"""How loud the noise of a reading is, as far as that can be known beside a misfit.

A noise model that most of the noise can be predicted by, from what came before, may have taken up what a model lacks:
then only the unpredictable part is certainly noise.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rtctl.diagnosis.result import Diagnosis
from rtctl.output.readable_units import readable

PREDICTABLE = 3.0
"""RMS of the noise over that of its unpredictable part, from which on a smooth misfit may be in it."""


class Noise(NamedTuple):
    """Noise of a reading (RMS), in its unit."""

    rms: float
    unpredictable_rms: float
    """Of the part that what came before does not tell."""

    @classmethod
    def of(cls, diagnosis: Diagnosis) -> Noise:
        """Return the noise of the subject's output; without an unpredictable part where no fit has that output."""
        chosen, output = diagnosis.search.chosen, diagnosis.problem.subject.output
        outputs = chosen.hypothesis.sensitivity.outputs
        variance = chosen.noise[outputs.index(output)].variance if output in outputs else math.nan
        return cls(diagnosis.noise_rms, math.sqrt(variance))

    @property
    def may_hold_misfit(self) -> bool:
        """Whether most of it can be predicted, as a motion can."""
        return self.rms > PREDICTABLE * self.unpredictable_rms


def describe_noise(diagnosis: Diagnosis) -> str:
    """Return the noise beside the gain on test records: a range where what is not explained may be in it."""
    gain = diagnosis.gain
    if gain is None:
        return ""
    loudest = readable(gain.noise_floor, gain.unit)
    noise = Noise.of(diagnosis)
    explained = diagnosis.verdict not in ("unexplained", "partly_explained")
    if explained or gain.output != diagnosis.problem.subject.output or not noise.may_hold_misfit:
        return f"noise {loudest}"
    return f"noise between {readable(noise.unpredictable_rms, gain.unit)} and {loudest}"
