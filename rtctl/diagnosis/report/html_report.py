"""`report.html`: a diagnosis as one would show it at a design review, on one page that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any

from rtctl.diagnosis.report.sections import (
    candidates,
    causes,
    parameters,
    place,
    proposal,
    provenance_section,
    questions,
    readable,
    verdict_sentence,
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
    "parameters. Blue: passes all questions below.",
    "isolability": "Before any name: |cos| between the traces that two effects leave in these data (above 0.9 in "
    "percent). Where it is near 1 no method tells them apart; an effect with little that is visible hides behind the "
    "nominal parameters.",
}


def report_page(found: Diagnosis, dataset: Dataset, provenance: Mapping[str, Any]) -> str:
    """The whole page."""
    shown = list(enumerate(_drawn_pictures(found), start=1))

    def drawn(section: str) -> str:
        return "".join(_figure(found, one, number) for number, one in shown if one.section == section)

    parts = [
        f'<p class="dim small">rtctl diagnose · {escape(dataset.name)} · model {escape(str(provenance["model"]))}</p>',
        f'<h1>{verdict_sentence(found)}</h1>',
        *(f'<p class="lead">{escape(cause.statement)}</p>' for cause in found.causes),
        *(f'<div class="note">{escape(warning)}</div>' for warning in found.warnings),
        _tiles(found),
        causes(found),
        "<h2>Measured against simulated</h2>", drawn("stretch"), drawn("others"), drawn("spectrum"), drawn("plane"),
        "<h2>Where the error lives</h2>", place(found), drawn("where"),
        drawn("shape"), drawn("loops"),
        "<h2>What was tried</h2>", candidates(found), drawn("candidates"), questions(found),
        "<h2>What these data can tell apart</h2>", drawn("isolability"),
        proposal(found),
        parameters(found),
        provenance_section(provenance),
    ]  # fmt: skip
    return page(f"Diagnosis of {dataset.name}", [part for part in parts if part])


def _drawn_pictures(found: Diagnosis) -> list[Picture]:
    """Return the page's pictures; none where matplotlib is not installed."""
    if not can_draw():
        return []
    from rtctl.diagnosis.report.pictures import pictures

    return pictures(found)


def _figure(found: Diagnosis, picture: Picture, number: int) -> str:
    whose = (
        "a test record, which took no part in any fit"
        if found.tests
        else "a record of the fit: none is a test"
    )
    shape = ""
    if found.shape is not None:
        shape = f"it would remove {found.shape.share:.0%} of the error beyond the noise"
    start = " (two fitted numbers: a first sample is noisy)" if found.fits.before.hypothesis.states else ""
    output = found.problem.subject.output
    caption = CAPTIONS[picture.section].format(whose=whose, shape=shape, start=start, output=output)
    return figure(picture.data_uri(), picture.alternative, caption, number)


def _tiles(found: Diagnosis) -> str:
    gain = found.gain
    made = []
    if gain is not None:
        made = [
            tile(
                f"{gain.before:.3g} {readable(gain.unit)}",
                "RMS error of today's model on test records, re-fitted",
            )
        ]
        if found.causes:
            made += [
                tile(f"{gain.after:.3g} {readable(gain.unit)}", "with the extended model"),
                tile(
                    f"{gain.ratio:.3g}×",
                    f"less error; 95 % between {gain.ratio_low:.3g} and {gain.ratio_high:.3g}",
                ),
            ]
    made.append(
        tile(
            f"{found.noise_rms:.3g} {readable(found.units[found.problem.subject.output])}",
            "noise of the reading, as estimated"
            + (" with what is not explained" if found.verdict in ("unexplained", "partly_explained") else ""),
        )
    )
    if found.causes:
        first = found.causes[0]
        others = f"; {escape(', '.join(first.indistinguishable_from))} would explain it as well"
        made.append(
            tile(
                f"{first.probability:.1%}",
                f"probability of {escape(first.id)}{others if first.indistinguishable_from else ''}",
            )
        )
    return '<div class="tiles">' + "".join(made) + "</div>"
