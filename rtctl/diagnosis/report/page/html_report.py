"""`report.html`: a diagnosis for a design review, on one page: summary, evidence, model, method. It prints on A4."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any

from rtctl.diagnosis.report.page.sections import (
    describe_place,
    describe_work,
    tabulate_candidates,
    tabulate_data,
    tabulate_derived,
    tabulate_menu,
    tabulate_parameters,
    tabulate_provenance,
    tabulate_tests,
)
from rtctl.diagnosis.report.page.summary import (
    describe_causes,
    describe_kind_doubt,
    describe_notes,
    describe_verdict,
    describe_what_to_do,
    tabulate_causes,
    tabulate_gain,
)
from rtctl.diagnosis.result import Diagnosis
from rtctl.extras import can_draw
from rtctl.measured.dataset import Dataset
from rtctl.output.html_page import figure, page

if TYPE_CHECKING:
    from rtctl.diagnosis.report.pictures import Picture

CAPTIONS = {
    "stretch": "Free runs from the start of {each}{start}, no measured output "
    "fed in. Errors within the grey band are noise; {whose}.",
    "others": "The same for the other reading, in the record where the nominal model is worst at it.",
    "spectrum": "Where the error stands above the grey line, something is missing that a model could know.",
    "plane": "Mean error of all records that are compared, over {output} and its rate. A "
    "pattern (a sign that changes with velocity, a corner, a ring) is structure; a right model leaves none. "
    "Cells at the edge hold few samples, and are noisy.",
    "where": "How much of the error of the nominal model a missing force that depends on this alone would remove. The "
    "shares overlap, so they do not add up.",
    "shape": "The force that the nominal model lacks, without any formula: {shape}. Its straight "
    "line is taken off where a nominal parameter is one: stiffness, damping or the drive's gain follow it.",
    "loops": "Deflection that switches per mA, while heating and while cooling, and what the loops leave of the "
    "staircases that they were identified from. A narrow peak is a domain that switches as one: cells spread over all "
    "of the range smear it.",
    "candidates": "The error that each candidate leaves, fitted to the same records together with all nominal "
    "parameters. {blue}",
    "isolability": "How alike the traces are that two effects leave in these data: |cos| of the angle between them, 0 "
    "of traces that have nothing in common, 1 of traces that are equal (above 0.9 written as percent). Where it is "
    "near 1 no method tells them apart. Visible is the part of a trace that the nominal parameters cannot take up: an "
    "effect with little of it hides behind them. The names are those of the catalogue of mechanisms.",
}


def report_page(diagnosis: Diagnosis, dataset: Dataset, provenance: Mapping[str, Any], how: str = "") -> str:
    """Return the whole page as HTML; `how` says how the next experiment is played."""
    shown = list(enumerate(_drawn_pictures(diagnosis), start=1))

    def drawn(section: str) -> str:
        return "".join(
            _numbered_figure(diagnosis, one, number) for number, one in shown if one.section == section
        )

    parts = [
        f'<p class="dim small">rtctl diagnose · {escape(dataset.name)} · model {escape(str(provenance["model"]))}</p>',
        f"<h1>{describe_verdict(diagnosis)}</h1>",
        '<section class="summary">', describe_kind_doubt(diagnosis), describe_causes(diagnosis),
        tabulate_gain(diagnosis), tabulate_causes(diagnosis), describe_what_to_do(diagnosis, how),
        describe_notes(diagnosis), "</section>",
        '<h2 class="part">Evidence</h2>',
        "<h3>Measured against simulated</h3>", drawn("stretch"), drawn("others"), drawn("spectrum"), drawn("plane"),
        "<h3>What the error goes with</h3>", describe_place(diagnosis), drawn("where"), drawn("shape"), drawn("loops"),
        "<h3>Whether anything is left</h3>", tabulate_tests(diagnosis),
        '<h2 class="part">The model</h2>', tabulate_parameters(diagnosis), tabulate_derived(diagnosis),
        '<h2 class="part">Method</h2>', describe_work(diagnosis),
        "<h3>What was tried</h3>", tabulate_candidates(diagnosis), drawn("candidates"),
        *((f"<h3>What these data can tell apart</h3>{apart}",) if (apart := drawn("isolability")) else ()),
        tabulate_menu(diagnosis),
        "<h3>What was read</h3>", tabulate_data(dataset),
        tabulate_provenance(provenance),
    ]  # fmt: skip
    return page(f"Diagnosis of {dataset.name}", [part for part in parts if part], "diagnose")


def _drawn_pictures(diagnosis: Diagnosis) -> list[Picture]:
    """Return the page's pictures; none where matplotlib is not installed."""
    if not can_draw():
        return []
    from rtctl.diagnosis.report.pictures import pictures

    return pictures(diagnosis)


def _numbered_figure(diagnosis: Diagnosis, picture: Picture, number: int) -> str:
    whose = (
        "a test record, which took no part in any fit"
        if diagnosis.tests
        else "a record of the fit: none is a test"
    )
    shape = ""
    if diagnosis.shape is not None:
        shape = f"it would remove {diagnosis.shape.share:.0%} of the error beyond the noise"
    start = ", which is fitted, as a first sample is noisy" if diagnosis.fits.before.hypothesis.states else ""
    output = diagnosis.problem.subject.output
    passes = (
        "passes all residual tests above"
        if diagnosis.search.passes
        else "fails some of the residual tests above"
    )
    blue = (
        f"Blue: the causes that are claimed, or what explains as much; the set {passes}."
        if diagnosis.causes
        else ""
    )
    each = "each piece of a record (at the grey lines)" if _is_cut(diagnosis) else "each record"
    caption = CAPTIONS[picture.section].format(
        whose=whose, shape=shape, start=start, output=output, blue=blue, each=each
    )
    return figure(picture.data_uri(), picture.alternative, caption, number)


def _is_cut(diagnosis: Diagnosis) -> bool:
    """Return whether the records that are drawn were cut into pieces, each simulated from its own start."""
    names = [one.name for one in diagnosis.tests or diagnosis.problem.records]
    return len(set(names)) < len(names)
