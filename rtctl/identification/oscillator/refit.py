"""Fit again from an optimum, as where the records' holds are compared: by the method of that fit, in few iterations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.border.simulation import Simulation
from rtctl.identification.fit import Fit, FitError
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.hold_comparison import Refit
from rtctl.identification.scales import estimate_scales
from rtctl.identification.simulation_error.multiple_shooting import ShootingOptions, fit_multiple_shooting
from rtctl.identification.simulation_error.output_error import FitOptions, cut_liveliest, fit_output_error

ITERATIONS, FINAL_ITERATIONS = 8, 2
"""Of a re-fit: it starts at the optimum of another hold, half a sample away."""


def make_refit(
    fit: Fit, records: Sequence[FitRecord], options: FitOptions
) -> tuple[Sequence[FitRecord], Refit]:
    """Return the records to fit again, and what does it.

    Args:
        fit: The fit from whose optimum it starts.
        records: The records that it was fitted to.
        options: Options of that fit.
    """
    few = replace(options, screening_iterations=0, iterations=ITERATIONS, final_iterations=FINAL_ITERATIONS)
    whole = fit.method == "output_error"
    if not whole:  # thousands of segments: as many periods as starts are compared on
        span_s = options.screening_periods * 2.0 * np.pi / estimate_scales(records).rate
        records = [cut_liveliest(one, span_s) for one in records]

    def refit(simulation: Simulation, held: Sequence[FitRecord]) -> Fit | None:
        try:
            if whole:
                return fit_output_error(simulation, held, few)
            # segments by themselves: pulled together, they show nothing more of a hold
            return fit_multiple_shooting(simulation, held, ShootingOptions(gaps=(), fit=few))
        except FitError:
            return None

    return records, refit
