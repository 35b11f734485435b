"""Thresholds of the checks of the data before any fit: each with its unit, its reason and its measurement."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ScreeningThresholds:
    """Numbers of the checks of the data before any fit."""

    min_samples: int = 200
    """Smallest number of scored samples of a usable record."""
    min_sweep_rows: int = 20
    """Smallest number of rows of a usable sweep of frequencies; each is a steady state, of two readings."""
    min_periods: float = 5.0
    """Smallest number of periods of the motion in all fit records together; below, slow effects are not determined."""
    max_fit_samples: int = 100_000
    """Largest number of samples of all records to fit: a diagnosis makes hundreds of fits to them, and an effect that
    100,000 samples do not show is small."""
    min_truncated_samples: int = 1_000
    """Smallest number of samples of a record that is cut to its initial part; where `max_fit_samples` allows fewer,
    whole records are left out instead."""

    clipped_share: float = 0.005
    """Fraction of a record's readings at exactly its extreme value from which the sensor is called clipped."""
    clipped_pile_ratio: float = 4.0
    """Readings at the extreme value over those at any of the three levels beside it; a quantised sine reaches 2.4."""
    min_clipped_readings: int = 10
    """Smallest number of readings at the extreme value that is called clipping."""
    min_standing_readings: int = 8
    """Smallest number of readings of one value after each other that may be a sensor that fell out."""
    standing_elsewhere: float = 1e-3
    """Share of equal neighbours elsewhere in a record above which its resolution makes them."""
    standing_jump_ratio: float = 2.0
    """Step at an end of the run over the record's median step above which the motion did not come to rest there."""
    min_levels: int = 8
    """Number of distinct readings that must be exceeded: a record of few levels always piles up."""

    repeat_tolerance: float = 0.05
    """Largest RMS difference of the inputs of two repeats, as a fraction of the input's RMS."""
    tone_power_share: float = 0.995
    """Fraction of the drive's power in one line (with three bins on each side) from which it is a single tone."""
    tone_min_bin: int = 4
    """Lowest bin of a tone: below, its line cannot be told from the mean."""
    tone_half_width: int = 3
    """Bins on each side that a Hann window spreads a line over."""
    tone_frequency_spread: float = 0.02
    """Largest spread of the tones' frequencies, as a fraction of their mean, for records of the same tone."""
    tone_level_spread: float = 0.05
    """Largest spread of the tones' levels, as a fraction of their mean, for records of the same level."""

    velocity_slope_tolerance: float = 0.3
    """Largest relative difference of the displacement's slope from the velocity that was read beside it."""
    late_velocity_periods: float = 0.1
    """Sample periods that a velocity is later than the displacement's slope, from which on it is told."""
    late_velocity_errors: float = 6.0
    """The same in standard errors of that delay."""
    velocity_correlation_errors: float = 6.0
    """Standard errors by which slope and velocity must be correlated before they are compared."""
    samples_per_independent: float = 10.0
    """Samples for one independent reading: neighbouring samples of an oscillation are correlated."""

    spike_median_width: int = 7
    """Samples of the running median, which follows a step and ignores up to three neighbouring readings."""
    spike_max_samples: int = 2
    """Longest spike [samples]; a longer one may be motion."""
    spike_distance: float = 30.0
    """Distance from the running median over the usual distance of the readings (scaled median)."""
    spike_reach: float = 2.0
    """Distance from the running median over the distance within which 99 % of the readings lie about their median."""
    spike_edge_ratio: float = 100.0
    """Step behind the first or last readings over the next one, below which they may belong to a decay (of a time
    constant of a fifth of a sample and more) and are no spikes."""
    spike_max_share: float = 0.01
    """Largest fraction of a record that spikes may make up; more of them belong to the device."""

    spike_misread: float = 0.85
    """Share of the response that is left unexplained without the drive's spikes over that with them, below which the
    device did not feel them. Of 240 linear devices that did, it was 0.93 or more (quality factors 5 to 170; tones,
    multisines, noise, steps)."""
    spike_followed: float = 1.1
    """That share from which on the device felt them."""
    spike_segments: int = 8
    """Segments of a record for that share."""

    start_fit_samples: int = 6
    """Fewest readings of the cubic that estimates the velocity at the first sample; more are used if noise asks."""
    start_velocity_error: float = 0.05
    """Standard error of the estimated initial velocity (over the motion's size) that is small enough."""
    start_fit_periods: float = 0.15
    """Longest part of a period that the cubic may span; beyond, it does not follow the motion."""
    moving_start: float = 0.3
    """Initial velocity over rate and size (displacement or its RMS, whichever is larger) of a record that begins in
    motion. Of the generated records, which all begin at rest or released, the largest value is 0.29, by noise."""
    moving_start_errors: float = 4.0
    """Standard errors that the initial velocity must exceed."""
    creeping_start: float = 0.05
    """The same of a record whose first half of a period is not scored: a reading that lags is taken to have settled
    there. A moving base made 0.1; by the first sample alone, a lag of the drive was told for one of the sensor."""
    resting_start: float = 0.1
    """Initial velocity below which a record rests beside others that move, if its displacement is that small too or
    the manifest gives it: any ring-down passes through such moments."""
    warm_up_periods: tuple[float, float] = (10.0, 30.0)
    """Fewest and most periods that start the state of a record that begins in motion; a light second mode forgets its
    start slowly."""
    warm_up_periods_two_wells: tuple[float, float] = (2.0, 2.0)
    """The same for a motion between two wells: after more unscored periods it may be in the other well."""
    warm_up_share: float = 0.1
    """Fraction of a record that warms up, within the limits of `warm_up_periods`."""
    warm_up_max_share: float = 0.25
    """Largest fraction of a record that warms up, whatever its periods."""

    sudden_drive: float = 0.1
    """First value of a drive over its RMS, above which it was at work when the record began."""
    sudden_periods: float = 0.5
    """Periods of a record that begins so that are not scored: longer delays are none of a motion of this period."""
    sudden_max_share: float = 0.01
    """Largest fraction of such a record that is not scored."""

    history_offset: float = 0.05
    """Error of the first readings, as a fraction of the signal's RMS, from which a record of a plant with memory began
    elsewhere."""
    history_offset_ratio: float = 10.0
    """The same error over the usual error of the record."""
    history_first_samples: int = 3
    """Readings whose mean error is compared."""
    history_blocks: int = 64
    """Blocks of a record; the history is forgotten after the first of two blocks with a usual error."""
    history_usual_ratio: float = 3.0
    """RMS error of a block over the median of all blocks below which it is usual."""
