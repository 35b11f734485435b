"""A diagnosis as a person reads it in a terminal."""

from __future__ import annotations

from pathlib import Path

from rtctl.diagnosis.problem.subject import LEFT_OUT
from rtctl.diagnosis.report.page.summary import (
    CORRECT_FIRST,
    describe_remainder,
    explain_test_error,
    quantities_of,
    state_correction,
)
from rtctl.diagnosis.report.words.findings import (
    describe_main_quantities,
    describe_shares,
    describe_spring,
    doubts_of,
    main_quantities,
    name_beyond_linear,
    spring_of,
    with_error,
)
from rtctl.diagnosis.report.words.noise import describe_noise
from rtctl.diagnosis.report.words.plain_words import words_of_coordinate
from rtctl.diagnosis.result import EXTENDED_MODEL, Diagnosis
from rtctl.output.readable_units import readable, readable_unit

VERDICTS = {
    "adequate": "Nothing is wrong: what is left is {rest}.",
    "explained": "Explained: with the causes below, what is left is {rest}.",
    "partly_explained": "Partly explained: the causes below remove most of it, and something else is left.",
    "unexplained": "Unexplained: something is wrong, and nothing in the catalogue explains it.",
}
ADEQUATE_BUT_BURSTS = (
    "Nothing in the model is wrong that these records show, but what is left comes in bursts (below): what lies beside "
    "them is {rest}."
)
UNDECIDED = (
    "Undecided: something is wrong, and the search ended before it was through; nothing explains it so far."
)


def print_diagnosis(found: Diagnosis, folder: Path, *, written: bool = True) -> None:
    """Verdict, causes, gain, place, warnings, and where the files are, if they were `written`."""
    _print_verdict(found)
    _print_causes(found)
    _print_gain(found)
    for text in (describe_remainder(found), describe_spring(found), explain_test_error(found)):
        if text:
            print(f"  {text}")
    if found.where:
        print(
            "  the error goes with "
            + ", ".join(
                f"{words_of_coordinate(place.coordinate)} ({place.share:.0%})" for place in found.where[:3]
            )
        )
    _print_derived(found)
    for warning in found.warnings:
        if warning != found.kind_doubt:
            print(f"  note: {warning}")
    if found.next_experiment is not None and not found.correction:
        print(f"  {found.next_experiment.statement}")
    if written:
        model = f" ({found.withheld})" if found.withheld else f", {EXTENDED_MODEL}"
        print(f"results in {folder}: report.html, diagnosis.json{model}")


def _print_verdict(found: Diagnosis) -> None:
    """Print the verdict, what the nominal model has beyond a linear one, and its main figures."""
    if found.correction:
        print(f"{state_correction(found)} {CORRECT_FIRST}")
    verdict = UNDECIDED if found.undecided else VERDICTS[found.verdict]
    if found.verdict == "adequate" and found.comes_in_bursts:
        verdict = ADEQUATE_BUT_BURSTS
    print(verdict.format(rest=found.problem.rest))
    if found.kind_doubt:
        print(f"  {found.kind_doubt}")
    if found.verdict == "adequate" and (beyond := name_beyond_linear(found)):
        print(f"  {beyond}")
    if figures := describe_main_quantities(found):
        print(f"  {figures}")


def _print_causes(found: Diagnosis) -> None:
    """Print each cause with what the data, or no data, tell it from."""
    for cause in found.causes:
        print(f"  {cause.certainty:>5}  {' '.join([f'{cause.id}: {cause.statement}', *doubts_of(cause)])}")
        for name, text in (one.in_words() for one in quantities_of(cause, found.derived)):
            print(f"         {name}: {text}")
    if shares := describe_shares(found.causes):
        print(f"  {shares}")


def _print_gain(found: Diagnosis) -> None:
    """Print the errors on the test records and in the loop, without and with the causes."""
    if (gain := found.gain) is not None:
        after = f" -> {readable(gain.after, gain.unit)}" if found.causes else ""
        print(
            f"  error on test records: {readable(gain.before, gain.unit)}{after} "
            f"({describe_noise(found)}){f'; {gain.in_words}' if found.causes else ''}"
        )
    if found.loop is not None:
        loop, unit = found.loop, readable_unit(found.loop.before, found.loop.unit)
        left_out = (
            "" if loop.with_corrections is None else LEFT_OUT.format(unit.text(loop.with_corrections, 3))
        )
        print(
            f"  in the loop: {loop.scenario}: {unit.text(loop.before, 3)} -> {unit.text(loop.after, 3)}{left_out}"
        )


def _print_derived(found: Diagnosis) -> None:
    """Print in one line what else follows from the model's parameters: what no sentence above said."""
    derived = found.derived
    said = {one.name for cause in found.causes for one in quantities_of(cause, derived)}
    said |= {one.name for one in main_quantities(derived)}
    said |= {one.name for one in spring_of(derived)} if describe_spring(found) else set()
    rest = [with_error(one) for one in derived if one.name not in said]
    if rest:
        print(f"  {'extended' if found.causes else 're-fitted'} model: {'; '.join(rest)}")
