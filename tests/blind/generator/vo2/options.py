"""What `generate(..., plant="vo2")` may be told; all else comes from the seed."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..options import PROPORTIONS


@dataclass(frozen=True, kw_only=True)
class Vo2Options:
    """None: drawn from the seed."""

    proportions: dict[str, float] = field(default_factory=lambda: dict(PROPORTIONS))
    kind: str | None = None
    """null | single | pair | outside"""
    effects: tuple[str, ...] | None = None
    """Ids of section 5, or variants of effects outside the catalogue (see outside.py)."""
    share: tuple[float, float] = (0.06, 0.30)
    sample_rate_Hz: float | None = None
    samples: int | None = None
    """Longest fit or test record."""
    fit_records: int | None = None
    test_records: int | None = None
    identify_records: int | None = None
    noise: str | None = None
    snr_dB: float | None = None
    file_format: str | None = None
    """csv | parquet | npz | mat"""
    missing_deflection: bool | None = None
    """Whether one fit or test record has no deflection."""

    def __post_init__(self) -> None:
        unknown = set(self.proportions) - set(PROPORTIONS)
        if unknown or not sum(self.proportions.values()) > 0.0:
            raise ValueError(f"proportions are of {', '.join(PROPORTIONS)}; got {self.proportions!r}")
        if self.kind is not None and self.kind not in PROPORTIONS:
            raise ValueError(f"kind is one of {', '.join(PROPORTIONS)}; got {self.kind!r}")
