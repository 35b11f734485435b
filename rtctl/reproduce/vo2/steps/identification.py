"""Figures 8 to 10, tables I and II: the models identified, on the paper's data alone and on ours, and their errors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.units.quantities import parse_quantity, read_toml
from rtctl.identification.vo2.staircase import extract_steady_states
from rtctl.models.vo2 import Vo2Model
from rtctl.plots.elements.small_png import save_small_png
from rtctl.plots.identification import identification_figure
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table
from rtctl.reproduce.vo2 import paper
from rtctl.reproduce.vo2.bench import devices, in_parallel, model_of, seeds, spread
from rtctl.reproduce.vo2.models import Models, Protocol, data_of, models, to_the_letter
from rtctl.reproduce.vo2.steps.equation_11 import inverse_error
from rtctl.reproduce.vo2.steps.excitation import SteadyLoops, estimated
from rtctl.wiring import find_plant

PROTOCOLS: tuple[Protocol, ...] = ("damped", "full")
COLUMNS = ("composite to the letter", "composite", "gap_free", "preisach", "egpi", "observer")


class FitError(NamedTuple):
    """Error on the identification data [um]."""

    mean: float
    largest: float
    range_um: float

    @classmethod
    def of(cls, error: FloatArray, range_um: float) -> FitError:
        """Return the figures of an error (n,) [um]."""
        return cls(float(np.abs(error).mean()), float(np.abs(error).max()), range_um)

    @property
    def mean_percent(self) -> float:
        """Mean error in percent of the range."""
        return 100.0 * self.mean / self.range_um

    @property
    def largest_percent(self) -> float:
        """Largest error in percent of the range."""
        return 100.0 * self.largest / self.range_um


class Fitted(NamedTuple):
    """A model's file beside its dataset, and the part of that on which it was identified."""

    model: Path
    protocol: Protocol


Found = dict[tuple[str, Protocol], list[dict[str, FitError]]]
"""Errors by (device, protocol), an entry an identification."""


def compute(run: Run) -> Section:
    """Return the section."""
    paths = {protocol: models(run, protocol) for protocol in PROTOCOLS}
    jobs = [Fitted(path, protocol) for protocol in PROTOCOLS for path in paths[protocol].values()]
    errors = dict(zip(jobs, in_parallel(run, fit_errors, jobs), strict=True))
    found: Found = {
        (device, protocol): [errors[Fitted(paths[protocol][device, seed], protocol)] for seed in seeds(run)]
        for device in devices(run)
        for protocol in PROTOCOLS
    }
    first = paths["damped"]["vo2_a", seeds(run)[0]]
    model = model_of(first)
    return Section(
        title="Identification (figures 8 to 10, tables I and II)",
        text=(
            "Six plays, ten Preisach levels, as in the paper. `damped`: on the paper's damped oscillation alone; "
            "`full`: also on reversal curves and a random staircase, what `rtctl identify` gets and every later "
            f"section uses unless it says otherwise. {len(seeds(run))} recordings a device, which differ in noise "
            "alone, each identified by itself: the spread is of the recordings and of the search among many minima."
            "\n\n"
            "The composite to the letter (both halves fitted to the current) is several times worse here than in "
            "the paper: a GPI with one pair of envelopes has no reversible part, these films have, and the second "
            "half passes on what the first gets wrong. Fitted to what the first half gives, it is below the paper's "
            "error. That the composite beats both direct models is not reproduced: " + _order(found)
        ),
        parts=(
            _beside(found["vo2_a", "damped"], model),
            _all(found),
            _gpi_table(model),
            _egpi_table(model),
            _heating(run, paths["full"]),
            _inverse(),
            drawn(run, first),
        ),
    )


def _order(found: Found) -> str:
    """Return on how many devices the composite's mean error is below each direct model's."""
    damped = [fits for (_, protocol), fits in found.items() if protocol == "damped"]
    ahead = {
        kind: sum(mean_of(fits, "composite") < mean_of(fits, kind) for fits in damped)
        for kind in ("preisach", "egpi")
    }
    return (
        f"on the damped oscillation its mean error is below Preisach's on {ahead['preisach']} and below the EGPI's on "
        f"{ahead['egpi']} of {len(damped)} devices."
    )


def mean_of(fits: list[dict[str, FitError]], name: str) -> float:
    """Return the mean absolute error [um] of all identifications."""
    return float(np.mean([errors[name].mean for errors in fits]))


