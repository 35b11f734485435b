"""Thresholds of the stepwise search: each with its unit, its reason and the measurement that chose it.

Costs are half sums of squares over the outputs' sizes, so ratios of costs have no unit. Values without a
measurement are judgement from development cases (seeds from 100000 on); no seed of the reported tables took part.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchThresholds:
    """Numbers of the stepwise search over sets of mechanisms."""

    # Acceptance by the residual tests.
    significance_share: float = 0.2
    """Significance level of the residual tests, as a share of the false-claim rate that the user asks for. P-values
    are slightly too small: of 90 devices with nothing hidden and white or autoregressive noise 3.3 % are below
    0.01."""
    almost_passing_p: float = 1e-6
    """P-value above which a set leaves little, although it does not pass. Kinks of dry friction keep a fit a hundredth
    above its minimum, at p = 1e-4 beside 1e-225 of the next set."""
    untold_cost: float = 1.05
    """Ratio of the cost of a rival set to that of the chosen one, up to which the test records are asked whether they
    tell them apart."""
    whitened_gain: float = 1.01
    """Lower end of the interval of the same ratio, of errors in units of the noise, above which a set that passes is
    confirmed on the test records, whatever it removes of a static model's own error."""
    least_holdout_gain: float = 1.5
    """Ratio of errors (RMS) on test records, before over after, that a claimed part of an explanation must exceed."""
    most_part_rivals: int = 1
    """Number of other single causes that test records do not tell from the largest part of an explanation, up to which
    it is named beside them: with more it is no name."""

    longer_parts: float = 1.2
    """Ratio of samples, above which a search goes on in the longer parts that a model follows with causes that explain
    shorter ones: less has nothing in it that was not seen."""

    # Forward selection: how sets grow.
    largest_set: int = 6
    """Number of causes of the largest set that is tried."""
    beam_size: int = 2
    """Number of causes up to which several sets of one size are extended; larger sets grow one at a time."""
    beam_width: int = 3
    """Number of sets of one size that are extended to the next."""
    beam_cost: float = 3.0
    """Ratio to the lowest cost beyond which a single cause is not extended."""
    similar_cost: float = 1.5
    """Ratio to the lowest cost below which the cost alone does not rank sets: their cost over short segments does."""
    tied_cost: float = 1.02
    """Ratio to the lowest cost below which white squares do not rank sets: each is put to the residual tests."""
    tied_sets: int = 8
    """Number of tied sets that are put to the residual tests, most."""
    segment_refits: int = 2
    """Number of sets of one size that are refitted from short segments where no set passes."""
    sets_over_segments: int = 24
    """Number of sets of one size whose fits to short segments are compared where none is near the readings."""
    refits_beside: int = 3
    """Number of single causes behind which static loops are refitted where refitted loops alone would be the answer."""
    stall_shares: tuple[float, ...] = (0.8, 0.5, 0.5, 0.25)
    """Share of the smaller set's cost, by the number of causes (the last for all larger sets), above which the search
    ends: real devices are never exactly the model, and a further cause then only absorbs model error."""
    small_cause_size: int = 3
    """Number of causes at which a small further one is accepted beside causes that are right."""
    small_cause_share: float = 0.92
    """Share of the smaller set's cost, instead of `stall_shares`, for a set of `small_cause_size` causes."""
    small_cause_excess: float = 3.0
    """Ratio of residual to noise (RMS) above which `small_cause_share` applies: two causes that are right leave far
    more than the noise on a measured device, and what is small beside them is real."""
    partial_share: float = 0.5
    """Share of the smaller set's cost below which a set that stalled is still reported as a part."""
    needed_bic: float = 10.0
    """Difference of BIC by which a larger set must beat a smaller one that does not pass: else that may be chance."""
    equivalent_bic: float = 10.0
    """Difference of BIC below which the data do not decide between two sets of one size."""
    equivalent_cost: float = 1.5
    """Ratio to the best cost beyond which no whitening makes a set equivalent."""

    # Escapes from local minima.
    followed: int = 4
    """Number of starts of further causes that are fitted beside the best set of a search that ends without one that
    passes."""
    followed_score: float = 0.5
    """Share of the best further cause's score below which it is not tried there: the tests point to few."""
    followed_cost: float = 0.5
    """Share of the best set's cost below which the larger set must be, to be tested."""
    stuck_share: float = 0.5
    """Share of its former cost below which the nominal model, refitted from a single cause, had been stuck."""
    improved_share: float = 1e-4
    """Relative decrease of cost by which a refit from elsewhere shows that the former fit had stopped short. A fit to
    dry friction stopped short by 5 squares of 80 000, at p = 1e-28 instead of 0.09."""

    # Candidates: starts of larger sets.
    children_of_single: int = 9
    """Number of mechanisms that extend a single cause."""
    children_of_larger: int = 6
    """Number of mechanisms that extend a larger set."""
    shapes_tried: int = 2
    """Number of shapes from which a mechanism is started."""
    frequencies_tried: int = 3
    """Number of frequencies instead, since each peak of the residual's spectrum is a valley of its own. Of two that
    were tried for a second mode at 99.6 Hz neither led there; the third does."""
    start_factors: tuple[float, ...] = (1.0, 0.3)
    """Factors of the linear step at which fits start."""
    collinear_share: float = 0.1
    """Share of a direction (squares) beyond the set's own parameters, below which these make room for it from the
    start; otherwise the start is far from the valley."""
    valley_shares: tuple[float, ...] = (0.5, 1.0)
    """Shares of the way to the first bound at which a mechanism starts that is one of the set's own to first order."""
    weak_share: float = 0.05
    """Share of the best score below which a mechanism is started only once."""
    pairs_tried: int = 8
    """Number of pairs started at once from the nominal model. Scores of all pairs cost 0.1 s; two of six pairs that
    had been missed were found so."""
    pair_factor: float = 0.3
    """Factor of the linear step of a pair; the whole step leaves the valley more often than it comes further along
    it."""
    own_step_limit: float = 0.5
    """Largest linear step of a parameter that the set already has, as a share of its value or, if larger, of its
    typical size. A stiffness of 57 150 had started at -405 000, and that motion took 53 of 76 s."""

    # Candidates by regression on the measured motion.
    regressed_samples: int = 60_000
    """Number of samples of all records together that are regressed."""
    regressed_step: float = 0.1
    """Step along a direction, in its scale, by which its force is taken: most forces are linear in it."""
    regressed_visible: float = 0.001
    """Share of a force's squares beyond the nominal terms below which it is no candidate: a relaxation that is fast is
    a damper, and only their difference would be left of both."""
    regressed_share: float = 0.8
    """Share of what fewer mechanisms leave of the squared acceleration below which a set is tried."""
    regressed_tried: int = 5
    """Number of sets of each size that are tried."""
    regressed_refined: int = 3
    """Number of single mechanisms whose shapes are refined first: a stop beside its place leaves more than another law
    at its best."""
    regressed_trials: int = 25
    """Trials of that for each shape."""

    # Successive halving of the candidates.
    first_iterations: int = 6
    """Levenberg-Marquardt iterations of every start."""
    first_round_share: float = 0.6
    """Share of the work that is left which the first round may use. A piezo stack's took all of it, and no fit was
    ended."""
    second_iterations: int = 12
    """Iterations of the better half."""
    last_iterations: int = 40
    """Iterations of the finalists."""
    second_round: int = 8
    """Number of sets that enter the second round."""
    promising: int = 2
    """Number of others that enter it because their linear step promises a lower cost than any leader's: curved valleys
    converge slowly at first."""
    finalists: int = 4
    """Number of sets that are fitted to the end."""
    finalists_on_all_samples: int = 3
    """Number of finalists that are fitted to all samples where earlier rounds used the initial part of the records."""
    shorter_steps: tuple[float, ...] = (0.1, 0.0)
    """Factors of a start's step that are tried in turn where a fit ends above its parent: near a fold the linear step
    jumps to another branch. A deadband at 657 after the first round is at 17 from a tenth of the step."""
    further_rounds: int = 2
    """Number of repeated final fits of sets near the best that still descend: in a narrow, curved valley steps are
    short."""
    contending_cost: float = 1.5
    """Ratio to the lowest cost up to which a finalist is fitted further."""
    contending_cost_if_promising: float = 3.0
    """The same for a finalist whose linear step promises less than the lowest cost. A sample-and-hold that had stopped
    at 1.7 was no rival of the delay that was named instead."""
    converged_share: float = 1e-3
    """Relative decrease of cost promised by one more step, below which a fit has converged."""
    other_forms: int = 2
    """Number of further forms of the finalists' sets that are fitted to the end."""
    other_form_cost: float = 10.0
    """Ratio to the lowest cost below which another form is: a shape at its default may leave it far behind."""
    leading_cost: float = 1.1
    """Ratio to the lowest cost below which sets with kinked parameters are fitted across the kinks."""
    hopeless_cost: float = 30.0
    """Ratio to the lowest cost of the first round beyond which a set is dropped."""

    # Challengers of a set that was found.
    lone_leader_share: float = 0.1
    """Share of a rival's cost below which the leader is right or the rival is stuck: the rival is refitted from
    there."""
    challenger_score: float = 0.5
    """Share of the best score, by a linear step from the leader's nominal values, below which a mechanism is no
    rival."""
    unfinished_cost: float = 4.0
    """Ratio to the best cost up to which an interrupted fit of a single cause may still end as low as the best."""
    rival_cost: float = 1.5
    """Ratio to the chosen set's cost below which a refitted rival is put to the residual tests."""

    # Backward elimination.
    negligible_cost: float = 1.1
    """Ratio of costs without and with a cause, up to which the cause is not needed."""
    probed_samples: int = 400
    """Samples of all records together over which a start's steps are counted before it is evaluated on all of them."""
    far_longer: float = 20.0
    """Ratio of its steps to those of the same set at other values beyond which it is none. One was 3,000 times."""
    elimination_iterations: int = 20
    """Iterations of a fit without one of the causes."""

    # Refit of the static hysteresis.
    rising_error: float = 0.95
    """Ratio of errors on test records, before over after a refit of the static hysteresis, that no output may fall
    to."""
    as_identified_cost: float = 3.0
    """Ratio to the cost with free gains and offsets, below which those of the identification fit: a session
    calibrated as the identification was leaves no more, however far off the loops are between their levels."""
    worth_correcting: float = 1.05
    """Ratio of error on test records to unpredictable noise (RMS), below which a set that passes gains too little by
    other loops: 1.08 became 1.02, 2.02 became 1.40."""

    # Support by test records.
    small_removed_share: float = 0.02
    """Share of what the set removes of the squared misfit, below which a cause is claimed only if test records support
    it: noise that is not autoregressive, or a converter's steps, look like a small offset or friction."""
    small_set_share: float = 0.05
    """Share of the residual's squares below which all that a set removes is small beside the noise."""
    least_support: float = 0.01
    """Share of the squared error on test records that a small cause has to remove: half a percent of the error is no
    reason to change a model, however certain it is, and what a simulation rounds is seen at a ten thousandth."""
    refuted_causes: int = 2
    """Number of causes that test records refute, without which a search is repeated."""
    shown_share: float = 0.5
    """Initial share of a test record to which parameters of its own (a hum's) are fitted; the rest is judged."""

    # Nonparametric alternatives.
    alternative_samples: int = 24_000
    """Number of samples to which alternatives are fitted; some take long to simulate."""
    alternative_cost: float = 0.8
    """Ratio of costs below which an alternative explains more than the named causes; of an oscillator also of the
    costs beyond the noise. Chosen by 12 VO2 cases with effects outside of the catalogue."""
    alternative_bic: float = 10.0
    """Difference of BIC by which an alternative must be likelier, near the noise."""
    memory_p: float = 1e-3
    """P-value of forces along the past motion below which a set that passes is compared with such alternatives."""

    # Free-run error on test records.
    bootstrap_resamples: int = 2000
    """Number of resamples of the block bootstrap: fifty lie beyond each end of its 95 % interval."""
    bootstrap_block_periods: float = 8.0
    """Length of a block [periods of the motion]."""
    bootstrap_least_blocks: int = 12
    """Number of blocks over all test records, least; blocks are shortened to reach it."""
    free_run_iterations: int = 12
    """Iterations of the fit of a test record's initial state."""
    free_run_tolerance: float = 1e-6
    """Relative decrease of cost at which that fit ends."""

    @property
    def removed_share(self) -> float:
        """Return the share of squares that an error reduced by `least_holdout_gain` has lost."""
        return 1.0 - 1.0 / self.least_holdout_gain**2
