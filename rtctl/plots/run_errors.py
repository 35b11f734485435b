"""The error panel of a run: tracking and self-sensing error over the estimator's stated standard error.

tracking error = setpoint − output; self-sensing error = estimate − output, the output as an instrument measures it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from rtctl.border.arrays import FloatArray
from rtctl.border.records import Channel
from rtctl.output.readable_units import printed_unit
from rtctl.plots.elements.decimation import extremes
from rtctl.plots.elements.errors import error_figures, percent_axis, shown_limit
from rtctl.plots.elements.lines import ABOVE, draw_line, note
from rtctl.plots.elements.style import BLACK, SKY, VERMILION


def draw_errors(
    axes: Axes, time_s: FloatArray, column: Mapping[str, FloatArray], width: float, output: Channel
) -> None:
    """Draw errors [the output's unit] against the instrument; without one, setpoint − estimate alone."""
    reference, name = column[output.name], f"setpoint − {output.name}"
    if not np.isfinite(reference).any():
        reference, name = column["estimate"], "setpoint − estimate (no external instrument)"
    tracking, sensing = column["setpoint"] - reference, column["estimate"] - column[output.name]
    twice = 2.0 * column["estimate_standard_error"]
    if np.isfinite(twice).any():
        kept = extremes(twice)
        band = axes.fill_between(
            time_s[kept], -twice[kept], twice[kept], color=SKY, alpha=0.35, linewidth=0.0
        )
        band.set_label("±2 standard errors claimed")
    draw_line(axes, time_s, tracking, BLACK, name)
    draw_line(axes, time_s, sensing, VERMILION, f"estimate − {output.name}")
    limit = _limit(tracking, sensing, twice, width)
    axes.set_ylim(-limit, limit)
    axes.set_ylabel(f"error [{printed_unit(output.unit)}]")
    percent_axis(axes, width)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(**ABOVE)
    scores = (error_figures(tracking, width), error_figures(sensing, width))
    largest = max((score.largest for score in scores if score), default=0.0)
    if largest > limit:
        note(axes, f"peaks reach {largest:.3g} {printed_unit(output.unit)}, beyond this axis")


def _limit(tracking: FloatArray, sensing: FloatArray, twice: FloatArray, width: float) -> float:
    """Return the half height of the axis: set by the errors, extended to the band where that is not far outside."""
    errors = 1.15 * max(shown_limit(tracking, 2.0), shown_limit(sensing, 4.0), 1e-3 * width)
    claimed = 1.05 * float(np.nanmax(twice, initial=0.0))
    return max(errors, min(claimed, 2.0 * errors))
