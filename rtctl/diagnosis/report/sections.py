"""The sections of a report in words and tables; every number with its unit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from html import escape
from typing import Any

from rtctl.border.mechanisms import plain_unit
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.report.ranking import ranking_of
from rtctl.diagnosis.residual.parameter_estimates import estimates_of
from rtctl.diagnosis.result import Diagnosis
from rtctl.output.html_page import significant, table

MOST_ROWS = 8
SHOWN = 3
"""Rows of a table within a table before it folds."""
CLEAR = 0.1
"""Of the error: what a force along the first coordinate removes at least where a headline names it."""
PARTS = "its beginning alone: then the candidates, or the model without them, go different ways"


def verdict_sentence(found: Diagnosis) -> str:
    """The answer."""
    names = " and ".join(escape(cause.id) for cause in found.causes)
    clear = found.where and found.where[0].share >= CLEAR
    place = f": it lives along {escape(found.where[0].coordinate.replace('_', ' '))}" if clear else ""
    rivals = [one for cause in found.causes for one in cause.indistinguishable_from]
    undecided = f", or {escape(', '.join(rivals))} in its place: these data do not decide" if rivals else ""
    them = "it" if len(found.causes) == 1 else "them"
    rest = escape(found.problem.subject.rest)
    texts = {
        "adequate": f"Nothing is wrong: what the model leaves is {rest}.",
        "explained": f"Explained by {names}{undecided}: with {them}, what is left is {rest}.",
        "partly_explained": f"Partly explained by {names}{undecided}; something else is left.",
        "unexplained": f"Something is wrong that nothing in the catalogue explains{place}.",
    }
    if found.undecided:
        texts["unexplained"] = (
            f"Undecided: something is wrong{place}, and the search ended before it was through; nothing explains it "
            "so far."
        )
    return f'<span class="{found.verdict}">{texts[found.verdict]}</span>'


def place(found: Diagnosis) -> str:
    """Where the error lives, in words."""
    if not found.where:
        return f"<p>Along no coordinate: what is left is {escape(found.problem.subject.rest)}.</p>"
    first, *others = (f"{escape(one.coordinate.replace('_', ' '))} ({one.share:.0%})" for one in found.where)
    return f"<p>Mostly along {first}" + (f"; then {', '.join(others[:3])}" if others else "") + ".</p>"


def causes(found: Diagnosis) -> str:
    """Each with parameters, probability, what it removes and what could stand in its place."""
    if not found.causes:
        return ""
    rows = []
    for cause in found.causes:
        values = "<br>".join(_estimate(name, one) for name, one in cause.parameters.items())
        others = ", ".join(cause.indistinguishable_from) or "nothing in the catalogue"
        rows.append(
            [f"<b>{escape(cause.id)}</b><br>{escape(cause.statement)}", f"{cause.probability:.1%}", values,
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
    return f"{escape(name)} = {value} {readable(one.unit)} <span class=dim>[{low}, {high}]</span>"


def readable(unit: str) -> str:
    """`mm/(s^2*V)` as `mm/(s²*V)`, as HTML; nothing of a number that has none."""
    bare = plain_unit(unit)
    for power, sign in (("^2", "²"), ("^3", "³"), ("^4", "⁴"), ("^5", "⁵")):
        bare = bare.replace(power, sign)
    return escape(re.sub(r"\bum\b", "µm", bare))


def candidates(found: Diagnosis) -> str:
    """How many were tried, and the best of them."""
    ranking = ranking_of(found)
    if not ranking:
        return "<p>None: the re-fitted nominal model passes every question below, so no cause was looked for.</p>"
    count = sum(len(size) for size in found.search.rankings)
    best = next(r for r in found.search.rankings if r[0].hypothesis is ranking[0][1])
    rows = [
        [escape(" + ".join(one.hypothesis.mechanisms)), f"{one.bic - best[0].bic:,.1f}"]
        for one in best[:MOST_ROWS]
    ]
    sets = f"{count} sets of causes were" if count > 1 else "One set of causes was"
    text = f"<p>{sets} fitted. The best by BIC; a difference of 10 is strong evidence:</p>"
    return text + table(["candidate", "BIC above the best"], rows, numbers=(1,))


def questions(found: Diagnosis) -> str:
    """What the gate asked of the residual, before and after."""
    after = {test.name: test for test in found.search.chosen.tests}
    same = found.search.chosen is found.search.nominal
    rows = []
    for test in found.search.nominal.tests:
        later = after.get(test.name)
        row = [escape(test.name), _p(test.p_value)]
        rows.append(row if same else [*row, _p(later.p_value) if later else "–"])
    if not same:
        known = {test.name for test in found.search.nominal.tests}
        rows += [
            [escape(t.name), "–", _p(t.p_value)] for t in found.search.chosen.tests if t.name not in known
        ]
    headers = ["does the residual still hold …", "p, today's model"] + ([] if same else ["p, best candidate"])
    text = (
        "<p>A cause may be claimed only if nothing else is left in the residual. Small p: something is.</p>"
    )
    return text + table(headers, rows, numbers=(1, 2))


def _p(value: float) -> str:
    return f"{value:.2g}" if value >= 1e-12 else "&lt; 1e-12"


def proposal(found: Diagnosis) -> str:
    """The next experiment with the rest of the menu, best first."""
    proposed = found.next_experiment
    if proposed is None:
        return ""
    rows = [
        [escape(one.input.statement) + ("" if one.whole else f" ({PARTS})"), f"{one.separation:.3g}"]
        for one in proposed.menu[:MOST_ROWS]
    ]
    plays = "" if proposed.in_vain else "<code>rtctl acquire next-experiment.toml --out DIR</code> plays it. "
    return (
        f"<h2>The next experiment</h2><p>{escape(proposed.statement)}</p>"
        f"<p>{plays}Of the inputs that the plant can take:</p>"
        + table(["input", "least separation by one record, standard errors"], rows, numbers=(1,))
    )


def parameters(found: Diagnosis) -> str:
    """Of the model: as the file has them, re-fitted, and with the causes."""
    off = any(cause.kind == "parameter" for cause in found.causes)
    nominal = estimates_of(found.search.nominal if off else found.fits.before, "")
    extended = estimates_of(found.fits.after, "") if found.causes else {}
    given = {one.name: one for one in found.before.parameters}
    rows = []
    for name, one in nominal.items():
        file = f"{given[name].value:.6g} {readable(given[name].unit)}"
        row = [escape(name), file, _estimate("", one).removeprefix(" = ")]
        rows.append([*row, _estimate("", extended[name]).removeprefix(" = ")] if name in extended else row)
    last = ["with one value mended, 95 %" if off else "with the causes, 95 %"] if extended else []
    headers = ["parameter", "model file", "re-fitted, 95 %", *last]
    return "<h2>The model's parameters</h2>" + table(headers, rows)


def provenance_section(provenance: Mapping[str, Any]) -> str:
    """Where it comes from, so that it can be done again."""
    rows = []
    for name, value in provenance.items():
        if isinstance(value, Mapping):
            text = "<br>".join(
                f"{escape(str(k))}: <code>{escape(str(v)[:16])}…</code>" for k, v in value.items()
            )
            if len(value) > SHOWN:
                text = f"<details><summary>{len(value)} of them</summary>{text}</details>"
        else:
            text = escape(", ".join(map(str, value)) if isinstance(value, list) else str(value))
        rows.append([escape(name.replace("_", " ")), f"<code>{text}</code>" if name == "command" else text])
    return "<h2>Provenance</h2>" + table(["", ""], rows)
