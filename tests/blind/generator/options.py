"""What `generate` may be told; all else comes from the seed."""

from __future__ import annotations

from dataclasses import dataclass, field

PROPORTIONS = {"null": 0.20, "single": 0.55, "pair": 0.15, "outside": 0.10}


@dataclass(frozen=True, kw_only=True)
class Options:
    """None: drawn from the seed."""

    proportions: dict[str, float] = field(default_factory=lambda: dict(PROPORTIONS))
    kind: str | None = None
    """null | single | pair | outside"""
    effects: tuple[str, ...] | None = None
    """Ids of section 5, those of added.py, or variants of effects outside the catalogue (see outside.py)."""
    variant: str | None = None
    """Variant of the first effect, where it has several."""
    share: tuple[float, float] = (0.06, 0.30)
    f0_Hz: float | None = None
    quality: float | None = None
    shape: str | None = None
    """none | hardening | softening | bistable"""
    samples: int | None = None
    """Longest record."""
    least_samples: int | None = None
    """Shortest record."""
    fit_records: int | None = None
    test_records: int | None = None
    samples_a_period: float | None = None
    hold: str | None = None
    noise: str | None = None
    snr_dB: float | None = None
    file_format: str | None = None
    """csv | parquet | npz | mat"""
    slices: bool | None = None
    """Records as slices of one file."""
    angle: bool = False
    """Whether the displacement is in rad or deg; a pendulum's always is."""
    cut: float = 0.0
    """Share of each record, its beginning, that is not written: what is left begins in motion."""
    parameter_error: float | None = None
    """Largest relative error of the parameters of model.toml."""

    def __post_init__(self) -> None:
        unknown = set(self.proportions) - set(PROPORTIONS)
        if unknown or not sum(self.proportions.values()) > 0.0:
            raise ValueError(f"proportions are of {', '.join(PROPORTIONS)}; got {self.proportions!r}")
        if not 0.0 <= self.cut < 1.0:
            raise ValueError(f"cut is a share of a record, 0 or more and below 1; got {self.cut!r}")
        if self.kind is not None and self.kind not in PROPORTIONS:
            raise ValueError(f"kind is one of {', '.join(PROPORTIONS)}; got {self.kind!r}")