def fit_errors(job: Fitted) -> dict[str, FitError]:
    """Return the error of each estimator, run over the identification data as in a loop, and of the direct EGPI."""
    model = model_of(job.model)
    errors: dict[str, list[FloatArray]] = {name: [] for name in (*COLUMNS, "deflection_egpi")}
    for loops in staircases(job.model.parent, job.protocol):
        for name, output in outputs(model, loops).items():
            errors[name].append(output - loops.deflection_um)
    return {
        name: FitError.of(np.concatenate(parts), model.deflection.width) for name, parts in errors.items()
    }


def staircases(folder: Path, protocol: Protocol) -> list[SteadyLoops]:
    """Return the steady states of each staircase used in the identification."""
    dataset = data_of(folder, protocol)
    found = []
    for record in dataset.used_for("identify"):
        ends = extract_steady_states(replace(dataset, records=(record,)))
        kept = ends.scored
        found.append(SteadyLoops(ends.current_mA[kept], ends.resistance_ohm[kept], ends.deflection_um[kept]))
    return found


def outputs(model: Vo2Model, loops: SteadyLoops) -> dict[str, FloatArray]:
    """Return the deflection by every estimator, and by the EGPI on the current."""
    found = {name: estimated(model, name, loops) for name in COLUMNS[1:]}
    found[COLUMNS[0]] = estimated(to_the_letter(model), "composite", loops)
    found["deflection_egpi"] = model.deflection_egpi.simulate(loops.current_mA)
    return found


def _beside(fits: list[dict[str, FitError]], model: Vo2Model) -> Comparison:
    def rows(what: str, ours: str, theirs: str) -> tuple[Row, Row]:
        given, largest = paper.FIT[theirs], max(errors[ours].largest for errors in fits)
        return (
            Row(quantity=f"{what}, mean", unit="um", paper=given.mean_um, ours=mean_of(fits, ours)),
            Row(quantity=f"{what}, largest", unit="um", paper=given.max_um, ours=largest),
        )

    gpi = model.quality["resistance_gpi"]
    lost = "the paper's figure is lost in the transcription"
    return Comparison(
        title="Errors on the fitted data: device A, damped oscillation, beside the paper",
        rows=(
            Row(
                quantity="GPI, current to R, mean (figure 8a)",
                unit="ohm",
                paper=None,
                ours=1e3 * gpi.mean_abs,
                note=lost,
            ),
            Row(
                quantity="GPI, current to R, largest",
                unit="ohm",
                paper=None,
                ours=1e3 * gpi.max_abs,
                note=lost,
            ),
            *rows("EGPI, current to D (figure 8b)", "deflection_egpi", "deflection_egpi"),
            *rows("composite to the letter (figure 9)", COLUMNS[0], "composite"),
            *rows("composite, second half behind the first", "composite", "composite"),
            *rows("Preisach, R to D, 10 levels (figure 10a)", "preisach", "preisach"),
            *rows("EGPI, R to D (figure 10b)", "egpi", "egpi"),
        ),
    )


def _all(found: Found) -> Table:
    return Table(
        title="The same on all devices: mean (least and largest of the identifications) / largest of all [% of range]",
        headers=("device", "identified on", *COLUMNS),
        rows=(
            ("paper", "damped", *(_paper_text(name) for name in COLUMNS)),
            *(
                (device, protocol, *(_text(fits, name) for name in COLUMNS))
                for (device, protocol), fits in found.items()
            ),
        ),
        numbers=tuple(range(2, 2 + len(COLUMNS))),
    )


def _text(fits: list[dict[str, FitError]], name: str) -> str:
    mean = spread([errors[name].mean_percent for errors in fits])
    return f"{mean} / {max(errors[name].largest_percent for errors in fits):.1f}"


def _paper_text(name: str) -> str:
    given = paper.FIT.get("composite" if name == COLUMNS[0] else name if name != "composite" else "")
    return "–" if given is None else f"{given.mean_percent:.2f} / {given.max_percent:.1f}"


