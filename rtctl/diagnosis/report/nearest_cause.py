"""Where no cause is named: which one of the catalogue comes nearest, and how much of the error it would remove."""

from __future__ import annotations

from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.thresholds import ReportThresholds
from rtctl.diagnosis.verification.whole_record_fits import Fits, HoldoutData

NEAREST = (
    "of all single causes {id} comes nearest: on the test records, which no fit saw, it would lower the error of the "
    "{output} from {before:.3g} to {after:.3g} {unit} ({share:.0%} of the squared error). It is not named: {why}; it "
    "may be a part of what is missing, or only look like it"
)
ENDED_EARLY = "the search ended before all sets of causes were tried, and it leaves more than noise"
NOT_ALL = "it leaves more than noise, and so does every set of causes that was tried"
LAW_OF_NO_NAME = "a law of no name explains more"


def describe_nearest_cause(
    search: SearchResult,
    holdout: HoldoutData,
    output: str,
    thresholds: ReportThresholds,
    *,
    stopped: bool = False,
) -> list[str]:
    """Return a sentence on the single cause that is nearest; none where it removes less than half of the error.

    Args:
        search: What was found, with all sets that were fitted.
        holdout: Test records, and what errors on them are computed with.
        output: Output of the kind of plant.
        thresholds: Thresholds of the report.
        stopped: Whether the user ended the search.
    """
    if not search.rankings or not search.rankings[0]:
        return []
    nearest = min((one.hypothesis for one in search.rankings[0]), key=lambda one: one.cost)
    added = [one for one in nearest.mechanisms if one not in search.nominal.hypothesis.mechanisms]
    fits = Fits(search.nominal, search.nominal._replace(hypothesis=nearest))
    gain = holdout.gain_of(fits, output)
    if gain is None or len(added) != 1 or not gain.ratio_low > 1.0:
        return []
    share = 1.0 - 1.0 / gain.ratio**2
    if not share > thresholds.nearest_removed_share:
        return []
    why = LAW_OF_NO_NAME if search.better_alternative else NOT_ALL
    if stopped or search.out_of_time:
        why = ENDED_EARLY
    told = {"before": gain.before, "after": gain.after, "unit": gain.unit, "share": share, "why": why}
    return [NEAREST.format(id=added[0], output=gain.output, **told)]
