"""Phase portraits and the turning-point diagram: records beside the models' orbits (figures 4, 7, 8, 11, 12)."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from rtctl.border.arrays import FloatArray
from rtctl.orbits.turning_points import different
from rtctl.plots.elements.lines import ABOVE
from rtctl.plots.elements.style import BLACK
from rtctl.plots.reproduce_bistable import COLORS, draw, portrait
from rtctl.reproduce.bistable.collected import Collected, collected
from rtctl.reproduce.bistable.models import HM, Beam
from rtctl.reproduce.bistable.regression import CUBIC, least_squares
from rtctl.reproduce.bistable.steps.global_fit import global_models
from rtctl.reproduce.bistable.swept import Orbit, nearest_orbit, orbits_at, swept
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section

FEWER_TURNS = 10
"""Turning points of the diagram, as in the paper: motions with more are left out."""


def portraits(run: Run) -> Section:
    """Return the section on figures 4, 7, 8, 11 and 12."""
    found = collected(run)
    models = {name: fit.beam for name, fit in global_models(found).items() if name != "truth"}
    shown = [(7.5, "HM"), (11.0, "HM"), (7.5, "RM5"), (11.0, "RM5"), (8.25, "RM5"), (13.75, "RM5")]
    if run.short:
        shown = [(8.25, "HM"), (10.25, "RM5")]
    _figure_4_12(run, found, models, shown)
    local_rows = _figure_7_8(run, found)
    off = _figure_11(run, found, models)
    rows = [
        Row(quantity=f"{name}: median error of turning points, {where}", unit="mm", paper=None, ours=value)
        for (name, where), value in off.items()
    ] + local_rows  # fmt: skip
    return Section(
        title="Phase portraits and turning points",
        text="Beside each record stands the model's orbit that is nearest by the paper's equation (4). HM is "
        "right in the "
        "wells, where it was measured, and too stiff outside: its orbits through both wells are too small. As in the "
        "paper the regressions are right there. The paper compares by eye; the errors of the turning points are given "
        "here, of all records whose motion repeats with fewer than ten of them and has a counterpart in the model.",
        parts=(
            Comparison(title="Turning points against the records'", rows=tuple(rows)),
            Picture(file="fig04-fig12-portraits.png", alt="Phase portraits of records and models at six settings",
                    caption="As figures 4 and 12: a record in one well and one through both (black) and the "
                    "nearest orbits."),
            Picture(file="fig07-fig08-local.png", alt="Phase portraits and a time series of local models",
                    caption="As figures 7 and 8: local cubic models at 8.25 Hz; from a record through both wells, its "
                    "phase portrait and the time series on the drive's time; from a record in one well, what it makes "
                    "of the other orbit."),
            Picture(file="fig11-turning-points.png", alt="Turning points over frequency of records, HM and RM5",
                    caption="As figure 11: turning points of records (black), HM and RM5."),
        ),
    )  # fmt: skip


def _example(found: Collected, frequency_hz: float, *, interwell: bool) -> int | None:
    """Return a record of this kind that repeats."""
    match = (found.frequency_hz == frequency_hz) & (found.ends_through == interwell) & (found.periods > 0)
    chosen = np.flatnonzero(match & ~found.second_mode)
    return int(chosen[0]) if len(chosen) else None


def _nearest(beam: Beam, found: Collected, k: int, short: bool) -> Orbit | None:
    z, v = found.tail[k]
    at = float(found.frequency_hz[k])
    return nearest_orbit(orbits_at(swept(beam, short), at, interwell=bool(found.ends_through[k])), z, v)


def _figure_4_12(run: Run, found: Collected, models: dict[str, Beam], shown: list[tuple[float, str]]) -> None:
    def fill(axes: list[Axes]) -> None:
        for axis, (at, name) in zip(axes, shown, strict=True):
            curves: list[tuple[str, FloatArray, FloatArray]] = []
            for interwell in (False, True):
                k = _example(found, at, interwell=interwell)
                if k is None:
                    continue
                z, v = found.tail[k]
                curves.append(("record", z[:600], v[:600]))
                orbit = _nearest(models[name], found, k, run.short)
                if orbit is not None:
                    curves.append((name, orbit.displacement, orbit.velocity))
            portrait(axis, curves, f"{at:g} Hz, {name}")

    shape = (1, 2) if run.short else (2, 3)
    draw(run.pictures / "fig04-fig12-portraits.png", (9.0, 2.9 * shape[0]), shape, fill)


def _figure_7_8(run: Run, found: Collected) -> list[Row]:
    """Draw local models at 8.25 Hz; return the error of the other orbit's largest displacement."""
    at = 8.25
    inside, through = (_example(found, at, interwell=kind) for kind in (False, True))
    local = {
        k: least_squares(found.filtered[k], CUBIC).beam for k in (inside, through) if k is not None
    }  # fmt: skip
    rows: list[Row] = []

    def fill(axes: list[Axes]) -> None:
        if through is None:
            return
        z, v = found.tail[through]
        same = {
            "HM": _nearest(HM, found, through, run.short),
            "local RM": _nearest(local[through], found, through, run.short),
        }
        curves = [(name, one.displacement, one.velocity) for name, one in same.items() if one is not None]
        portrait(axes[0], [("record", z[:600], v[:600]), *curves], f"{at:g} Hz, from both wells")
        t = (found.phase[through] / (2.0 * np.pi * at) + np.arange(len(z)) / 1000.0) % (1.0 / at)
        order = np.argsort(t)
        axes[1].plot(1000.0 * t[order], z[order], ".", color=BLACK, markersize=2.0)
        for name, one in same.items():
            if one is not None:
                axes[1].plot(1000.0 * one.time_s, one.displacement, color=COLORS[name])
                rows.append(
                    Row(quantity=f"{name} at {at:g} Hz: largest displacement off by", unit="%", paper=None,
                        ours=100.0 * float(one.displacement.max() / z.max() - 1.0))
                )  # fmt: skip
        axes[1].set_xlim(0.0, 1000.0 / at)
        axes[1].set_xlabel("time after the drive's crest [ms]")
        axes[1].set_ylabel("displacement [mm]")
        axes[2].set_visible(inside is not None)
        if inside is not None:
            other = _nearest(local[inside], found, through, run.short)
            curves = [] if other is None else [("local RM", other.displacement, other.velocity)]
            portrait(axes[2], [("record", z[:600], v[:600]), *curves], f"{at:g} Hz, from one well")
            if other is not None:
                rows.append(
                    Row(quantity=f"local RM from one well at {at:g} Hz: largest displacement through both off by",
                        unit="%", paper=None, ours=100.0 * float(other.displacement.max() / z.max() - 1.0))
                )  # fmt: skip

    draw(run.pictures / "fig07-fig08-local.png", (9.0, 3.0), (1, 3), fill)
    return rows


