"""Thresholds of the verification on test records: each with its unit, its reason and the measurement that chose it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class VerificationThresholds:
    """Numbers of the verification: what a verdict of the search must stand before it is reported."""

    # Gain on test records.
    innovation_ratio: float = 2.0
    """Error on test records over innovations of the noise and allowed misfit together, below which a set that shows in
    units of the noise alone is confirmed: static loops of foreign devices with nothing hidden leave up to 2.2."""
    quiet_ratio: float = 1.1
    """Free-run error of the nominal model on test records, over noise and allowed misfit together, below which it
    misses nothing there."""

    # Fits of whole records after a search in parts of them.
    whole_cost_ratio: float = 2.0
    """Largest ratio of costs a sample, whole records over initial parts, at which the extended model is fitted to whole
    records: where it follows them less well, their later parts would pull at the parameters."""

    # The loop, where one uses the model.
    helpful_loop_ratio: float = 1.5
    """Error of the loop's rehearsal with today's model over that with the extended one, from which the extended model
    is handed out although the gain on the subject's output is not certain: ageing of a resistance leaves the simulated
    deflection as it is, and misleads the loop."""
    worst_loop_ratio: float = 1.05
    """Largest error of the loop's rehearsal with the extended model over that with today's: above, no extended model is
    handed out. Nothing that a diagnosis tells may make a loop worse; 5 % are within what two records differ."""

    # A model that follows little.
    unfollowed_motion: float = 0.7
    """RMS residual, over the signals' RMS about their means, above which an adequate model follows too little, if the
    residual is predictable and so is motion."""
    unfollowed: float = 0.99
    """The same for a residual of any kind."""
    unfollowed_part: float = 0.15
    """The same with causes that are only a part of the explanation, above which none is named. Such causes left 6 % of
    the motion at most on oscillators (15 answers); of wrong ones on other plants 5 to 61 %, most above 15 %."""
    predictable_share: float = 0.5
    """Fraction of the residual's mean square that earlier samples predict, above which the residual is motion."""

    # Residual on test records.
    missed_ratio: float = 2.0
    """Free-run error on test records over noise and allowed misfit, above which they contradict the verdict."""
    unpredictable_share: float = 0.9
    """Fraction of the whitened error on test records that its own past does not predict, above which it is noise: that
    of an effect that is missing is predicted by half and more."""
    joint_fit_ratio: float = 1.05
    """Largest ratio of errors on the fit records, with and without the test records in the fit; above, the test records
    ask for another device."""
    joint_fit_iterations: int = 8
    """Iterations of the fit to fit and test records together."""

    # Wald's test of single values of the model file.
    material_rms: float = 0.1
    """RMS of what the values of the model file leave beyond the noise, as a fraction of the noise, below which a wrong
    value does not matter."""
    lone_deviation_ratio: float = 5.0
    """Relative deviation of the wrong value over that which any other value can have; below, all of them are off."""
    others_right_p: float = 1e-3
    """P-value below which the other values count as wrong too; a wrong decision costs the claim, and claims nothing
    false."""
    lone_value_level_share: float = 0.1
    """Significance level of a deviation of any value, as a share of the rate of false claims."""

    # Steps of the readings.
    rounding_share: float = 0.5
    """Share of the squared error on test records that rounding makes, from which an answer mentions the step."""

    # Rivals that a next experiment has to tell apart.
    max_rivals: int = 5
    """Largest number of equivalent sets of causes."""
    max_unexplained_rivals: int = 2
    """The same where no set explains the data: a third is often no more than the nominal model again."""
