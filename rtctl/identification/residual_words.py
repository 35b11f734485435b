"""What a fit's residual says of the model in plain words: how large it is, and whether it looks like noise.

White noise of variance s^2 has second differences of variance 6 s^2; what a model lacks follows the motion, which is
sampled many times a period, and hardly has any. quick = mean(d2^2) / (6 mean(r^2)).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rtctl.border.arrays import FloatArray

GOOD, FAIR, POOR = 0.05, 0.15, 0.30
"""RMS residual over the variation of the reading, up to which a fit is called so; a fit beyond the last is not
trusted."""
QUICK = 0.7
"""Share of the residual's power between neighbouring samples from which it looks like noise."""
NO_INTERVALS = (
    "no standard errors and intervals are given: the {left:.3g} % that this fit leaves are no noise, so the model "
    "lacks something, and each value may be off by more than an interval would say"
)
LEAST_SAMPLES = 8
"""Samples of a residual below which nothing is said of its form."""


def judge_residual(share: float, residuals: Sequence[FloatArray] = ()) -> str:
    """Return a judgement such as "good: it looks like noise of the reading".

    Args:
        share: RMS residual over the RMS variation of the reading.
        residuals: Residuals (n,) of the records in time; none: nothing is said of their form.
    """
    size = next(
        (name for name, most in (("good", GOOD), ("fair", FAIR), ("poor", POOR)) if share <= most),
        "too much to use the model",
    )
    usual = "" if share <= GOOD else f" ({100.0 * GOOD:.0f} % or less is good)"
    series = [one for one in residuals if len(one) >= LEAST_SAMPLES and np.any(one)]
    if not series:
        return f"{size}{usual}"
    if looks_like_noise(series):
        return f"{size}{usual}: it looks like noise of the reading; rtctl diagnose sees also what is smaller than that"
    return (
        f"{size}{usual}: it is smoother than noise, so the model lacks something or a value is off; "
        "rtctl diagnose looks for it"
    )


def lacks_something(share: float, residuals: Sequence[FloatArray]) -> bool:
    """Return whether what a fit leaves is neither small nor like noise: its values are then off by what it lacks."""
    series = [one for one in residuals if len(one) >= LEAST_SAMPLES and np.any(one)]
    return share > GOOD and bool(series) and not looks_like_noise(series)


def looks_like_noise(series: Sequence[FloatArray]) -> bool:
    """Return whether neighbouring samples of residuals (n,) have little in common."""
    return _quick_share(series) >= QUICK


def _quick_share(series: Sequence[FloatArray]) -> float:
    """Return the share of the power that neighbouring samples do not have in common, as of white noise."""
    quick = np.concatenate([np.diff(one, 2) for one in series])
    return float(np.mean(quick**2) / (6.0 * np.mean(np.concatenate(series) ** 2)))
