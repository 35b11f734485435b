"""`report.html`: a diagnosis as for a design review, on one self-contained page."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any

from rtctl.diagnosis.report.sections import (
    describe_place,
    describe_proposal,
    describe_verdict,
    format_unit,
    tabulate_candidates,
    tabulate_causes,
    tabulate_data,
    tabulate_parameters,
    tabulate_provenance,
    tabulate_tests,
)
from rtctl.diagnosis.result import Diagnosis
from rtctl.extras import can_draw
from rtctl.measured.dataset import Dataset
from rtctl.output.html_page import figure, page, tile

if TYPE_CHECKING:
    from rtctl.diagnosis.report.pictures import Picture

CAPTIONS = {
    "stretch": "Free runs from each record's start{start}, no measured output "
    "fed in. Errors within the grey band are noise; {whose}.",
    "others": "The same of the other reading, in the record where today's model is worst at it.",
    "spectrum": "Where the error stands above the grey line, something is missing that a model could know.",
    "plane": "Mean error of all records that are compared, over {output} and its rate. A "
    "pattern (a sign that changes with velocity, a corner, a ring) is structure; a right model leaves none.",
    "where": "How much of the error of today's model a force along this coordinate alone would remove. Coordinates "
    "overlap, so the shares do not add up.",
    "shape": "The force that today's model lacks, without any formula: {shape}. Its straight "
    "line is taken off where a nominal parameter is one: stiffness, damping or the drive's gain follow it.",
    "loops": "Deflection that switches per mA, while heating and while cooling, and what the loops leave of the "
    "staircases that they were identified from. A narrow peak is a domain that switches as one: cells spread over all "
    "of the range smear it.",
    "candidates": "The error that each candidate leaves, fitted to the same records together with all nominal "
    "parameters. {blue}",
    "isolability": "Before any name: |cos| between the traces that two effects leave in these data (above 0.9 in "
    "percent). Where it is near 1 no method tells them apart; an effect with little that is visible hides behind the "
    "nominal parameters.",
}


def report_page(diagnosis: Diagnosis, dataset: Dataset, provenance: Mapping[str, Any]) -> str:
    """Return the whole page as HTML."""
    shown = list(enumerate(_drawn_pictures(diagnosis), start=1))

    def drawn(section: str) -> str:
        return "".join(
            _numbered_figure(diagnosis, one, number) for number, one in shown if one.section == section
        )

    parts = [
        f'<p class="dim small">rtctl diagnose · {escape(dataset.name)} · model {escape(str(provenance["model"]))}</p>',
        f'<h1>{describe_verdict(diagnosis)}</h1>',
        *(f'<p class="lead">{escape(cause.statement)}</p>' for cause in diagnosis.causes),
        *(f'<div class="note">{escape(warning)}</div>' for warning in _notes(diagnosis)),
        _tiles(diagnosis),
        tabulate_causes(diagnosis),
        "<h2>Measured against simulated</h2>", drawn("stretch"), drawn("others"), drawn("spectrum"), drawn("plane"),
        "<h2>Where the error lives</h2>", describe_place(diagnosis), drawn("where"),
        drawn("shape"), drawn("loops"),
        "<h2>What was tried</h2>", tabulate_candidates(diagnosis), drawn("candidates"), tabulate_tests(diagnosis),
        "<h2>What these data can tell apart</h2>", drawn("isolability"),
        describe_proposal(diagnosis),
        tabulate_parameters(diagnosis),
        tabulate_data(dataset),
        tabulate_provenance(provenance),
    ]  # fmt: skip
    return page(f"Diagnosis of {dataset.name}", [part for part in parts if part])


def _notes(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Return the warnings, and why causes that are named give no extended model."""
    return diagnosis.warnings + ((diagnosis.withheld,) if diagnosis.causes and diagnosis.withheld else ())


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
    start = (
        " (two fitted numbers: a first sample is noisy)" if diagnosis.fits.before.hypothesis.states else ""
    )
    output = diagnosis.problem.subject.output
    passes = (
        "passes all residual tests below"
        if diagnosis.search.passes
        else "fails some of the residual tests below"
    )
    blue = (
        f"Blue: the causes that are claimed, or what explains as much; the set {passes}."
        if diagnosis.causes
        else ""
    )
    caption = CAPTIONS[picture.section].format(
        whose=whose, shape=shape, start=start, output=output, blue=blue
    )
    return figure(picture.data_uri(), picture.alternative, caption, number)


def _tiles(diagnosis: Diagnosis) -> str:
    gain = diagnosis.gain
    made = []
    if gain is not None:
        made = [
            tile(
                f"{gain.before:.3g} {format_unit(gain.unit)}",
                "RMS error of today's model on test records, re-fitted",
            )
        ]
        if diagnosis.causes:
            made += [
                tile(f"{gain.after:.3g} {format_unit(gain.unit)}", "with the extended model"),
                tile(
                    f"{gain.ratio:.3g}×",
                    f"less error; 95 % between {gain.ratio_low:.3g} and {gain.ratio_high:.3g}",
                ),
            ]
    if diagnosis.loop is not None:
        loop = diagnosis.loop
        text = f"{loop.before:.3g} → {loop.after:.3g} {format_unit(loop.unit)}"
        made.append(tile(text, f"in the loop, without and with the causes: {escape(loop.scenario)}"))
    made.append(
        tile(
            f"{diagnosis.noise_rms:.3g} {format_unit(diagnosis.units[diagnosis.problem.subject.output])}",
            "noise of the reading, as estimated"
            + (
                " with what is not explained"
                if diagnosis.verdict in ("unexplained", "partly_explained")
                else ""
            ),
        )
    )
    if diagnosis.causes:
        first = diagnosis.causes[0]
        others = f"; {escape(', '.join(first.indistinguishable_from))} would explain it as well"
        made.append(
            tile(
                f"{first.share_removed:.0%}" if first.probability is None else f"{first.probability:.1%}",
                f"{'of the error removed by' if first.probability is None else 'probability of'} "
                f"{escape(first.id)}{others if first.indistinguishable_from else ''}",
            )
        )
    return '<div class="tiles">' + "".join(made) + "</div>"
