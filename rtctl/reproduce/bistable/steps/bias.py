"""Bias of the filter: known truths, known noise, the paper's filter and the weak form side by side."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes

from rtctl.identification.regression.streaming_gram import compute_filtered_gram, compute_weak_gram
from rtctl.plots.elements.style import BLACK, BLUE, VERMILION
from rtctl.plots.reproduce_bistable import draw
from rtctl.reproduce.bistable.collected import HALF_WIDTH_S, collected
from rtctl.reproduce.bistable.models import HM, RM5, TRUTH, Beam
from rtctl.reproduce.bistable.protocol import DEVELOPMENT_SEED, RATE_HZ, SEED, Recorded, record, shaker
from rtctl.reproduce.bistable.regression import QUINTIC, least_squares
from rtctl.reproduce.bistable.steps.local_fit import kept
from rtctl.reproduce.study import Comparison, Picture, Row, Run, Section, Table

TRUTHS = {"ours": TRUTH, "the paper's RM5": RM5, "cubic (HM with damping 0.9)": HM._replace(damping=0.9)}
NOISES_MM = (0.0, 4e-3, 2e-2, 1e-1)
NEIGHBOURS = (0, 2, 5, 8, 10, 13, 16)
METHODS = ("filter before each derivative", "filter once", "weak form")


def bias(run: Run) -> Section:
    """Compare each method with the known truth, which the paper does not have."""
    found = collected(run)
    chosen = kept(found)
    records = {name: _records(run, truth) for name, truth in TRUTHS.items()}
    quintics = {
        (name, method, noise): _quintic(records[name], method, noise)
        for name in TRUTHS for method in METHODS for noise in NOISES_MM
    }  # fmt: skip
    _draw(run, {name: records[name] for name in list(TRUTHS)[1:]})
    table = tuple(
        (name, f"{TRUTHS[name].quintic:.4g}", method, *(f"{quintics[name, method, noise]:.4g}" for noise in NOISES_MM))
        for name in TRUTHS for method in METHODS
    )  # fmt: skip
    by_filter = least_squares(found.filtered[chosen].sum(axis=0), QUINTIC).beam
    by_bumps = least_squares(found.weak[chosen].sum(axis=0), QUINTIC).beam
    everything = least_squares(found.filtered.sum(axis=0), QUINTIC).beam
    rm5, cubic = (100.0 * quintics[name, METHODS[0], 0.0] / RM5.quintic for name in list(TRUTHS)[1:])
    rows = (
        *_errors("the paper's filter, records kept", by_filter),
        *_errors("the paper's filter, all records", everything),
        *_errors("weak form, records kept", by_bumps),
        Row(quantity="quintic that the filter finds on RM5's truth, no noise", unit="% of it", paper=None, ours=rm5),
        Row(quantity="quintic that it invents on a cubic truth, no noise", unit="% of RM5's", paper=None, ours=cubic),
        Row(quantity="quintic that the weak form finds on RM5's truth, 100 um of noise", unit="% of it", paper=None,
            ours=100.0 * quintics["the paper's RM5", "weak form", 1e-1] / RM5.quintic),
    )  # fmt: skip
    return Section(
        title="What the filter does to the answer",
        text="A mean over 21 samples is a low-pass that takes 0.1 % off the drive's frequency and ten times "
        "as much off the "
        "third harmonic, where the higher terms live; before each derivative, as the paper words it, the acceleration "
        "passes it twice and the displacement once. Least squares takes the difference for a force. So the "
        "sign and size "
        "of a quintic term of RM5's order are not a finding of the beam but, in part, of the filter: the paper's own γ "
        "changes sign between RM5 and RM5c. The weak form moves the derivatives to a known bump (half-width 25 ms, "
        "order 8), and what noise adds is its only error.",
        parts=(
            Comparison(title="Error of our campaign's parameters against the truth", rows=rows),
            Table(title="The quintic coefficient found, by noise on the displacement [1/(mm⁴ s²)]",
                  headers=("truth", "its quintic", "method", *(f"{1000.0 * noise:g} µm" for noise in NOISES_MM)),
                  rows=table, numbers=(1, 3, 4, 5, 6),
                  text="45 frequencies, one record of 10 s each, no second mode."),
            Picture(file="bias-filter.png", alt="Quintic coefficient over the filter's length for two truths",
                    caption="The quintic that is found over the filter's length, without noise, on two truths (lines); "
                    "the paper's filter has ten neighbours on each side."),
        ),
    )  # fmt: skip


def _errors(name: str, found: Beam) -> Iterable[Row]:
    """Return the errors in per cent of the truth."""
    for term, own, true in zip(("damping", "linear", "cubic", "quintic"), found, TRUTH, strict=True):
        yield Row(quantity=f"{name}: {term} off by", unit="%", paper=None, ours=100.0 * (own / true - 1.0))


def _records(run: Run, truth: Beam) -> list[Recorded]:
    """Return one run a frequency, with their clean displacements."""
    campaign = shaker(short=run.short, seed=(DEVELOPMENT_SEED if run.short else SEED) + 1)
    campaign = campaign._replace(record_s=4.0 if run.short else 10.0, truth=truth)
    first = [one._replace(second_mode=False) for one in campaign.settings if one.run == 0]
    return [record(campaign, one) for one in first]


def _quintic(records: list[Recorded], method: str, noise_mm: float) -> float:
    gram = np.zeros((11, 11))
    for one in records:
        rng = np.random.default_rng([one.setting.number, 77])
        z = one.clean + noise_mm * rng.standard_normal(len(one.clean))
        if method == METHODS[2]:
            gram += compute_weak_gram(z, one.frame_velocity, 1.0 / RATE_HZ, HALF_WIDTH_S)
        else:
            gram += compute_filtered_gram(z, one.frame_velocity, 1.0 / RATE_HZ, each=method == METHODS[0])
    return least_squares(gram, QUINTIC).beam.quintic


def _draw(run: Run, records: dict[str, list[Recorded]]) -> None:
    def fill(axes: list[Axes]) -> None:
        for (name, own), axis in zip(records.items(), axes, strict=True):
            for each, color in ((True, VERMILION), (False, BLUE)):
                found = []
                for neighbours in NEIGHBOURS:
                    gram = np.zeros((11, 11))
                    for one in own:
                        h = 1.0 / RATE_HZ
                        gram += compute_filtered_gram(one.clean, one.frame_velocity, h, neighbours, each=each)
                    found.append(least_squares(gram, QUINTIC).beam.quintic)
                words = METHODS[0] if each else METHODS[1]
                axis.plot(2 * np.array(NEIGHBOURS) + 1, found, "o-", color=color, markersize=3.5, label=words)
            axis.axhline(TRUTHS[name].quintic, color=BLACK, label="truth")
            axis.set_title(f"truth: {name}")
            axis.set_xlabel("samples in the mean")
            axis.set_ylabel("quintic found [1/(mm⁴ s²)]")
        axes[0].legend()

    draw(run.pictures / "bias-filter.png", (9.0, 3.4), (1, 2), fill)
