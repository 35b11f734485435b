"""The sections of a report in words and tables; every number with its unit."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from rtctl.border.mechanisms import plain_unit
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.report.ranking import ranking_of
from rtctl.diagnosis.report.words.plain_words import words_of_coordinate, words_of_test
from rtctl.diagnosis.residual.parameter_estimates import estimates_of
from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.thresholds import ReportThresholds
from rtctl.measured.dataset import Dataset
from rtctl.measured.summary import RECORD_HEADERS, SIGNAL_HEADERS, record_rows, signal_rows, summarise
from rtctl.output.html_page import table
from rtctl.output.readable_units import printed_unit, readable_unit, significant

NOT_TESTED = "not tested"
PARTS = "only its initial part: after that the candidates, or the model without them, take different courses"
MENU = (
    "What is proposed stands first; the other inputs that the plant can take follow, best first. An input of "
    "which only the initial part counts is proposed only where no other decides."
)
TESTS = (
    "Each test looks for one thing in what is left of the error. p is the probability that noise alone would look as "
    "much like it. Something is left where a p is below {each:.2g}: {level:.2g}, shared by {count} tests."
)
CHANCE = (
    "The smallest p, {least}, is below that. It counts as chance: no set of causes that would explain it is worth its "
    "parameters by BIC, so none is claimed."
)
HOW_NAMED = {
    "adequate": "None is worth its parameters beside the nominal model, so none is named.",
    "explained": "With the set that is named, nothing else is left in the residual.",
    "partly_explained": "None of them brings the residual down to noise: the named set removes a part of the error.",
    "unexplained": "None of them explains the error, so none is named.",
}
"""How a set came to be named, by verdict."""
NOT_TRIED = "None: the re-fitted nominal model passes the residual tests above, so no cause was looked for."
NOT_FINISHED = "The residual tests above find something, and no set of causes was fitted to its end."


def _limits(diagnosis: Diagnosis) -> ReportThresholds:
    return diagnosis.problem.thresholds.report


def describe_place(diagnosis: Diagnosis) -> str:
    """Return the coordinates along which the error lives, in words."""
    if not diagnosis.where:
        rest = f"nothing: what is left is {escape(diagnosis.problem.rest)}"
        none = "none of the coordinates that are looked at, by itself"
        return f"<p>With {rest if diagnosis.verdict == 'adequate' else none}.</p>"
    first, *others = (
        f"{escape(words_of_coordinate(one.coordinate))} ({one.share:.0%})" for one in diagnosis.where
    )
    return (
        f"<p>Mostly with {first}"
        + (f"; then {', '.join(others[:3])}" if others else "")
        + ": the share of the error "
        "that a missing force which depends on this alone would remove.</p>"
    )


def estimate_text(name: str, one: Estimate) -> str:
    """Return `name = value unit [low, high]` as HTML, in a unit that fits; the name may be empty."""
    bare = plain_unit(one.unit)
    scaled = readable_unit(max(abs(one.value), 0.5 * (one.high - one.low)), bare)
    value, low, high = significant(scaled.of(one.value), scaled.of(one.low), scaled.of(one.high))
    interval = f" <span class=dim>[{low}, {high}]</span>" if one.high > one.low else ""
    told = f"{escape(name)} = " if name else ""
    return f"{told}{value} {escape(printed_unit(scaled.unit))}{interval}"


def tabulate_candidates(diagnosis: Diagnosis) -> str:
    """Return how many sets of causes were tried, and a table of the best."""
    ranking = ranking_of(diagnosis)
    if not ranking:
        return f"<p>{NOT_TRIED if diagnosis.search.nominal.p_value > diagnosis.level else NOT_FINISHED}</p>"
    count = sum(len(size) for size in diagnosis.search.rankings)
    limits, least = _limits(diagnosis), min(one.bic for _, one in ranking)
    rows = [
        [escape(label), bic_text(one.bic - least, limits.max_bic_shown)]
        for label, one in ranking[: limits.max_candidates_shown]
    ]
    sets = f"{count} sets of causes were" if count > 1 else "One set of causes was"
    text = f"<p>{sets} fitted. The best by BIC; a difference of 10 is strong evidence:</p>"
    return text + table(["candidate", "BIC above the best"], rows, numbers=(1,))


def bic_text(above: float, most: float) -> str:
    """Return how far a BIC is above the best, which far above it needs no digits."""
    return f"{above:.1f}" if above < most else f"more than {most:,.0f}"


def tabulate_tests(diagnosis: Diagnosis) -> str:
    """Return a table of the residual tests, without and with the causes."""
    after = {test.name: test for test in diagnosis.search.chosen.tests}
    same = diagnosis.search.chosen is diagnosis.search.nominal
    rows = []
    for test in diagnosis.search.nominal.tests:
        later = after.get(test.name)
        row = [escape(words_of_test(test.name)), _p(test.p_value)]
        rows.append(row if same else [*row, _p(later.p_value) if later else NOT_TESTED])
    if not same:
        known = {test.name for test in diagnosis.search.nominal.tests}
        rows += [
            [escape(words_of_test(t.name)), NOT_TESTED, _p(t.p_value)]
            for t in diagnosis.search.chosen.tests
            if t.name not in known
        ]
    headers = ["does what is left of the error still hold …", "p, nominal model"] + (
        [] if same else ["p, best candidate"]
    )
    return f"<p>{describe_tests(diagnosis)}</p>" + table(headers, rows, numbers=(1, 2))


def describe_tests(diagnosis: Diagnosis) -> str:
    """Return what the tests ask, from which p on something is left, and what follows here."""
    chosen = diagnosis.search.chosen
    count, least = len(chosen.tests), min(one.p_value for one in chosen.tests)
    said = [TESTS.format(count=count, level=diagnosis.level, each=diagnosis.level / max(count, 1))]
    finds = not chosen.p_value > diagnosis.level
    if diagnosis.verdict == "partly_explained":
        said.append("Something is left beside the causes: they are claimed as a part of what is wrong.")
    elif diagnosis.verdict in ("adequate", "explained") and finds:
        said.append(CHANCE.format(least=_p(least)))
    return " ".join(said)


def _p(value: float) -> str:
    least = ReportThresholds().min_p_shown
    return f"{value:.2g}" if value >= least else f"&lt; {least:.0e}"


def tabulate_menu(diagnosis: Diagnosis) -> str:
    """Return a table of the inputs among which the next experiment was chosen, best first."""
    proposed = diagnosis.next_experiment
    if proposed is None:
        return ""
    planned = [scored.input.statement for scored, _ in proposed.plan.records]
    best_first = sorted(proposed.menu, key=lambda one: one.input.statement not in planned)
    rows = []
    for one in best_first[: _limits(diagnosis).max_table_rows]:
        words = escape(one.input.statement) + ("" if one.whole else f" ({PARTS})")
        is_planned = one.input.statement in planned and not proposed.in_vain
        rows.append([f"<b>{words}: proposed</b>" if is_planned else words, f"{one.separation:.3g}"])
    return f"<h3>Inputs for the next experiment</h3><p>{MENU}</p>" + table(
        ["input", "least separation by one record, standard errors"], rows, numbers=(1,)
    )


def tabulate_derived(diagnosis: Diagnosis) -> str:
    """Return a table of what follows from the parameters in the terms of those who use the device."""
    rows = [
        [escape(name), escape(printed_unit(text))]
        for name, text in (one.in_words() for one in diagnosis.derived)
    ]
    if not rows:
        return ""
    whose = "the extended model" if diagnosis.causes else "the re-fitted model"
    lacks = diagnosis.verdict in ("unexplained", "partly_explained")
    off = " The model lacks something, so these values may be off by more." if lacks else ""
    return (
        f"<h3>In other terms, of {whose}</h3>"
        + table(["quantity", "value"], rows)
        + f'<p class="small dim">Intervals as if the parameters were independent of one another.{off}</p>'
    )


def describe_work(diagnosis: Diagnosis) -> str:
    """Return in a few sentences how the answer came about."""
    fitted, tests = len(diagnosis.problem.records), len({one.name for one in diagnosis.tests})
    tried = sum(len(size) for size in diagnosis.search.rankings)
    said = [
        f"The nominal model was fitted again to {counted(fitted, 'record')}, so that a wrong value is not taken for a "
        "missing effect."
    ]
    if tried:
        said.append(
            f"Then {counted(tried, 'set')} of causes of the catalogue, each fitted together with all nominal "
            f"parameters, were compared. {HOW_NAMED[diagnosis.verdict]}"
        )
    said.append(
        f"All gains are on {counted(tests, 'test record')}, which no fit saw."
        if tests
        else "No record is a test: the figures are of the records that were fitted."
    )
    return f"<p>{' '.join(said)}</p>"


def counted(number: int, what: str) -> str:
    """Return `3 records`, or `1 record`."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def tabulate_parameters(diagnosis: Diagnosis) -> str:
    """Return a table of the model's parameters: in the file, re-fitted, and with the causes.

    A model that lacks something has values, but no intervals: its residual is no noise by which they could be stated.
    """
    off = any(cause.kind == "parameter" for cause in diagnosis.causes)
    nominal = estimates_of(diagnosis.search.nominal if off else diagnosis.fits.before, "")
    extended = estimates_of(diagnosis.fits.after, "") if diagnosis.causes else {}
    given = {one.name: one for one in diagnosis.before.parameters}
    lacks = not off and diagnosis.verdict != "adequate"
    rows = []
    for name, one in nominal.items():
        file = f"{given[name].value:.6g} {escape(printed_unit(plain_unit(given[name].unit)))}"
        refitted = one._replace(low=one.value, high=one.value) if lacks else one
        row = [escape(name), file, estimate_text("", refitted)]
        rows.append([*row, estimate_text("", extended[name])] if name in extended else row)
    doubt = " if nothing else is missing" if diagnosis.verdict == "partly_explained" else ""
    last = (
        [f"with one value mended, 95 %{doubt}" if off else f"with the causes, 95 %{doubt}"]
        if extended
        else []
    )
    headers = ["parameter", "model file", "re-fitted" if lacks else "re-fitted, 95 %", *last]
    return table(headers, rows)


