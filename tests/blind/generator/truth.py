"""What the generator knows and the diagnosis must find out; never written beside the data."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
OUTSIDE = "outside catalogue"


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A value with its unit."""

    value: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Effect:
    """One hidden effect."""

    id: str
    """An id of formats.md section 5, or 'outside catalogue'."""
    variant: str
    """Which physics of that name; for an effect outside the catalogue, what it is."""
    parameters: dict[str, Quantity]
    share: float
    """rms(with - without this effect) / rms(with), all fit records, noise-free, true parameters."""


@dataclass(frozen=True, kw_only=True)
class Noise:
    """What was added to the noise-free displacement."""

    kind: str
    """white | ar1 | ar2 | one-over-f | quantised"""
    rms: float
    snr_db: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class RecordTruth:
    """One record as it was driven and before noise."""

    name: str
    """The file's name; slices of one file: name[rows]."""
    use: str
    excitation: str
    drive: FloatArray
    clean: FloatArray
    """Noise-free displacement as the sensor gives it, in the signal's unit."""
    measured: FloatArray


@dataclass(frozen=True, kw_only=True)
class Truth:
    """All about one case."""

    seed: int
    plant: str
    effects: tuple[Effect, ...]
    parameters: dict[str, Quantity]
    """The device's true nominal parameters; model.toml holds them up to some 10 % off."""
    f0_Hz: float
    quality: float
    sample_rate_Hz: float
    samples_a_period: float
    hold: str
    """What the manifest says."""
    noise: Noise
    records: tuple[RecordTruth, ...]
    share: float
    """rms(all effects - none) / rms(all effects), fit records, at the true parameters."""
    refitted_share: float
    """The same where the nominal model's own parameters were re-fitted to the noise-free outputs."""
    refitted_miss_over_noise: float
    """rms missed by that re-fit over the noise's rms: under about 0.1 the effect cannot be seen."""
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

    def to_dict(self) -> dict[str, Any]:
        """Everything but the long arrays, for a JSON file kept elsewhere."""
        summary = asdict(self)
        for record in summary["records"]:
            for name in ("drive", "clean", "measured"):
                del record[name]
        return summary | {"ids": self.ids, "expected_verdict": self.expected_verdict}
