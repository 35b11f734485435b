"""One model for all records: RM5, RM5c, their R^2 (figures 10, 14) and restoring forces (figures 13, 15)."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from rtctl.plots.reproduce_bistable import Cloud, draw, forces, over_frequency
from rtctl.reproduce.bistable.collected import Collected, collected
from rtctl.reproduce.bistable.models import HM, RM5, RM5C, TRUTH, heuristic
from rtctl.reproduce.bistable.regression import (
    QUINTIC,
    Fit,
    constrained,
    determination,
    least_squares,
    of_beam,
)
from rtctl.reproduce.bistable.steps.local_fit import kept
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section


def global_models(found: Collected) -> dict[str, Fit]:
    """Fit HM, RM5, RM5c by the paper's filter, and the quintic by the weak form, to the records that are kept."""
    chosen = kept(found)
    gram = found.filtered[chosen].sum(axis=0)
    return {
        "HM": of_beam(HM),
        "RM5": least_squares(gram, QUINTIC),
        "RM5c": constrained(gram, HM.well_mm),
        "weak form": least_squares(found.weak[chosen].sum(axis=0), QUINTIC),
        "truth": of_beam(TRUTH),
    }


# long because it writes one section of the report in the order of its page
def globally(run: Run) -> Section:
    """Return the section on the paper's sections 3.5 and 3.6."""
    found = collected(run)
    models, chosen = global_models(found), kept(found)
    gram = found.filtered[chosen].sum(axis=0)
    each = {
        name: np.array([determination(one, fit) for one in found.filtered]) for name, fit in models.items()
    }
    frequency, inter = found.frequency_hz, found.interwell

    def clouds(first: str, second: str) -> list[Cloud]:
        return [Cloud(name, frequency[chosen], each[name][chosen], inter[chosen]) for name in (first, second)]

    def figures_10_14(axes: list[Axes]) -> None:
        for one, pair in zip(axes, (("HM", "RM5"), ("RM5", "RM5c")), strict=True):
            over_frequency(one, clouds(*pair), "R² of the acceleration")
            one.legend(fontsize=7, loc="lower right")

    def figures_13_15(axes: list[Axes]) -> None:
        z = np.linspace(0.0, 15.0, 301)
        curves = {name: fit.beam.force(z) for name, fit in models.items()}
        forces(
            axes[0],
            {name: curves[name] for name in ("truth", "HM", "RM5", "RM5c", "weak form")},
            z,
            HM.well_mm,
        )
        off = {name: curve - curves["truth"] for name, curve in curves.items() if name != "truth"}
        forces(axes[1], off, z, HM.well_mm)
        axes[1].set_ylabel("restoring force less the truth's [m/s²]")
        axes[1].set_ylim(-2.0, 2.0)

    draw(run.pictures / "fig10-fig14-determination.png", (9.0, 3.4), (1, 2), figures_10_14)
    draw(run.pictures / "fig13-fig15-forces.png", (9.0, 3.4), (1, 2), figures_13_15)
    rows = [
        Row(quantity="records kept", unit="", paper=427, ours=int(chosen.sum())),
        Row(
            quantity="R² of HM, all kept records",
            unit="",
            paper=0.942,
            ours=determination(gram, models["HM"]),
        ),
        Row(quantity="R² of RM5", unit="", paper=0.955, ours=determination(gram, models["RM5"])),
        Row(quantity="R² of RM5c", unit="", paper=0.9448, ours=determination(gram, models["RM5c"])),
        Row(quantity="R² of the truth", unit="", paper=None, ours=determination(gram, models["truth"])),
    ]
    by_wells = heuristic(TRUTH.well_mm, TRUTH.well_hz, HM.damping)
    for name, theirs, own in zip(("damping", "linear", "cubic"), HM[:3], by_wells[:3], strict=True):
        note = (
            "its decay is taken from the paper"
            if name == "damping"
            else "by equation (2) from the truth's wells"
        )
        rows.append(Row(quantity=f"HM, {name}", unit="", paper=theirs, ours=own, note=note))
    units = ("1/s", "1/s²", "1/(mm² s²)", "1/(mm⁴ s²)")
    for name, paper in (("RM5", RM5), ("RM5c", RM5C)):
        for term, unit, theirs, own, true in zip(
            ("damping", "linear", "cubic", "quintic"), units, paper, models[name].beam, TRUTH, strict=True
        ):
            rows.append(
                Row(quantity=f"{name}, {term}", unit=unit, paper=theirs, ours=own, note=f"truth {true:.4g}")
            )  # fmt: skip
    wells = {name: fit.beam.well_mm for name, fit in models.items()}
    return Section(
        title="Global models: RM5 and RM5c",
        text="The quintic by the paper's filter from all records that its threshold keeps, without and with the wells "
        "fixed at their measured place. Our figures differ from the paper's because our beam has nothing wrong beside "
        "the second mode; the order is what can be compared. Wells [mm]: "
        + ", ".join(f"{name} {value:.4g}" for name, value in wells.items()) + ".",
        parts=(
            Comparison(title="R² and parameters", rows=tuple(rows)),
            Picture(file="fig10-fig14-determination.png", alt="R squared over frequency of HM, RM5 and RM5c",
                    caption="As figures 10 and 14: R² a record of HM and RM5, of RM5 and RM5c."),
            Picture(file="fig13-fig15-forces.png", alt="Restoring forces of five models and their differences",
                    caption="As figures 13 and 15: restoring forces, and on the right what they are off by, which no "
                    "measurement can show."),
        ),
    )  # fmt: skip
