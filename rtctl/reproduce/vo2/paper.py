"""Figures of the paper: J. Zhang et al., IEEE/ASME Trans. Mechatronics 21(5), 2016, 2405-2416.

Errors as printed [um]; percent of the range that its errors are given over, [1.62, 58.65] um.
"""

from __future__ import annotations

from typing import NamedTuple

REFERENCE = (
    "J. Zhang, D. Torres, J. L. Ebel, N. Sepulveda, X. Tan, A Composite Hysteresis Model in Self-Sensing Feedback "
    "Control of Fully Integrated VO2 Microactuators, IEEE/ASME Trans. Mechatronics 21(5), 2016, 2405-2416."
)
RANGE_UM = 58.65 - 1.62
LEAST_RESISTANCE_KOHM = 11.19
TIME_CONSTANT_MS = 1.8
BEST_DEVICE_PERCENT = 0.54
"""Best error in percent of range: the group's composite on an earlier device, 0.554 um of 103 um (reference [35])."""


class Errors(NamedTuple):
    """Mean and largest absolute error [um]; None where the paper has none."""

    mean_um: float | None
    max_um: float | None = None

    @property
    def mean_percent(self) -> float | None:
        """Mean error in percent of the paper's range."""
        return None if self.mean_um is None else 100.0 * self.mean_um / RANGE_UM

    @property
    def max_percent(self) -> float | None:
        """Largest error in percent of the paper's range."""
        return None if self.max_um is None else 100.0 * self.max_um / RANGE_UM


NONE = Errors(None)
FIT = {
    "composite": Errors(0.95, 4.01),
    "preisach": Errors(1.19, 6.68),
    "egpi": Errors(1.26, 4.65),
    "deflection_egpi": Errors(0.79, 2.31),
}
"""Figures 8 to 10, on the data that were fitted."""
RANDOM = {"composite": Errors(1.10, 2.88), "preisach": Errors(1.45, 4.55)}
"""Errors of figure 12."""
TRACKING = {
    ("steps", "composite"): Errors(1.11),
    ("steps", "preisach"): Errors(2.21),
    ("sine_0p1hz", "composite"): Errors(0.69),
    ("sine_0p1hz", "preisach"): Errors(1.28),
    ("multisine_1_10hz", "composite"): Errors(2.43),
    ("multisine_1_10hz", "preisach"): Errors(2.43 / (1.0 - 0.201)),
}
"""Figures 14 to 16; the last from "20.1 % less than those under the Preisach"."""
TIME_US = {"composite": 160.0, "preisach": 680.0, "egpi": 110.0}
"""Time [us] of a self-sensing calculation in MATLAB on a laptop of 2011: six plays, ten levels."""

GPI_WEIGHTS = (0.415, 0.648, 0.325, 0.0, 0.081, 0.618)
"""Table I; its envelopes and bias are lost in the transcription."""
EGPI_WEIGHTS = (27.24, 5.35, 3.18, 12.84, 1.00, 26.68)
"""Table II [um]."""
EGPI_HEATING = ((1202.6, 8.67), (None, 12.15), (None, 10.12), (None, 7.42), (788.8, 10.83), (788.8, 11.21))
"""Table II: a_R [1/A] where it is legible, and -b_R, whose sign is lost."""
EGPI_COOLING = ((982.5, 6.49), (None, 11.13), (None, 11.56), (838.1, 6.24), (None, 6.46), (None, 15.52))
"""Table II: a_L [1/A], -b_L."""
CURRENT_MA = (3.68, 8.49)
