"""Thresholds of the residual tests: each with its unit, its reason and the measurement that chose it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ResidualThresholds:
    """Numbers of the projection, the residual tests, and what is said of the residual."""

    # Projection
    least_visible_share: float = 1e-9
    """Fraction of a direction's squares that must remain beyond the fitted parameters; below it the direction is a
    combination of theirs."""
    round_off_share: float = 1e-10
    """Fraction of a row's squares beyond a record's own parameters that is round-off of the subtraction. Without it, a
    sensor offset beside a mass that no spring holds became a direction, and a noise of 1e126 adequate."""
    numerical_share: float = 1e-6
    """RMS of a residual, as a share of the readings, that two integrations of one model may differ by: no instrument's
    noise is so small, and nothing is tested in it."""
    noise_iterations: int = 3
    """Iterations of the restricted likelihood of the noise: the second knows the size of the noise, the third its
    colour; its slow part takes one more."""
    crowded_share: float = 0.1
    """Directions over samples from which the noise is estimated from two starts: above, the directions take nearly all
    of the noise in the band of the motion. Of a white residual of 588 samples beside 183 directions, half of the
    variance was lost."""
    crowded_iterations: int = 10
    """Iterations then: what lies in the band comes back slowly. Of an AR(1) of 0.6 three found 0.7 of the variance, ten
    0.96."""
    most_noise_directions: int = 3
    """Number of directions that are taken out of a residual, most, before the peak of an unmeasured force is looked for
    in it."""
    noise_direction_share: float = 0.5
    """Share of a residual beyond its noise that a direction must take to be one of them. Of noise at a resonance, which
    lies along none, the best of sixty directions took a quarter."""

    # First samples of long records
    first_samples: int = 12_000
    """Samples of all records together that a set is tested on first: what fails there needs no test on all of them. One
    test of 65,000 samples took 15 s, as long as the fits of 68 starts."""
    typical_share: float = 0.5
    """Mean square of the residual in the first samples, over that of all, above which they show what is wrong."""

    # Score tests
    most_fine_step_share: float = 0.3
    """Largest difference between the residual at the simulation's own steps and at the fit's coarser ones, over the
    residual (RMS); beyond it the difference is not of first order, and the optimum would not move along."""
    memory_lags: int = 6
    """Lags of motion and drive, `Subject.lag_s` (a quarter of a period) apart."""
    allowed_coloured: tuple[float, float] = (0.02, 1.0)
    """Shares of an allowed misfit (squares) that may lie along one direction, and along many together, before they
    count as a gap; in the metric of the noise, which has the colour of a static model's errors. Such a model errs in
    many ways at once, and hardly along a dynamic one: six devices of the blind generator (seeds 161000 to 161005)
    with nothing hidden had 0.013 at most along one direction; of twelve foreign ones
    (`benchmarks/static_loop_errors.py`, seeds 200 to 203) nine had 0.02 at most, two 0.02 to 0.03, one 0.057."""
    allowed_correction: float = 0.1
    """The first share for a direction that corrects what was identified: there is where a static model errs. These
    devices had 0.053 at most."""
    allowed_by_size: tuple[float, float] = (0.25, 1.0)
    """The same shares by plain squares, where the foreign ones had 0.10 at most along one direction, of ours one 0.27
    and the others 0.14."""
    least_noncentral_share: float = 1e-6
    """Fraction of the noncentrality below which a statistic has p = 1 within 0.1 %; avoids an overflow in `ncx2`."""
    robust_below_excess: float = 1.5
    """Mean square of the whitened residual (noise: 1) below which a doubted score test is repeated with a covariance
    that is robust to heteroscedastic noise: so small an excess may be noise that is not as large everywhere."""
    robust_below_p: float = 0.1
    """p-value of the smallest score test below which the robust covariance is asked."""
    most_leverage: float = 0.9
    """Leverage that is corrected for at most: a sample that one direction follows alone says nothing of its noise."""

    # Noise of a recorded input that the device did not feel
    input_noise_shares: tuple[float, float] = (0.3, 1.5)
    """Shares of the noise at the recorded input's floor between which what the device did not feel may lie. All of it
    is 1; the separation is not exact, and a source's own noise is felt."""
    unfelt_noise_shares: tuple[float, float] = (0.7, 1.3)
    """The same, between which all of it is taken off the drive before causes are looked for."""
    least_noise_gone: float = 0.7
    """Share of the squares that it is said to have made of the residual, by which these fall where it is taken off."""
    unseparated_noise: float = 0.1
    """Share of the squares of a drive's noise that may stay where it is taken off: what it makes is no finding, and no
    cause's support."""
    least_input_noise: float = 16.0
    """Squares of the whitened residual that its response must take: four standard errors."""

    # Growth of the residual with the motion
    growth_block_periods: float = 2.0
    """Length of a block [periods of the motion] in which variance and amplitude are compared."""
    growth_least_block: int = 16
    """Length of a block [samples] at least, for its variance to have a value."""
    growth_least_blocks: int = 4
    """Blocks of a record at least; shorter records are left out."""

    # Quantization
    quantization_harmonics: int = 2
    """Harmonics of the mean rounding error (one period a step) that are unknowns of a record; with noise as large as a
    step the higher ones vanish."""
    rest_periods: float = 1.0
    """Window [periods of the motion] in which a reading must change; where it rests, samples are left out."""

    # Shapes of mechanisms
    spectrum_peaks: int = 3
    """Peaks of the residual's spectrum at which a frequency of a mechanism is tried: the valleys of a second mode are
    apart, and the two highest peaks missed one."""
    spectrum_peak_distance: float = 0.08
    """Relative distance of two peaks at least."""

    # Localization and the missing force
    least_located_share: float = 0.01
    """Share of the residual beyond the noise that must live along a coordinate for it to be reported."""
    force_knots: int = 13
    """Knots of the missing force along its coordinate."""
    force_knot_power: float = 2.0
    """Power by which the knots of a force of the velocity's sign crowd about rest: of 13, the innermost lie at 3 % of
    the top speed, so that the jump of dry friction looks like one."""
    force_range: tuple[float, float] = (0.002, 0.998)
    """Quantiles of the visited values of the coordinate between which the knots lie."""
    force_step: float = 1e-4
    """Finite-difference step of a hat function, over the size of the drive."""
    force_smoothing: float = 1e-3
    """Weight of the squared second differences of the knots beside the data."""

    # What is said of the noise
    burst_excess_kurtosis: float = 3.0
    """Excess kurtosis of the residual above which bursts are reported: that of a Laplace distribution."""
    tone_height: float = 60.0
    """Power of a tone over the median power on both sides of it, in each record; noise reaches 20 once in a million
    bins."""
    tone_neighbours: int = 21
    """Bins that the median is taken of; few, since noise may fall with frequency as steeply as a random walk."""
    tone_least_samples: int = 256
    """Samples of a record whose spectrum is looked at, at least."""
    tone_least_share: float = 0.2
    """RMS of a reported tone over that of the residual, at least."""
    most_tones: int = 3
    """Tones reported of one output at most."""
