"""The first page of a report: the verdict, each cause with its size, what it is worth, and what to do."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from html import escape

from rtctl.diagnosis.problem.subject import LEFT_OUT
from rtctl.diagnosis.report.page.sections import estimate_text
from rtctl.diagnosis.report.words.findings import (
    describe_main_quantities,
    describe_shares,
    describe_spring,
    doubts_of,
    name_beyond_linear,
)
from rtctl.diagnosis.report.words.noise import Noise
from rtctl.diagnosis.report.words.plain_words import words_of_coordinate
from rtctl.diagnosis.report.words.remainder import RecordsError, Remainder
from rtctl.diagnosis.residual.noise_floor import residual_over_noise
from rtctl.diagnosis.result import ERROR, EXTENDED_MODEL, Cause, Diagnosis, share_text
from rtctl.models.derived.quantity import Derived
from rtctl.output.html_page import table, tile
from rtctl.output.readable_units import printed_unit, readable, readable_unit

UNSTATED = (
    "A probability compares the causes of the catalogue with one another. Where something else is left too, the "
    "catalogue may lack the right one, so none is stated."
)

CORRECT_FIRST = (
    "Then run rtctl identify and rtctl diagnose again (rtctl diagnose without --model does both): a wrong hold is no "
    "property of the device, and other values and causes may change with it."
)


def state_correction(diagnosis: Diagnosis) -> str:
    """Return which hold fits the data, with what to write; that it may, where the data do not decide."""
    sure = not any(cause.indistinguishable_from for cause in diagnosis.causes if cause.hold)
    return f"The hold in the manifest {'does' if sure else 'may'} not fit the data: {diagnosis.correction}."


def describe_verdict(diagnosis: Diagnosis) -> str:
    """Return the verdict in one sentence."""
    causes = [cause for cause in diagnosis.causes if not cause.hold]
    names = escape(name_with_rivals(causes))
    least = diagnosis.problem.thresholds.report.min_headline_share
    clear = diagnosis.where and diagnosis.where[0].share >= least
    place = (
        f": it goes with the {escape(words_of_coordinate(diagnosis.where[0].coordinate))}" if clear else ""
    )
    them = "it" if len(causes) == 1 else "them"
    rest = escape(diagnosis.problem.rest)
    beyond = escape(printed_unit(name_beyond_linear(diagnosis)), quote=False)
    texts = {
        "adequate": f"Nothing is wrong: the residual of the model is {rest}. {beyond}".rstrip(),
        "explained": f"Explained by {names}: with {them}, the residual is {rest}.",
        "partly_explained": f"Partly explained by {names}; something else is left.",
        "unexplained": f"Something is wrong that nothing in the catalogue explains{place}.",
    }
    if diagnosis.comes_in_bursts:
        texts["adequate"] = (
            "Nothing in the model is wrong that these records show, but what is left comes in bursts: what lies beside "
            f"them is {rest}. {beyond}"
        ).rstrip()
    if diagnosis.undecided:
        texts["unexplained"] = (
            f"Undecided: something is wrong{place}, and the search ended before it was through; nothing explains it "
            "so far."
        )
    if not diagnosis.correction:
        return f'<span class="{diagnosis.verdict}">{texts[diagnosis.verdict]}</span>'
    if not causes:
        rivals = [one for cause in diagnosis.causes for one in cause.rivals]
        doubt = f" These data cannot tell the hold from {escape(', '.join(rivals))}." if rivals else ""
        texts["explained"] = f"With it, the residual is {rest}.{doubt}"
        texts["partly_explained"] = f"Something else is left.{doubt}"
    # in the colour of what is not explained yet, whatever the verdict
    first = escape(f"{state_correction(diagnosis)} ", quote=False)
    return f'<span class="partly_explained">{first}{texts[diagnosis.verdict]}</span>'


def describe_kind_doubt(diagnosis: Diagnosis) -> str:
    """Return why the device may be of another kind, below the verdict."""
    doubt = diagnosis.kind_doubt
    return f'<p class="lead">{escape(_sentence(doubt))}</p>' if doubt else ""


def name_with_rivals(causes: Sequence[Cause]) -> str:
    """Return `friction.coulomb and (sensor.lag or drive.lag, these data do not tell which)`."""
    named = []
    for cause in causes:
        one = " or ".join((cause.id, *cause.rivals))
        one += ", these data do not tell which" if cause.rivals else ""
        named.append(f"({one})" if cause.rivals and len(causes) > 1 else one)
    return " and ".join(named)


def explain_test_error(diagnosis: Diagnosis) -> str:
    """Return why the error on test records may be far above the noise though nothing is wrong; "" where it is not."""
    gain, limits = diagnosis.gain, diagnosis.problem.thresholds.report
    judged_by_noise = diagnosis.verdict == "adequate" and not diagnosis.problem.allowed
    if not judged_by_noise or gain is None or gain.before <= limits.explained_error * gain.noise_floor:
        return ""
    return (
        "The error on the test records is still far above the noise. It is the error of free runs, in which small "
        "differences grow with time or come from the start; the model was judged by shorter runs, which it follows to "
        "the noise."
    )


def describe_causes(diagnosis: Diagnosis) -> str:
    """Return each cause in a sentence, with its size in the terms of those who use the device."""
    said = []
    for cause in diagnosis.causes:
        others = "".join(
            f' <span class="dim">{escape(name)}: {escape(printed_unit(text))}.</span>'
            for name, text in (one.in_words() for one in quantities_of(cause, diagnosis.derived))
        )
        doubts = escape("".join(f" {one}" for one in doubts_of(cause)))
        said.append(f'<p class="lead">{escape(cause.statement)}{doubts}{others}</p>')
    figures = describe_main_quantities(diagnosis)
    more = (
        f"{figures[:1].upper()}{figures[1:]}." if figures else "",
        describe_remainder(diagnosis),
        describe_spring(diagnosis),
        explain_test_error(diagnosis),
    )
    return "".join(said) + "".join(f'<p class="lead">{escape(printed_unit(one))}</p>' for one in more if one)


def describe_remainder(diagnosis: Diagnosis) -> str:
    """Return how large it is what is not explained, and whether it matters; "" where all is."""
    if diagnosis.verdict == "unexplained":
        return describe_unexplained(diagnosis)
    if diagnosis.verdict != "partly_explained" or not math.isfinite(diagnosis.noise_rms):
        return ""
    output = diagnosis.problem.subject.output
    over_noise, gain = residual_over_noise(diagnosis.search.chosen), diagnosis.gain
    tests = RecordsError(gain.after, gain.noise_floor) if gain is not None and gain.output == output else None
    unit, noise, size = diagnosis.units[output], Noise.of(diagnosis), diagnosis.problem.size(output)
    return Remainder.of(over_noise, output, unit, noise, size, tests).in_words


def describe_unexplained(diagnosis: Diagnosis) -> str:
    """Return how well a model predicts that something unknown is wrong with; "" where no test record shows it."""
    gain, output = diagnosis.gain, diagnosis.problem.subject.output
    if gain is None or gain.output != output or not math.isfinite(gain.before):
        return ""
    share = f"{100.0 * gain.before / diagnosis.problem.size(output):.2g} %"
    words = output.replace("_", " ")
    return f"That error of the model is {share} of the {words} itself, noise included."


def quantities_of(cause: Cause, derived: tuple[Derived, ...]) -> list[Derived]:
    """Return the derived quantities that speak of a cause: they have its id in their name."""
    return [one for one in derived if cause.id in one.name.replace(",", " ").split()]


def tabulate_gain(diagnosis: Diagnosis) -> str:
    """Return tiles of what the answer is worth: error on test records and in the loop, before and after, and noise."""
    tiles = [*_gain_tiles(diagnosis), *_loop_tiles(diagnosis)]
    with_rest = diagnosis.verdict in ("unexplained", "partly_explained")
    unit = diagnosis.units[diagnosis.problem.subject.output]
    tiles.append(
        tile(
            _size(diagnosis.noise_rms, unit),
            "noise of the reading, as estimated" + (" with what is not explained" if with_rest else ""),
        )
    )
    return '<div class="tiles">' + "".join(tiles) + "</div>"


def _gain_tiles(diagnosis: Diagnosis) -> list[str]:
    gain = diagnosis.gain
    if gain is None:
        return []
    output = gain.output.replace("_", " ")
    before = tile(
        _size(gain.before, gain.unit), f"RMS error of the {output} on test records: nominal model, re-fitted"
    )
    if not diagnosis.causes:
        return [before]
    times, how = gain.in_words.split(" times ")
    return [
        before,
        tile(_size(gain.after, gain.unit), "the same with the causes"),
        tile(f"{times}×", how.replace(",", " error;", 1)),
    ]


def _loop_tiles(diagnosis: Diagnosis) -> list[str]:
    loop = diagnosis.loop
    if loop is None:
        return []
    scaled = readable_unit(max(loop.before, loop.after), loop.unit)
    numbers = f"{scaled.of(loop.before):.3g} → {scaled.of(loop.after):.3g} {printed_unit(scaled.unit)}"
    text = f"in the loop, without and with the causes: {loop.scenario}"
    if loop.with_corrections is not None:
        text += LEFT_OUT.format(f"{scaled.of(loop.with_corrections):.3g} {printed_unit(scaled.unit)}")
    return [tile(numbers, escape(text))]


def _size(value: float, unit: str) -> str:
    if unit.startswith("ln("):  # a difference of logarithms is a relative error
        return f"{100.0 * value:.3g} %"
    if math.isinf(value):
        return readable(value, unit)
    scaled = readable_unit(value, unit)
    return f"{scaled.of(value):.3g} {escape(printed_unit(scaled.unit))}"


def tabulate_causes(diagnosis: Diagnosis) -> str:
    """Return a table of the causes: size, probability, share of the error, and what could replace them."""
    if not diagnosis.causes:
        return ""
    rows = []
    for cause in diagnosis.causes:
        values = "<br>".join(estimate_text(name, one) for name, one in cause.parameters.items())
        alike = [f"{one} (the same law)" for one in cause.same_law]
        others = ", ".join((*alike, *cause.rivals)) or "nothing in the catalogue"
        probability = "not stated" if cause.probability is None else f"{cause.probability:.1%}"
        rows.append(
            [f"<b>{escape(cause.id)}</b>", values, probability,
             f"{share_text(cause.share_removed)} of {_whole(cause)}", escape(others)]
        )  # fmt: skip
    headers = ["cause", "parameters, 95 % interval", "probability", "removes", "would explain it as well"]
    unstated = any(cause.probability is None for cause in diagnosis.causes)
    notes = (UNSTATED if unstated else "", describe_shares(diagnosis.causes))
    return table(headers, rows, numbers=(2,)) + "".join(
        f'<p class="small dim">{one}</p>' for one in notes if one
    )


def _whole(cause: Cause) -> str:
    return f"{ERROR} above the noise" if cause.share_of == ERROR else cause.share_of


def describe_what_to_do(diagnosis: Diagnosis, how: str) -> str:
    """Return what follows from the answer: a model to use or why there is none, an experiment that decides, or both.

    Args:
        diagnosis: The answer.
        how: How the next experiment is played, commands in backticks.
    """
    steps = []
    if diagnosis.correction:  # what else is said here was found with a wrong drive
        first = escape(f"{_sentence(diagnosis.correction)} {CORRECT_FIRST}", quote=False)
        return f"<h3>What to do</h3><ul><li>{first}</li></ul>"
    if diagnosis.causes and not diagnosis.withheld:
        steps.append(
            f"Use <code>{EXTENDED_MODEL}</code> in place of the nominal model; look at the test records below first."
        )
    if diagnosis.causes and diagnosis.withheld:
        steps.append(escape(_sentence(diagnosis.withheld)))
    if diagnosis.next_experiment is not None:
        proposed = diagnosis.next_experiment
        plays = "" if proposed.in_vain else " " + re.sub("`(.*?)`", r"<code>\1</code>", escape(how))
        steps.append(escape(proposed.statement) + plays)
    if not steps and diagnosis.verdict == "adequate":
        steps.append("Nothing: the model describes these records as well as any could.")
    if not steps:
        return ""
    return "<h3>What to do</h3><ul>" + "".join(f"<li>{one}</li>" for one in steps) + "</ul>"


def describe_notes(diagnosis: Diagnosis) -> str:
    """Return what a reader must know beside the verdict."""
    told = [one for one in diagnosis.warnings if one != diagnosis.kind_doubt]
    if not told:
        return ""
    notes = "".join(f'<div class="note">{escape(_sentence(one))}</div>' for one in told)
    return f"<h3>What to know</h3>{notes}"


def _sentence(text: str) -> str:
    """Return a remark with a capital letter at its beginning and a full stop at its end."""
    ended = text if text.endswith((".", "?", "!")) else f"{text}."
    return ended[:1].upper() + ended[1:]
