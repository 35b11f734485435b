"""Thresholds of the re-fit of the nominal model: each with its unit, its reason and the measurement that chose it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class NominalFitThresholds:
    """Numbers of the re-fit of the nominal model."""

    # Starts from short segments (multiple shooting).
    segment_periods: tuple[float, ...] = (1.0, 4.0, 16.0, 64.0)
    """Lengths of the segments [periods of the motion], one after the other."""
    segment_iterations: int = 8
    """Iterations of a fit to segments."""
    max_segments: int = 30
    """Most segments of one length, evenly over the records: a start needs no more."""
    segment_state_tolerance: float = 0.01
    """Relative decrease of the cost at which the segments' states have settled."""
    stray_segment_ratio: float = 25.0
    """Cost a sample over its median, above which a segment is left out: its state is in another well."""
    trial_iterations: int = 8
    """Iterations over whole records that show which start is nearest."""
    fitted_starts: int = 4
    """Number of the nearest starts from which whole records are fitted to the end."""
    close_misfit: float = 0.3
    """RMS residual over the signals' RMS below which a fit is in the right basin and needs no segments."""
    judged_periods: float = 1.0
    """Length of the segments by which a fitted set is judged [periods of the motion]."""
    max_judged_segments: int = 160
    """Most such segments: each costs a simulation with a state of its own."""

    # A constant of the reading that hides the motion.
    offset_ratio: float = 3.0
    """Mean of a record over its variation from which a constant of the reading may hide the motion."""
    offset_misfit_ratio: float = 0.5
    """Misfit beside a constant over the misfit without it, below which the constant is what is missing."""

    # Integration steps.
    step_error_share: float = 0.01
    """Cost of the integration error over the cost of the fit (a tenth of the residual's RMS), above which the steps are
    refined; below, the residual tests remove the error to first order."""
    max_steps_per_period: float = 256.0
    """Finest steps a period that are tried before the simulation's own."""

    # Valleys of dry friction (basin search).
    basin_factors: tuple[float, ...] = (0.8, 0.9, 0.96, 1.04, 1.1, 1.25)
    """Factors of the kinked amplitudes from which other valleys are looked for."""
    basin_rounds: int = 4
    """Largest number of moves to a lower valley."""
    basin_iterations: int = 12
    """Iterations of a fit from there."""
    basin_improvement: float = 1e-3
    """Relative decrease of the cost below which another valley is no better."""

    # Initial states of single records.
    start_improvement: float = 1e-3
    """Relative decrease of the cost below which other initial states are no better."""

    # Progressive fit of a record on another branch.
    outlier_ratio: float = 1.2
    """RMS residual of a record over the median of the others, above which it is fitted progressively."""
    first_part: float = 1.0 / 16.0
    """Initial part of such a record [fraction]; then twice as much each time, or half as much more after a failure."""
    min_part_step: float = 1.0 / 64.0
    """Smallest increase of that part [fraction]."""
    max_progressive_records: int = 8
    """Number of times that a record is fitted progressively."""
    max_progressive_fits: int = 12
    """Most fits of one record."""
    progressive_iterations: int = 12
    """Iterations of a fit to a larger part; the last one runs to its end."""
    progressive_improvement: float = 1e-3
    """Relative decrease of the cost below which the progressive fit is not kept."""

    # Predictability of free runs.
    diverged_rms: float = 0.5
    """RMS residual over one period, as a fraction of the record's RMS, from which the free run takes another course."""
    min_followed_periods: float = 12.0
    """Smallest initial part of a record [periods of the motion]; a record that diverges before is left out."""
    min_followed_share: float = 0.05
    """Smallest fraction of all samples that the initial parts hold together."""
    max_share_after: float = 0.5
    """Fraction of the squared error after the initial parts, from which these say more of the model than whole
    records."""
    missed_beyond: float = 2.0
    """Misfit over short segments of what was cut off over that of what was kept, above which something acts there."""
    max_prediction_rounds: int = 3
    """Rounds that fit the initial parts and find how far that fit follows the records."""
    diverging_ratio: float = 3.0
    """RMS residual of a period over the record's median, above which the last periods of an initial part already
    diverge."""
    max_diverging_share: float = 0.05
    """Largest fraction of the periods that is cut from an initial part for that reason."""
    unpredictable_slope: float = 1e5
    """Sensitivity to a parameter over the output's size, by a change that matters, above which what follows is
    unpredictable. Of twenty generated bistable devices three have such records, and of the others the largest slope is
    8e4."""
    predictable_slope: float = 1e3
    """Sensitivity down to which a record with an unpredictable end is cut."""
    predictable_periods: float = 4.0
    """Periods of the motion in a piece of a test record whose free run as a whole is unpredictable. Of a bistable beam
    under noise errors grow tenfold within three periods."""
    predictable_piece_slope: float = 300.0
    """Sensitivity to a parameter over the output's size above which a piece is left out: of 37 pieces a right model was
    off in three, at slopes of 370 and more, and at the noise in the others."""
    least_predictable_pieces: float = 0.33
    """Share of the pieces that have to be left; with fewer whole test records are scored."""

    followed_within_segments: float = 0.2
    """Misfit over segments of a period in that of free runs, below which a model follows the motion and only its free
    runs take another course."""

    # Segmentation of records that drift.
    stroke_periods: float = 0.5
    """Length of a segment of a drifting body [periods of the motion]."""
    min_stroke_samples: int = 200
    """Smallest number of samples of such a segment."""
    max_stroke_segments: int = 160
    """Most such segments: each has its own initial state and mains phase, and memory grows with their square."""
    lasting_influence: float = 0.3
    """Influence of the initial state at a record's end over that at its beginning, above which it is not forgotten."""
    diverging_influence: float = 30.0
    """Upper limit of the same: a double integrator's grows by ten over a record, and runs that diverge exponentially,
    as between two wells, are no drift."""
    same_side_share: float = 0.8
    """Fraction of a record in which a displaced body stays displaced that way; with a spring it swings, and is on one
    side half of the time."""

    # Notes on the model.
    foreign_misfit: float = 0.6
    """RMS residual over the signal's RMS that the re-fitted model of the same device would not leave."""
    shifted_value_ratio: float = 2.0
    """Ratio of a re-fitted value to the file's, or its inverse, above which a person should know."""
    shifted_offset_scales: float = 10.0
    """Change of an offset, in units of its scale, above which a person should know."""
    common_start_p: float = 1e-4
    """P-value of the mean deviation of the records' starts from the file's, over their scatter, below which it is
    said: for all states together."""
    min_allowed_misfit: float = 0.0025
    """Smallest allowed RMS misfit over the output's size: read-outs are tables of cells."""
