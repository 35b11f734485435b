"""The figures of a report: which records and numbers they show; `rtctl.plots` draws them."""

from __future__ import annotations

import base64
import io
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.report.ranking import ranking_of
from rtctl.diagnosis.report.rounding import rounded
from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.search.holdout_error import simulate_free_run
from rtctl.diagnosis.thresholds import ReportThresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.measured.dataset import FREQUENCY, paired
from rtctl.plots.diagnosis import plane_figure, spectrum_figure, stretch_figure
from rtctl.plots.diagnosis_ranking import (
    candidates_figure,
    coordinates_figure,
    isolability_figure,
    shape_figure,
)
from rtctl.plots.elements.before_after import BeforeAfter, join_pieces
from rtctl.plots.elements.style import BLUE, VERMILION, house_style
from rtctl.plots.frequency.sweep import compared_curves, sweep_figure


class Picture(NamedTuple):
    """A figure of the page, with the section that it belongs to."""

    section: str
    figure: Figure
    alternative: str
    """Text alternative of the figure."""

    def data_uri(self) -> str:
        """Return the figure as a data URI."""
        with house_style():
            buffer = io.BytesIO()
            self.figure.savefig(buffer, format="png", dpi=ReportThresholds().dots_per_inch)
        return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def pictures(diagnosis: Diagnosis) -> list[Picture]:
    """All that there is something to show of."""
    made = _of_the_motion(diagnosis)
    if diagnosis.where:
        figure = coordinates_figure(
            [p.coordinate for p in diagnosis.where], [p.share for p in diagnosis.where]
        )
        made.append(Picture("where", figure, "share of the error along each coordinate"))
    if diagnosis.shape is not None:
        shape = diagnosis.shape
        figure = shape_figure(
            shape.coordinate, shape.unit, shape.knots, shape.force, shape.error, shape.force_unit
        )
        made.append(Picture("shape", figure, f"missing force against {shape.coordinate}"))
    if (
        diagnosis.search.hysteresis_refit is not None
        and "deflection" in diagnosis.search.hysteresis_refit.coarse
    ):
        made.append(Picture("loops", _loops(diagnosis), "where relays switch, and what the loops leave"))
    if diagnosis.search.rankings:
        made.append(Picture("candidates", _candidates(diagnosis), "error that each candidate leaves"))
    if len(diagnosis.isolability.ids) > 1:
        isolable = diagnosis.isolability
        figure = isolability_figure(isolable.ids, isolable.visible, isolable.cosine)
        made.append(Picture("isolability", figure, "which effects these data can tell apart"))
    return made


def before_after(diagnosis: Diagnosis) -> list[BeforeAfter]:
    """Return free runs over the test records, the worst first; over the fit records where none is a test."""
    return _before_after(diagnosis, diagnosis.problem.subject.output)


def _before_after(diagnosis: Diagnosis, output: str) -> list[BeforeAfter]:
    before, after = diagnosis.fits.before.hypothesis.simulation, diagnosis.fits.after.hypothesis.simulation
    records = [one for one in diagnosis.tests or diagnosis.problem.records if output in one.measured]
    pieces: dict[str, list[BeforeAfter]] = {}
    for record in records:  # of a record that was cut, several have its name
        pieces.setdefault(record.name, []).append(_one(record, before, after, diagnosis, output))
    made = [join_pieces(one) for one in pieces.values()]
    return sorted(made, key=lambda one: -float(np.mean(one.errors[0] ** 2)))


def _one(
    record: FitRecord, before: Simulation, after: Simulation, diagnosis: Diagnosis, output: str
) -> BeforeAfter:
    old, new = simulate_free_run(before, record, output), simulate_free_run(after, record, output)
    after_it = new.outputs[output][0]
    known = output == "displacement" and "velocity" in new.outputs  # of another output it is not the rate
    rate_of_it = new.outputs["velocity"][0] if known else np.gradient(after_it, record.period_s)
    scored = slice(record.first, None)
    return BeforeAfter(
        record=record.name, output=output, unit=diagnosis.units[output], rate=diagnosis.problem.scales.rate,
        time_s=record.period_s * (record.begin + np.arange(record.samples, dtype=np.float64))[scored],
        measured=record.measured[output][scored],
        before=old.outputs[output][0][scored], after=rounded(diagnosis, output, after_it)[scored],
        output_rate=rate_of_it[scored],
    )  # fmt: skip


