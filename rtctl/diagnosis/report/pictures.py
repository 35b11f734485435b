"""The pictures of a diagnosis: which record, which numbers; how they look is `rtctl.plots`'."""

from __future__ import annotations

import base64
import io
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.report.ranking import ranking_of
from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.search.holdout_error import simulate_free_run
from rtctl.identification.fit_record import FitRecord
from rtctl.plots.diagnosis import BeforeAfter, plane_figure, spectrum_figure, stretch_figure
from rtctl.plots.diagnosis_ranking import (
    candidates_figure,
    coordinates_figure,
    isolability_figure,
    shape_figure,
)
from rtctl.plots.elements.style import house_style

MOST_CANDIDATES = 12
PAGE_DOTS_PER_INCH = 110
NOISE_BINS = 1024


class Picture(NamedTuple):
    """A figure of the page, by the section that it is in."""

    section: str
    figure: Figure
    alternative: str
    """What it shows, for who does not see it."""

    def data_uri(self) -> str:
        """As a page carries it inside."""
        with house_style():
            buffer = io.BytesIO()
            self.figure.savefig(buffer, format="png", dpi=PAGE_DOTS_PER_INCH)
        return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def pictures(found: Diagnosis) -> list[Picture]:
    """All that there is something to show of."""
    made = _of_the_motion(found)
    if found.where:
        figure = coordinates_figure([p.coordinate for p in found.where], [p.share for p in found.where])
        made.append(Picture("where", figure, "share of the error along each coordinate"))
    if found.shape is not None:
        shape = found.shape
        figure = shape_figure(
            shape.coordinate, shape.unit, shape.knots, shape.force, shape.error, shape.force_unit
        )
        made.append(Picture("shape", figure, f"missing force against {shape.coordinate}"))
    if found.search.hysteresis_refit is not None and "deflection" in found.search.hysteresis_refit.coarse:
        made.append(Picture("loops", _loops(found), "where relays switch, and what the loops leave"))
    if found.search.rankings:
        made.append(Picture("candidates", _candidates(found), "error that each candidate leaves"))
    if len(found.isolability.ids) > 1:
        found_at = found.isolability
        figure = isolability_figure(found_at.ids, found_at.visible, found_at.cosine)
        made.append(Picture("isolability", figure, "which effects these data can tell apart"))
    return made


def before_after(found: Diagnosis) -> list[BeforeAfter]:
    """Free runs over the test records, the worst first; over the fitted ones where none is a test."""
    return _before_after(found, found.problem.subject.output)


def _before_after(found: Diagnosis, output: str) -> list[BeforeAfter]:
    before, after = found.fits.before.hypothesis.simulation, found.fits.after.hypothesis.simulation
    records = [one for one in found.tests or found.problem.records if output in one.measured]
    made = [_one(record, before, after, found, output) for record in records]
    return sorted(made, key=lambda one: -float(np.mean(one.errors[0] ** 2)))


def _one(
    record: FitRecord, before: Simulation, after: Simulation, found: Diagnosis, output: str
) -> BeforeAfter:
    old, new = simulate_free_run(before, record, output), simulate_free_run(after, record, output)
    after_it = new.outputs[output][0]
    velocity = (
        new.outputs["velocity"][0] if "velocity" in new.outputs else np.gradient(after_it, record.period_s)
    )
    scored = slice(record.first, None)
    return BeforeAfter(
        record=record.name, output=output, unit=found.units[output], rate=found.problem.scales.rate,
        time_s=record.period_s * np.arange(record.samples, dtype=np.float64)[scored],
        measured=record.measured[output][scored],
        before=old.outputs[output][0][scored], after=after_it[scored], velocity=velocity[scored],
    )  # fmt: skip


def _of_the_motion(found: Diagnosis) -> list[Picture]:
    records, extended = before_after(found), bool(found.causes)
    shown = records[0]
    period_s = float(shown.time_s[1] - shown.time_s[0])
    frequency, density = noise_density(found, period_s)
    return [
        Picture(
            "stretch", stretch_figure(shown, found.noise_rms, extended=extended), "measured and simulated"
        ),
        *_of_other_outputs(found),
        Picture("spectrum", spectrum_figure(shown, frequency, density, extended=extended), "error spectra"),
        Picture(
            "plane", plane_figure(records, extended=extended), f"error over {records[0].output} and its rate"
        ),
    ]


def _of_other_outputs(found: Diagnosis) -> list[Picture]:
    """Of each the record where it is worst: what a cause of the sensor does is seen in its own reading."""
    noises = dict(
        zip(found.search.chosen.hypothesis.sensitivity.outputs, found.search.chosen.noise, strict=True)
    )
    made = []
    for output, noise in noises.items():
        shown = _before_after(found, output) if output != found.problem.subject.output else []
        if shown:
            sigma = float(np.sqrt(noise.mean_square))
            figure = stretch_figure(shown[0], sigma, extended=bool(found.causes))
            made.append(Picture("others", figure, f"measured and simulated {output.replace('_', ' ')}"))
    return made


def noise_density(found: Diagnosis, period_s: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies [Hz] and amplitude density [unit / sqrt(Hz)] of the noise of the output that is shown."""
    chosen = found.search.chosen
    output = chosen.hypothesis.sensitivity.outputs.index(found.problem.subject.output)
    density = np.sqrt(2.0 * chosen.noise[output].for_period(period_s).power(2 * NOISE_BINS) * period_s)
    return np.linspace(0.0, 0.5 / period_s, len(density)), density


def _loops(found: Diagnosis) -> Figure:
    """Return the figure of the identified loops beside the refitted ones."""
    refit, draw = found.search.hysteresis_refit, found.problem.subject.coarse_figure
    assert refit is not None
    assert draw is not None
    figure: Figure = draw(refit.coarse, refit.loops, found.units)
    return figure


def _candidates(found: Diagnosis) -> Figure:
    """Of the size that was chosen, or of the last one tried."""
    ranking = sorted(ranking_of(found), key=lambda one: one[1].cost)[:MOST_CANDIDATES]
    scale = _error_scale(found)
    chosen = {frozenset(found.search.chosen.hypothesis.mechanisms)} if found.causes else set()
    chosen |= {frozenset(other.mechanisms) for other in found.search.equivalent}
    return candidates_figure(
        [label for label, _ in ranking],
        [float(np.sqrt(2.0 * one.cost)) * scale for _, one in ranking],
        [frozenset(one.mechanisms) in chosen for _, one in ranking],
        float(np.sqrt(2.0 * found.search.nominal.hypothesis.cost)) * scale,
        found.noise_rms,
        found.units[found.problem.subject.output],
    )


def _error_scale(found: Diagnosis) -> float:
    """[unit] of a fit's residual of RMS 1 / sqrt(samples): costs are in squares over the signal's."""
    outputs = found.search.nominal.hypothesis.sensitivity.outputs
    samples = len(outputs) * sum(record.samples - record.first for record in found.problem.records)
    return found.problem.size(found.problem.subject.output) / float(np.sqrt(samples))
