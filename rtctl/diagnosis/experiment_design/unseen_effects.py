"""What an answer that nothing is missing cannot exclude: effects that the fitted parameters and starts take up."""

from __future__ import annotations

from rtctl.diagnosis.experiment_design.isolability import Isolability
from rtctl.diagnosis.thresholds import ReportThresholds

UNSEEN = (
    "these data cannot show {}: what such an effect does is what another value does, and the fitted values may hold "
    "it. What you know lets it show: fixed = true in the model file, initial of a record in the manifest"
)


def describe_unseen(isolability: Isolability, limits: ReportThresholds) -> list[str]:
    """Return a sentence on the mechanisms that may act although nothing is seen of them; none where all would be seen.

    Args:
        isolability: That of the nominal model, which passes.
        limits: How far an effect moves the outputs that is worth a word.
    """
    groups = isolability.followed(limits.unseen_effect)
    told = [f"{_listed(names)} (taken up by {_listed(by)})" for by, names in groups.items()]
    return [UNSEEN.format("; ".join(told))] if told else []


def _listed(names: tuple[str, ...]) -> str:
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