def _of_the_motion(diagnosis: Diagnosis) -> list[Picture]:
    if diagnosis.problem.subject.is_steady:
        return [Picture("stretch", _sweep(diagnosis), "amplitude and phase, measured and simulated")]
    records, extended = before_after(diagnosis), bool(diagnosis.causes)
    shown = records[0]
    frequency, density = noise_density(diagnosis, shown.period_s)
    return [
        Picture(
            "stretch", stretch_figure(shown, diagnosis.noise_rms, extended=extended), "measured and simulated"
        ),
        *_of_other_outputs(diagnosis),
        Picture("spectrum", spectrum_figure(shown, frequency, density, extended=extended), "error spectra"),
        Picture(
            "plane", plane_figure(records, extended=extended), f"error over {records[0].output} and its rate"
        ),
    ]


def _sweep(diagnosis: Diagnosis) -> Figure:
    """Return the figure of the sweep in which the nominal model is worst."""
    shown = before_after(diagnosis)[0]
    records = {one.name: one for one in diagnosis.tests or diagnosis.problem.records}
    frequency_hz = records[shown.record].stimulus.inputs[FREQUENCY][::2]
    simulated = [("nominal model", VERMILION, paired(shown.before))]
    simulated += [("the extended model", BLUE, paired(shown.after))] if diagnosis.causes else []
    curves = compared_curves(frequency_hz, paired(shown.measured), simulated)
    title = f"record {shown.record}, where the nominal model is worst"
    return sweep_figure(title, "", shown.output, shown.unit, curves, diagnosis.noise_rms)


def _of_other_outputs(diagnosis: Diagnosis) -> list[Picture]:
    """Return the other outputs, each in its worst record: a cause in a sensor shows in its own reading alone."""
    noises = dict(
        zip(
            diagnosis.search.chosen.hypothesis.sensitivity.outputs, diagnosis.search.chosen.noise, strict=True
        )
    )
    made = []
    for output, noise in noises.items():
        shown = _before_after(diagnosis, output) if output != diagnosis.problem.subject.output else []
        if shown:
            sigma = float(np.sqrt(noise.mean_square))
            figure = stretch_figure(shown[0], sigma, extended=bool(diagnosis.causes))
            made.append(Picture("others", figure, f"measured and simulated {output.replace('_', ' ')}"))
    return made


def noise_density(diagnosis: Diagnosis, period_s: float) -> tuple[FloatArray, FloatArray]:
    """Return frequencies [Hz] and amplitude density [unit / sqrt(Hz)] of the noise of the output that is shown."""
    chosen = diagnosis.search.chosen
    output = chosen.hypothesis.sensitivity.outputs.index(diagnosis.problem.subject.output)
    bins = 2 * diagnosis.problem.thresholds.report.noise_bins
    density = np.sqrt(2.0 * chosen.noise[output].for_period(period_s).power(bins) * period_s)
    return np.linspace(0.0, 0.5 / period_s, len(density)), density


def _loops(diagnosis: Diagnosis) -> Figure:
    """Return the figure of the identified loops beside the refitted ones."""
    refit, draw = diagnosis.search.hysteresis_refit, diagnosis.problem.subject.coarse_part_figure
    assert refit is not None
    assert draw is not None
    figure: Figure = draw(refit.coarse, refit.loops, diagnosis.units)
    return figure


def _candidates(diagnosis: Diagnosis) -> Figure:
    """Return the figure of the candidates of the chosen size, or of the last size tried."""
    count = diagnosis.problem.thresholds.report.max_candidates_shown
    ranking = [(label, one.hypothesis) for label, one in ranking_of(diagnosis)[:count]]
    scale = _error_scale(diagnosis)
    chosen = {frozenset(diagnosis.search.chosen.hypothesis.mechanisms)} if diagnosis.causes else set()
    chosen |= {frozenset(other.mechanisms) for other in diagnosis.search.equivalent}
    return candidates_figure(
        [label for label, _ in ranking],
        [float(np.sqrt(2.0 * one.cost)) * scale for _, one in ranking],
        [frozenset(one.mechanisms) in chosen for _, one in ranking],
        float(np.sqrt(2.0 * diagnosis.search.nominal.hypothesis.cost)) * scale,
        diagnosis.noise_rms,
        diagnosis.units[diagnosis.problem.subject.output],
    )


def _error_scale(diagnosis: Diagnosis) -> float:
    """Return the factor from sqrt(2 cost) of a fit to the RMS residual, in the output's unit."""
    outputs = diagnosis.search.nominal.hypothesis.sensitivity.outputs
    samples = len(outputs) * sum(record.samples - record.first for record in diagnosis.problem.records)
    return diagnosis.problem.size(diagnosis.problem.subject.output) / float(np.sqrt(samples))
