"""Remarks on a verdict: how much is left, whether the model helps, which residual test fails, what the noise holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.report.words.plain_words import words_of_coordinate, words_of_test
from rtctl.diagnosis.residual.bursts import describe_bursts, simulation_errors
from rtctl.diagnosis.residual.filtered_readings import describe_filters
from rtctl.diagnosis.residual.input_noise import InputNoise
from rtctl.diagnosis.residual.localization import localize_residual
from rtctl.diagnosis.residual.noise_floor import residual_over_noise
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis
from rtctl.diagnosis.residual.tones import describe_tones
from rtctl.diagnosis.result import Cause
from rtctl.diagnosis.search.outcome import SearchResult
from rtctl.diagnosis.search.stepwise import significance_level
from rtctl.diagnosis.verification.verify import Verified
from rtctl.output.readable_units import readable

REMAINING = "with these causes the residual is {:.3g} times the noise (RMS)"
REMAINING_ALONG = ", and goes with {}"
LOCATIONS = 3
"""Coordinates along which a remark locates what is left, most."""
NO_GAIN = (
    "with these causes the error of the {} on the test records is {:.3g} times as large as without: they help another "
    "reading or the fitted records only; do not use the extended model before that is understood"
)
FAILED_TEST = (
    'what is left is not only noise: of {} tests for what could be in it, the one for "{}" is the clearest (noise '
    "alone would give such a result with a probability of p {})"
)

INPUT_NOISE = (
    "the recorded {name} holds noise of {rms:.2g} {unit} (RMS) or more that the device did not feel but the simulation "
    "answers: {left:.0%} of the residual (RMS). This is no error of the model; a quieter reading of the {name}, or the "
    "command as input, would leave less"
)

TAKEN_NOISE = (
    "the recorded {name} holds noise of {rms:.2g} {unit} (RMS) or more that the device did not feel: it is taken off "
    "the {name} here, since only the simulation would answer it ({left:.0%} of the residual, RMS). This is no error of "
    "the model; a quieter reading of the {name} would leave less"
)
DELAY_DOUBT = (
    "{id} is uncertain by half a sample, {half}, beyond its interval, as nothing shows how the {signal} goes on "
    'between its samples: hold = "{hold}" in the manifest may be a guess, and one that a converter holds ("zero") acts '
    'that much later by itself. If a converter holds it, write hold = "zero" in [signals.{signal}] and run rtctl '
    "identify and rtctl diagnose again"
)
LAG_DOUBT = (
    "{id} is no longer than a sample, and half a sample, {half}, is what a wrong hold looks like: it may be no lag of "
    'the device. If a converter holds the {signal} between its samples, write hold = "zero" in [signals.{signal}] '
    "and run rtctl identify and rtctl diagnose again"
)
LATE = ("delay", "skew")
"""Last words of the ids of mechanisms by which something comes late."""


def remark(
    verified: Verified,
    search: SearchResult,
    problem: Problem,
    units: Mapping[str, str],
    false_claim_rate: float,
    *,
    stopped: bool,
) -> list[str]:
    """Return what a person should know of a verdict beside its causes.

    Args:
        verified: The verdict, with the gain on test records.
        search: What was found.
        problem: Records that were fitted.
        units: Unit by signal.
        false_claim_rate: Rate of false claims that the residual tests keep.
        stopped: Whether the user stopped the diagnosis.
    """
    verdict, gain, notes = verified.verdict, verified.gain, list[str]()
    if verdict.claim == "partly_explained":
        notes.append(_describe_remainder(search.chosen, problem.thresholds.residual.least_located_share))
    if verdict.names_causes and gain is not None and gain.ratio < 1.0:
        notes.append(NO_GAIN.format(gain.output, 1.0 / gain.ratio))
    told = search.chosen if verdict.names_causes else search.nominal
    if told.input_noise is not None:
        drive, found = problem.subject.drive, told.input_noise
        notes.append(
            INPUT_NOISE.format(name=drive, rms=found.share * found.rms, unit=units[drive], left=found.left)
        )
    if not verdict.leaves_gap:
        residuals = simulation_errors(told, problem)
        return [*notes, *describe_bursts(residuals, problem), *describe_tones(residuals, problem, units)]
    notes += filter(None, [doubt_kind(search, problem)])
    notes += [] if problem.allowed else describe_filters(problem)
    finished = not (stopped or search.out_of_time)
    if finished and not search.chosen.p_value > significance_level(problem, false_claim_rate):
        sharpest = min(search.chosen.tests, key=lambda one: one.p_value)
        least = problem.thresholds.report.min_p_shown
        p = f"= {sharpest.p_value:.2g}" if sharpest.p_value >= least else f"< {least:.0e}"
        notes.append(FAILED_TEST.format(len(search.chosen.tests), words_of_test(sharpest.name), p))
    return notes


def describe_taken_noise(found: InputNoise, name: str, unit: str) -> str:
    """Return the note on noise that was taken off the input `name` [unit] before causes were looked for."""
    return TAKEN_NOISE.format(name=name, rms=found.share * found.rms, unit=unit, left=found.left)


def doubt_kind(search: SearchResult, problem: Problem) -> str:
    """Return why the nominal model's response may be that of another kind of plant; "" where nothing speaks for it."""
    return problem.subject.describe_response(search.nominal.hypothesis.simulation)


def _describe_remainder(chosen: TestedHypothesis, least_share: float) -> str:
    """Return how much the named causes leave, and along which coordinates."""
    said = REMAINING.format(residual_over_noise(chosen))
    places = [
        f"{words_of_coordinate(one.coordinate)} ({one.share:.0%})"
        for one in localize_residual(chosen, least_share)
    ]
    return said + (REMAINING_ALONG.format(", ".join(places[:LOCATIONS])) if places else "")


def doubt_delays(causes: Sequence[Cause], problem: Problem) -> list[str]:
    """Return a sentence on each delay that half a sample of another hold may be a part of, and on such short lags."""
    if problem.subject.is_steady or any(cause.hold for cause in causes):
        return []
    period_s = max(record.period_s for record in problem.records)
    half = readable(0.5 * period_s, "s")
    holds = problem.records[0].stimulus.holds
    guessed = [name for name, hold in holds.items() if hold != "zero"]
    said = []
    for cause in causes:
        place, _, law = cause.id.rpartition(".")
        own = [name for name in guessed if place == f"input.{name}"] or guessed
        time = cause.parameters.get("time_constant")
        is_short = law == "lag" and time is not None and time.value <= period_s
        if own and (law in LATE or is_short):
            text = LAG_DOUBT if is_short else DELAY_DOUBT
            said.append(text.format(id=cause.id, half=half, signal=own[0], hold=holds[own[0]]))
    return said
