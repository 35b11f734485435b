"""Thresholds of the fits and of the readings: each with its unit, its reason and the measurement that chose it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ProblemThresholds:
    """Numbers of the fit of a hypothesis, its finite differences, its bounds and of the quantization of readings."""

    most_iterations: int = 40
    """Levenberg-Marquardt iterations of a fit at most."""
    kept_derivatives: int = 2
    """Points of a fit whose derivatives are kept: the present one and the one before."""
    least_determined_share: float = 1e-7
    """Smallest fraction of a parameter's squared sensitivity that the other parameters do not explain; below it the
    parameter is not identifiable from these records. Of Bouc-Wen's four shape numbers one only rescales the others."""
    largest_move: float = 0.3
    """Largest change of an output by a finite-difference step, over the output's RMS; beyond it the motion has escaped
    to another branch or become chaotic, and the quotient is no derivative."""
    most_scales: float = 5.0
    """Bound of an amplitude of a mechanism, in multiples of its scale (the size at which it acts as strongly as all
    else): a larger effect would not be looked for as an addition to the nominal model."""
    nominal_range: float = 100.0
    """Bound of a nominal parameter, in multiples of its scale: beyond it a motion needs ever finer steps."""
    start_range: float = 2.0
    """Bound of a nominal parameter, in multiples of its start value, where that is wider: the stiffness of a beam that
    is driven far below its resonance is many scales large."""
    quantization_round_off: float = 1e-6
    """Fraction of the range of the readings below which two levels are one."""
    quantization_off_grid: float = 0.02
    """Distance of a level from the grid of the converter at most, in steps."""
    quantization_readings_per_level: float = 2.0
    """Readings per level at least, on average, for a grid to be a converter's: without steps all readings differ."""
    quantization_peak: float = 0.7
    """Characteristic function of the readings at a step above which noise behind the converter hides it no more: 0.73
    is noise of an eighth of the step."""
    quantization_contrast: float = 0.5
    """Largest value of the function between a quarter and three quarters of that frequency, as a share of the peak:
    readings at rest give a slope down from 1 and no peak."""
    quantization_coarser: float = 1.5
    """Ratio of a step below noise to that of a grid on which all readings lie, above which the step is another
    converter's; else both are one, which the grid gives exactly."""
    quantization_least_levels: int = 6
    """Steps in the range of the readings at least: two wells or a few settled values lie about a grid by chance."""
    quantization_least_readings: int = 200
    """Number of readings at least: of so many without steps the function is a tenth by chance."""
    quantization_bins: int = 16384
    """Bins of the histogram whose spectrum the function is; a step is 32 of them at least."""

    # Places of the motion, such as that of a stop.
    end_of_motion: float = 0.01
    """Share of the readings beyond the outermost place from which a search starts, up to which a fit may move a place
    to the end of the motion: of a lightly damped cantilever's readings 0.3 % lay beyond the place of its stop."""
    farthest_quantile: float = 1e-4
    """Quantile that stands for the end of a motion of which nothing was measured."""
    beyond_integrated: float = 1.1
    """Largest place over the end of a motion that was integrated from its velocity or acceleration: of a ringing
    resonator with 2 % of noise that end is within 10 % of the true one."""
