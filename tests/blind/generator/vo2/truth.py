"""What the generator knows of a vo2 case; the same names as an oscillator's Truth wherever they mean the same."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from ..truth import OUTSIDE, Effect, FloatArray, Noise, Quantity

ARRAYS = ("drive", "clean", "measured")


@dataclass(frozen=True, kw_only=True)
class Vo2Record:
    """One record as it was driven and before noise."""

    name: str
    use: str
    excitation: str
    sample_rate_Hz: float
    drive: FloatArray
    """Current, mA."""
    clean: dict[str, FloatArray]
    """Noise-free resistance [ohm] and deflection [um], the latter also where the file lacks it."""
    measured: dict[str, FloatArray]
    """As in the file."""


@dataclass(frozen=True, kw_only=True)
class Vo2Truth:
    """All about one case."""

    seed: int
    plant: str
    effects: tuple[Effect, ...]
    parameters: dict[str, Quantity]
    sample_rate_Hz: float
    hold: str
    noises: dict[str, Noise]
    """By output."""
    records: tuple[Vo2Record, ...]
    share: float
    """How far all effects move the response, fit records, the worse of both outputs: rms(with - without) / rms of
    `with` about its mean. `without` is what a faultless quasi-static identification of the device would simulate:
    the effect's own static part is in it (see plant.twin), so that the share can be seen in the dynamics."""
    refitted_share: float
    """The same after re-fitting the time constant and each output's gain and offset to the noise-free outputs."""
    refitted_miss_over_noise: float
    """Miss of that re-fit over the noise, rms of both outputs: under about 0.1 the effect cannot be seen."""
    equivalent: tuple[str, ...] = field(default=())
    """Other ids that describe the same outputs by construction (not a complete list)."""

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of the hidden effects, none for a null."""
        return tuple(effect.id for effect in self.effects)

    @property
    def expected_verdict(self) -> str:
        """The verdict of formats.md section 4 that a perfect diagnosis gives (a null may name parameters)."""
        if not self.effects:
            return "adequate"
        return "unexplained" if OUTSIDE in self.ids else "explained"

    @property
    def noise(self) -> Noise:
        """Of the resistance."""
        return self.noises["resistance"]

    def to_dict(self) -> dict[str, Any]:
        """Everything but the long arrays, for a JSON file kept elsewhere."""
        summary = asdict(self)
        for record in summary["records"]:
            for name in ARRAYS:
                del record[name]
        return summary | {"ids": self.ids, "expected_verdict": self.expected_verdict}
