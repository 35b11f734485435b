"""The campaign: what was recorded, which kinds of motion, and the filtered and unfiltered signals of figure 3."""

from __future__ import annotations

from collections import Counter

import numpy as np
from matplotlib.axes import Axes

from rtctl.orbits.classes import Kind
from rtctl.plots.elements.style import BLACK, GREY
from rtctl.plots.reproduce_bistable import draw
from rtctl.reproduce.bistable.collected import Collected, collected
from rtctl.reproduce.bistable.models import HM, RM5, RM5C, TRUTH
from rtctl.reproduce.bistable.protocol import RATE_HZ, record
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table


def campaign(run: Run) -> Section:
    """Return the section on the paper's sections 2.2 and 2.3: the records and the models' wells."""
    found = collected(run)
    _figure_3(run, found)
    count = len(found.kinds)
    chaos = found.frequency_hz[[kind is Kind.CHAOTIC for kind in found.kinds]]
    lasting = found.frequency_hz[
        [
            kind is Kind.CHAOTIC and period == 0
            for kind, period in zip(found.kinds, found.periods, strict=True)
        ]
    ]
    rows = (
        Row(quantity="records", unit="", paper=450, ours=count),
        Row(quantity="records with a second mode", unit="", paper=23, ours=int(found.second_mode.sum()),
            note="the paper's are those that it drops; ours were given it"),
        Row(quantity="least frequency of chaos", unit="Hz", paper=11.75, ours=_or_none(chaos.min(initial=np.inf))),
        Row(quantity="largest frequency of chaos", unit="Hz", paper=14.5, ours=_or_none(chaos.max(initial=-np.inf))),
        Row(quantity="the same, no period in the second half of the record", unit="Hz", paper=None,
            ours=_or_none(lasting.min(initial=np.inf)), note="10 s unrecorded are not enough: the rest is transient"),
        Row(quantity="and largest", unit="Hz", paper=None, ours=_or_none(lasting.max(initial=-np.inf))),
        Row(quantity="wells of HM", unit="mm", paper=6.97, ours=HM.well_mm, note="the paper's measured distance"),
        Row(quantity="free oscillations of HM", unit="Hz", paper=14.75, ours=HM.well_hz),
        Row(quantity="wells of RM5", unit="mm", paper=None, ours=RM5.well_mm,
            note=f"and no bound beyond {RM5.guard_mm:.0f} mm, which the paper does not say"),
        Row(quantity="free oscillations of RM5", unit="Hz", paper=None, ours=RM5.well_hz),
        Row(quantity="wells of RM5c", unit="mm", paper=6.97, ours=RM5C.well_mm),
        Row(quantity="free oscillations of RM5c", unit="Hz", paper=None, ours=RM5C.well_hz),
        Row(quantity="wells of the truth", unit="mm", paper=6.97, ours=TRUTH.well_mm),
        Row(quantity="free oscillations of the truth", unit="Hz", paper=14.75, ours=TRUTH.well_hz),
    )  # fmt: skip
    kinds = Counter(str(kind) for kind in found.kinds)
    truth = ", ".join(f"{value:.5g}" for value in TRUTH)
    return Section(
        title="The shaker campaign",
        text=f"{count} records of {found.campaign.record_s:g} s at 10 kHz after 10 s unrecorded, seed "
        f"{found.campaign.seed}; everything was developed on another seed. The truth is the quintic with the wells "
        "and the frequency of the paper's HM and the force of its RM5 at 12.5 mm (damping, linear, cubic, quintic: "
        f"{truth}).\n\n"
        "By the paper's rule the records are "
        + ", ".join(f"{number} {kind}" for kind, number in kinds.most_common())
        + f". By stroboscopic points {int((found.periods > 0).sum())} repeat in their second half, "
        f"{int(((found.periods > 0) & (found.early_periods == 0)).sum())} of these not yet in their first.",
        parts=(
            Comparison(title="Records and wells", rows=rows),
            _kinds_table(found),
            Picture(file="fig03-signals.png", alt="Displacement and acceleration over time, filtered and not",
                    caption="As figure 3: a mean over 21 samples leaves the displacement as it is and makes an "
                    "acceleration of noise readable."),
        ),
    )  # fmt: skip


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _kinds_table(found: Collected) -> Table:
    """Return the frequencies at which each kind occurs."""
    rows = []
    for kind in dict.fromkeys(found.kinds):
        at = found.frequency_hz[[own is kind for own in found.kinds]]
        rows.append((str(kind), str(len(at)), f"{at.min():g} to {at.max():g}"))
    return Table(title="Kinds of motion by the paper's rule", headers=("kind", "records", "frequencies [Hz]"),
                 rows=tuple(sorted(rows)), numbers=(1,))  # fmt: skip


def _figure_3(run: Run, found: Collected) -> None:
    from rtctl.identification.regression.mean_filter import apply_mean_filter

    settings = found.campaign.settings
    chosen = next(k for k, one in enumerate(settings) if one.frequency_hz == 10.25 and found.interwell[k])
    one = record(found.campaign, settings[chosen])
    span = slice(0, round(0.2 * RATE_HZ))
    raw = one.displacement[span.start : span.stop + 24]
    smooth = apply_mean_filter(raw)
    t = 1000.0 * np.arange(span.stop) / RATE_HZ
    acceleration = (raw[2:] - 2.0 * raw[1:-1] + raw[:-2]) * RATE_HZ**2 / 1000.0
    filtered = (smooth[4:] - 2.0 * smooth[2:-2] + smooth[:-4]) * 0.25 * RATE_HZ**2 / 1000.0

    def fill(axes: list[Axes]) -> None:
        axes[0].plot(t, raw[: len(t)], color=GREY, label="as recorded")
        axes[0].plot(t[10 : 10 + len(smooth)], smooth[: len(t) - 10], color=BLACK, label="filtered")
        axes[0].set_ylabel("displacement [mm]")
        axes[1].plot(t[1:], acceleration[: len(t) - 1], color=GREY, linewidth=0.3)
        axes[1].plot(t[12:], filtered[: len(t) - 12], color=BLACK)
        axes[1].set_ylabel("acceleration [m/s²]")
        axes[0].legend()
        for one_of in axes:
            one_of.set_xlabel("time [ms]")

    draw(run.pictures / "fig03-signals.png", (8.0, 3.0), (1, 2), fill)
