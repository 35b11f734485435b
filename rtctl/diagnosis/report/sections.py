"""The sections of a report in words and tables; every number with its unit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from html import escape
from typing import Any

from rtctl.border.mechanisms import plain_unit
from rtctl.border.readable_units import significant
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.report.ranking import ranking_of
from rtctl.diagnosis.residual.parameter_estimates import estimates_of
from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.thresholds import ReportThresholds
from rtctl.measured.dataset import Dataset
from rtctl.measured.summary import RECORD_HEADERS, SIGNAL_HEADERS, record_rows, signal_rows, summarise
from rtctl.output.html_page import table

PARTS = "its initial part alone: then the candidates, or the model without them, take different courses"


def _limits(diagnosis: Diagnosis) -> ReportThresholds:
    return diagnosis.problem.thresholds.report


def describe_verdict(diagnosis: Diagnosis) -> str:
    """Return the verdict in one sentence."""
    names = " and ".join(escape(cause.id) for cause in diagnosis.causes)
    clear = diagnosis.where and diagnosis.where[0].share >= _limits(diagnosis).min_headline_share
    place = f": it lives along {escape(diagnosis.where[0].coordinate.replace('_', ' '))}" if clear else ""
    rivals = [one for cause in diagnosis.causes for one in cause.indistinguishable_from]
    undecided = f", or {escape(', '.join(rivals))} in its place: these data do not decide" if rivals else ""
    them = "it" if len(diagnosis.causes) == 1 else "them"
    rest = escape(diagnosis.problem.rest)
    texts = {
        "adequate": f"Nothing is wrong: the residual of the model is {rest}.",
        "explained": f"Explained by {names}{undecided}: with {them}, the residual is {rest}.",
        "partly_explained": f"Partly explained by {names}{undecided}; something else is left.",
        "unexplained": f"Something is wrong that nothing in the catalogue explains{place}.",
    }
    if diagnosis.undecided:
        texts["unexplained"] = (
            f"Undecided: something is wrong{place}, and the search ended before it was through; nothing explains it "
            "so far."
        )
    return f'<span class="{diagnosis.verdict}">{texts[diagnosis.verdict]}</span>'


def describe_place(diagnosis: Diagnosis) -> str:
    """Return the coordinates along which the error lives, in words."""
    if not diagnosis.where:
        return f"<p>Along no coordinate: the residual is {escape(diagnosis.problem.rest)}.</p>"
    first, *others = (
        f"{escape(one.coordinate.replace('_', ' '))} ({one.share:.0%})" for one in diagnosis.where
    )
    return f"<p>Mostly along {first}" + (f"; then {', '.join(others[:3])}" if others else "") + ".</p>"


def tabulate_causes(diagnosis: Diagnosis) -> str:
    """Return a table of the causes: parameters, probability, share of the error, and what could replace them."""
    if not diagnosis.causes:
        return ""
    rows = []
    for cause in diagnosis.causes:
        values = "<br>".join(_estimate(name, one) for name, one in cause.parameters.items())
        others = ", ".join(cause.indistinguishable_from) or "nothing in the catalogue"
        probability = "–" if cause.probability is None else f"{cause.probability:.1%}"
        rows.append(
            [f"<b>{escape(cause.id)}</b><br>{escape(cause.statement)}", probability, values,
             f"{_share(cause.share_removed)} of the error above the noise", escape(others)]
        )  # fmt: skip
    headers = [
        "cause",
        "probability",
        "parameters, 95 % interval",
        "removes",
        "would explain it as well",
    ]
    return f"<h2>The cause{'s' if len(rows) > 1 else ''}</h2>" + table(headers, rows, numbers=(1,))


def _share(share: float) -> str:
    return f"{share:.0%}" if share >= 0.01 else f"{share:.1%}"


def _estimate(name: str, one: Estimate) -> str:
    value, low, high = significant(one.value, one.low, one.high)
    return f"{escape(name)} = {value} {format_unit(one.unit)} <span class=dim>[{low}, {high}]</span>"


def format_unit(unit: str) -> str:
    """Return `mm/(s^2*V)` as `mm/(s²*V)`, as HTML; an empty string for a number without a unit."""
    bare = plain_unit(unit)
    for power, sign in (("^2", "²"), ("^3", "³"), ("^4", "⁴"), ("^5", "⁵")):
        bare = bare.replace(power, sign)
    return escape(re.sub(r"\bum\b", "µm", bare))


def tabulate_candidates(diagnosis: Diagnosis) -> str:
    """Return how many sets of causes were tried, and a table of the best."""
    ranking = ranking_of(diagnosis)
    if not ranking:
        return "<p>None: the re-fitted nominal model passes every residual test below, so no cause was looked for.</p>"
    count = sum(len(size) for size in diagnosis.search.rankings)
    best = next(r for r in diagnosis.search.rankings if r[0].hypothesis is ranking[0][1])
    rows = [
        [escape(" + ".join(one.hypothesis.mechanisms)), f"{one.bic - best[0].bic:,.1f}"]
        for one in best[: _limits(diagnosis).max_table_rows]
    ]
    sets = f"{count} sets of causes were" if count > 1 else "One set of causes was"
    text = f"<p>{sets} fitted. The best by BIC; a difference of 10 is strong evidence:</p>"
    return text + table(["candidate", "BIC above the best"], rows, numbers=(1,))


def tabulate_tests(diagnosis: Diagnosis) -> str:
    """Return a table of the residual tests, without and with the causes."""
    after = {test.name: test for test in diagnosis.search.chosen.tests}
    same = diagnosis.search.chosen is diagnosis.search.nominal
    rows = []
    for test in diagnosis.search.nominal.tests:
        later = after.get(test.name)
        row = [escape(test.name), _p(test.p_value)]
        rows.append(row if same else [*row, _p(later.p_value) if later else "–"])
    if not same:
        known = {test.name for test in diagnosis.search.nominal.tests}
        rows += [
            [escape(t.name), "–", _p(t.p_value)] for t in diagnosis.search.chosen.tests if t.name not in known
        ]
    headers = ["does the residual still hold …", "p, today's model"] + ([] if same else ["p, best candidate"])
    text = (
        "<p>A cause may be claimed only if nothing else is left in the residual. Small p: something is.</p>"
    )
    return text + table(headers, rows, numbers=(1, 2))


def _p(value: float) -> str:
    least = ReportThresholds().min_p_shown
    return f"{value:.2g}" if value >= least else f"&lt; {least:.0e}"


def describe_proposal(diagnosis: Diagnosis) -> str:
    """Return the next experiment, and a table of the other inputs, best first."""
    proposed = diagnosis.next_experiment
    if proposed is None:
        return ""
    rows = [
        [escape(one.input.statement) + ("" if one.whole else f" ({PARTS})"), f"{one.separation:.3g}"]
        for one in proposed.menu[: _limits(diagnosis).max_table_rows]
    ]
    plays = "" if proposed.in_vain else "<code>rtctl acquire next-experiment.toml --out DIR</code> plays it. "
    return (
        f"<h2>The next experiment</h2><p>{escape(proposed.statement)}</p>"
        f"<p>{plays}Of the inputs that the plant can take:</p>"
        + table(["input", "least separation by one record, standard errors"], rows, numbers=(1,))
    )


def tabulate_parameters(diagnosis: Diagnosis) -> str:
    """Return a table of the model's parameters: in the file, re-fitted, and with the causes."""
    off = any(cause.kind == "parameter" for cause in diagnosis.causes)
    nominal = estimates_of(diagnosis.search.nominal if off else diagnosis.fits.before, "")
    extended = estimates_of(diagnosis.fits.after, "") if diagnosis.causes else {}
    given = {one.name: one for one in diagnosis.before.parameters}
    rows = []
    for name, one in nominal.items():
        file = f"{given[name].value:.6g} {format_unit(given[name].unit)}"
        row = [escape(name), file, _estimate("", one).removeprefix(" = ")]
        rows.append([*row, _estimate("", extended[name]).removeprefix(" = ")] if name in extended else row)
    last = ["with one value mended, 95 %" if off else "with the causes, 95 %"] if extended else []
    headers = ["parameter", "model file", "re-fitted, 95 %", *last]
    return "<h2>The model's parameters</h2>" + table(headers, rows)


def tabulate_data(dataset: Dataset) -> str:
    """Return the tables of what was read, signals and records, behind a fold."""
    summary = summarise(dataset)
    signals = [[escape(cell) for cell in row] for row in signal_rows(summary)]
    records = [[escape(cell) for cell in row] for row in record_rows(summary)]
    first = SIGNAL_HEADERS.index("first")
    return (
        "<details><summary>What was read: "
        f"{len(signals)} signals, {len(records)} record{'s' if len(records) != 1 else ''}</summary>"
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
    return "<h2>Provenance</h2>" + table(["", ""], rows)