def _gpi_table(model: Vo2Model) -> Table:
    gpi = model.resistance_gpi
    theirs, ours = np.array(paper.GPI_WEIGHTS), np.asarray(gpi.p)
    return Table(
        title="Table I: weights of the GPI, current to -R, in parts of their sum",
        headers=("", *(f"r = {k}/6" for k in range(6))),
        rows=(
            ("paper", *(f"{value:.3f}" for value in theirs / theirs.sum())),
            ("device A", *(f"{value:.3f}" for value in ours / ours.sum())),
        ),
        text=(
            f"Ours sum to {ours.sum():.1f} kohm about a bias of {gpi.c:.1f} kohm; heating envelope tanh(({gpi.a_R:.3f} "
            f"v - {-gpi.b_R:.2f})), centre {-gpi.b_R / gpi.a_R:.2f} mA, cooling tanh(({gpi.a_L:.3f} v - "
            f"{-gpi.b_L:.2f})), centre {-gpi.b_L / gpi.a_L:.2f} mA. The paper's unit, bias and envelopes are lost."
        ),
        numbers=tuple(range(1, 7)),
    )


def _egpi_table(model: Vo2Model) -> Table:
    egpi = model.deflection_egpi

    def centre(pair: tuple[float | None, float]) -> str:
        return "–" if pair[0] is None else f"{1e3 * pair[1] / pair[0]:.2f}"

    return Table(
        title="Table II: the EGPI, current to D: weight [um], centres of the envelopes -b/a [mA]",
        headers=("", *(f"r = {k}/6" for k in range(6))),
        rows=(
            ("paper, weight", *(f"{value:.2f}" for value in paper.EGPI_WEIGHTS)),
            ("device A, weight", *(f"{value:.2f}" for value in egpi.p)),
            ("paper, heating", *(centre(pair) for pair in paper.EGPI_HEATING)),
            ("device A, heating", *(f"{-b / a:.2f}" for a, b in zip(egpi.a_R, egpi.b_R, strict=True))),
            ("paper, cooling", *(centre(pair) for pair in paper.EGPI_COOLING)),
            ("device A, cooling", *(f"{-b / a:.2f}" for a, b in zip(egpi.a_L, egpi.b_L, strict=True))),
        ),
        text=(
            "Different sets of plays make the same hysteresis, so these are not to agree play by play. The paper's "
            "13.73 and 14.21 mA lie far outside its currents of 3.68 to 8.49 mA: such an envelope is nearly flat there."
        ),
        numbers=tuple(range(1, 7)),
    )


def _heating(run: Run, paths: Models) -> Table:
    rows = []
    for device in devices(run):
        given = parse_quantity(read_toml(find_plant(device, Path()))["heating"]["time_constant"], "s")
        fits = [model_of(paths[device, seed]) for seed in seeds(run)]
        values = spread([1e3 * fit.time_constant_s for fit in fits], 4)
        rows.append((device, values, f"{1e3 * fits[0].time_constant_error_s:.4f}", f"{1e3 * given:.4f}"))
    return Table(
        title="Time constant of the heating [ms]; the paper identifies 1.8 ms on its device",
        headers=("device", "identified", "standard error of one", "of the simulated device"),
        rows=tuple(rows),
        numbers=(1, 2, 3),
    )


def _inverse() -> Comparison:
    return Comparison(
        title="Equation (11) on the weights of table I: largest |u - inverse(model(u))|, in parts of the range of u",
        rows=(
            Row(quantity="as printed", unit="", paper=None, ours=inverse_error(paper.GPI_WEIGHTS, 1.0)),
            Row(quantity="with the minus that the transcription lost", unit="", paper=None,
                ours=inverse_error(paper.GPI_WEIGHTS, -1.0), note="rounding"),
        ),
    )  # fmt: skip


def drawn(run: Run, path: Path) -> Picture:
    """Draw figures 8 to 10 of device A."""
    model, loops = model_of(path), staircases(path.parent, "damped")[0]
    found = outputs(model, loops)
    gpi = -1e3 * model.resistance_gpi.simulate(loops.current_mA)
    figure = identification_figure(
        *loops,
        {
            "GPI and EGPI on the current": (gpi, found["deflection_egpi"]),
            "composite to the letter": (None, found[COLUMNS[0]]),
            "composite": (None, found["composite"]),
            "preisach": (None, found["preisach"]),
            "egpi": (None, found["egpi"]),
        },
        title="Device A",
    )
    save_small_png(figure, run.pictures / "fig08-10-fits.png")
    return Picture(
        file="fig08-10-fits.png",
        caption="Figures 8 to 10, device A: measured loops, the models' and what each leaves.",
        alt="Loops of resistance and deflection of device A under those of each model, and the models' errors",
    )
