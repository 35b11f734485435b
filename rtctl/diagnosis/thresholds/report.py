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
    changed_signal_share: float = 0.9
    """Fraction of the squared error beyond the noise that must return without corrections of one of an identified
    model's signals, for a change of that signal at rest to be told as a cause. On foreign devices it is at least 0.99
    where the input had changed since the identification, and at most 0.8 where it had not."""
    changed_signal_cost_ratio: float = 2.0
    """Largest cost of a change of a signal at rest over that of the best one, for it to stand beside it. A change
    leads beyond the loops that were identified, where they are less sure: a true one left 1.5 times the best one's
    cost, others left 10 times and more."""
    changed_signal_misfit: float = 2.0
    """RMS misfit without corrections of a signal over what the identification promises, above which a change of the
    signal may be told."""
    min_headline_share: float = 0.1
    """Fraction of the error along the first coordinate from which a headline names that coordinate."""

    unseen_effect: float = 10.0
    """RMS change of the outputs over the noise, above which an effect that the fitted parameters take up is mentioned
    where nothing is seen. Effects that are combinations of parameters are at 1e3 and more, the next ones at 4."""
    explained_error: float = 3.0
    """Error on the test records over the noise above which an answer that nothing is wrong says why both may hold."""
    max_table_rows: int = 8
    """Rows of a table of inputs."""
    max_nested_rows: int = 3
    """Rows of a table within a table before it is folded."""
    max_candidates_shown: int = 12
    """Candidates in the table and in the figure of the search."""
    max_bic_shown: float = 1000.0
    """Difference of BIC above which a table shows a lower limit: a hundred times what is strong evidence."""
    dots_per_inch: int = 110
    """Resolution of the figures of the page."""
    noise_bins: int = 1024
    """Frequencies at which the noise density is drawn."""
    min_p_shown: float = 1e-12
    """P-value below which a table shows an upper limit."""
