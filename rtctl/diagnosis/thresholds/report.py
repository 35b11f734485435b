"""Thresholds of the answer and its pages: each with its unit, its reason and the measurement that chose it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportThresholds:
    """Numbers of the answer and its pages."""

    max_probability: float = 0.999
    """Largest probability of a cause: the catalogue is not the world."""
    identification_error_share: float = 0.1
    """Fraction of the removable squared error below which a correction of the identified model, beside other causes,
    is an error of the identification and no cause."""
    nearest_removed_share: float = 0.5
    """Fraction of the squared error on test records that the nearest single cause must remove to be mentioned where
    none is named."""
    offset_removed_share: float = 0.5
    """Fraction of the squared error beyond the noise that must return without an offset of an identified model, for it
    to be told as a cause."""
    offset_cost_ratio: float = 2.0
    """Largest cost of another change of the heating at rest, over that with the offset, for it to stand beside the
    offset: a change leads beyond the loops that were identified, where they are less sure. On two devices the true one
    left 1.0 and 1.5 times, others 10 times and more."""
    min_headline_share: float = 0.1
    """Fraction of the error along the first coordinate from which a headline names that coordinate."""

    max_table_rows: int = 8
    """Rows of a table of candidates."""
    max_nested_rows: int = 3
    """Rows of a table within a table before it is folded."""
    max_candidates_shown: int = 12
    """Candidates in the figure of the search."""
    dots_per_inch: int = 110
    """Resolution of the figures of the page."""
    noise_bins: int = 1024
    """Frequencies at which the noise density is drawn."""
    min_p_shown: float = 1e-12
    """P-value below which a table shows an upper limit."""
