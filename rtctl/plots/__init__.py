"""Figures one would show at a design review, each one call from plain arrays to a PNG file.

Importing this package without matplotlib raises an InputError that names the extra `plots`.
"""

# ruff: noqa: E402 (the check has to run before anything imports matplotlib)
from rtctl.extras import require

require("matplotlib", "drawing")

from rtctl.plots.hysteresis import plot_hysteresis
from rtctl.plots.identification import plot_identification
from rtctl.plots.run import plot_run
from rtctl.plots.scenarios import plot_scenarios

__all__ = ["plot_hysteresis", "plot_identification", "plot_run", "plot_scenarios"]