def tabulate_data(dataset: Dataset) -> str:
    """Return the tables of what was read, signals and records, behind a fold."""
    summary = summarise(dataset)
    signals = [[escape(cell) for cell in row] for row in signal_rows(summary)]
    records = [[escape(cell) for cell in row] for row in record_rows(summary)]
    first = SIGNAL_HEADERS.index("first")
    return (
        "<details><summary>What was read: "
        f"{counted(len(signals), 'signal')}, {counted(len(records), 'record')}</summary>"
        + table(SIGNAL_HEADERS, signals, numbers=range(first, len(SIGNAL_HEADERS)))
        + table(RECORD_HEADERS, records, numbers=range(RECORD_HEADERS.index("rows"), len(RECORD_HEADERS) - 1))
        + "</details>"
    )


def tabulate_provenance(provenance: Mapping[str, Any]) -> str:
    """Return a table of the origin of the answer, from which it can be repeated."""
    rows = []
    for name, value in provenance.items():
        if isinstance(value, Mapping):
            text = "<br>".join(
                f"{escape(str(k))}: <code>{escape(str(v)[:16])}…</code>" for k, v in value.items()
            )
            if len(value) > ReportThresholds().max_nested_rows:
                text = f"<details><summary>{len(value)} of them</summary>{text}</details>"
        else:
            text = escape(", ".join(map(str, value)) if isinstance(value, list) else str(value))
        rows.append([escape(name.replace("_", " ")), f"<code>{text}</code>" if name == "command" else text])
    return "<h3>Provenance</h3>" + table(["", ""], rows)