def _figure_11(run: Run, found: Collected, models: dict[str, Beam]) -> dict[tuple[str, str], float]:
    """Draw the diagram; return the median error of the extreme turning points by model and place."""
    chosen = [
        k for k in np.flatnonzero((found.periods > 0) & ~found.second_mode).tolist()
        if different(_last(found, k)) < FEWER_TURNS
    ]  # fmt: skip
    nearest = {
        name: {k: _nearest(beam, found, k, run.short) for k in chosen} for name, beam in models.items()
    }

    def fill(axes: list[Axes]) -> None:
        for k in chosen:
            points = _last(found, k)
            axes[0].plot(
                np.full(len(points), found.frequency_hz[k]), points, "o", color=BLACK, markersize=3.0,
                label="record" if k == chosen[0] else "_again",
            )  # fmt: skip
        for name, shift in (("HM", -0.06), ("RM5", 0.06)):
            drawn = [(k, orbit) for k, orbit in nearest[name].items() if orbit is not None]
            for number, (k, orbit) in enumerate(drawn):
                at = np.full(len(orbit.points), found.frequency_hz[k] + shift)
                axes[0].plot(at, orbit.points, "o", color=COLORS[name], markersize=1.8,
                             label="_again" if number else name)  # fmt: skip
        axes[0].set_xlabel("excitation frequency [Hz]")
        axes[0].set_ylabel("turning points [mm]")
        axes[0].legend(**ABOVE)

    draw(run.pictures / "fig11-turning-points.png", (7.2, 4.0), (1, 1), fill)
    result = {}
    for name, orbits in nearest.items():
        for where, interwell in (("one well", False), ("both wells", True)):
            errors = [
                error
                for k, orbit in orbits.items()
                if orbit is not None and bool(found.ends_through[k]) == interwell
                for points in (_last(found, k),)
                for error in (orbit.points.max() - points.max(), orbit.points.min() - points.min())
            ]
            if errors:
                result[name, where] = float(np.median(np.abs(errors)))
    return result


def _last(found: Collected, k: int) -> FloatArray:
    """Return the turning points of the last fifth of a record, where its transient is over."""
    points = found.points[k]
    return points[-max(2, len(points) // 5) :]
