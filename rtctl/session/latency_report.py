"""The report of `rtctl latency`: a table, text histograms, JSON, and the period that this machine and wire hold."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from rtctl.session.latency import LARGEST_MISSED_SHARE, LARGEST_SHARE_OF_PERIOD, Ladder, Rung
from rtctl.timing.histogram import Histogram

BAR = 48


def verdict(ladder: Ladder) -> str:
    """Return a sentence: the period that is held, by what margin, and what limits the next one."""
    held = ladder.held
    who = f"{ladder.kind} ({ladder.where})"
    if held is None:
        slowest = ladder.rungs[0]
        return f"{who} does not hold {_period(slowest.period_s)}: {_why(slowest)}."
    next_ones = [rung for rung in ladder.rungs if rung.period_s < held.period_s]
    limit = f"; {_period(next_ones[0].period_s)} is not held: {_why(next_ones[0])}" if next_ones else ""
    return (
        f"{who} holds {_period(held.period_s)}: {held.timing.overruns} of {held.periods} periods missed, "
        f"{held.busy_us:.0f} us of {1e6 * held.period_s:.0f} us used at the 99th percentile{limit}."
    )


def conclusion(ladders: Sequence[Ladder]) -> str:
    """Return the last sentence: the period to choose."""
    held = [(ladder, ladder.held) for ladder in ladders]
    parts = [
        f"{_period(rung.period_s)} over {ladder.kind}" if rung else f"no period tried over {ladder.kind}"
        for ladder, rung in held
    ]
    return f"This machine and wire hold {', '.join(parts)} (as loaded as they were while this was measured)."


def _why(rung: Rung) -> str:
    if rung.fault is not None:
        return f"{rung.fault}, {rung.message}"
    share = rung.timing.overruns / max(rung.periods, 1)
    if share > LARGEST_MISSED_SHARE:
        return (
            f"{100 * share:.2g} % of its periods were missed, at most {100 * LARGEST_MISSED_SHARE:g} % may be"
        )
    most = LARGEST_SHARE_OF_PERIOD * 1e6 * rung.period_s
    return f"{rung.busy_us:.0f} us are used at the 99th percentile, at most {most:.0f} us may be"


def rows(ladder: Ladder) -> list[list[str]]:
    """Return one row per period: missed, lateness, round trip, compute [us]."""
    table = []
    for rung in ladder.rungs:
        timing = rung.timing
        table.append([
            ladder.kind, _period(rung.period_s), f"{timing.overruns} / {rung.periods}",
            *(_quantiles(part) for part in (timing.lateness, timing.round_trip, timing.compute)),
            "yes" if rung.holds else "no",
        ])  # fmt: skip
    return table


HEADERS = ["driver", "period", "missed", "late p50 / p99 / p99.9", "round trip", "compute", "holds"]


def text_histogram(title: str, histogram: Histogram) -> Iterator[str]:
    """Yield bars between 1, 2, 5, 10 ... us, as long as the root of the counts, so that a single one can be seen."""
    decades = histogram.decades_us()
    yield f"{title} [us], {histogram.count} steps"
    most = max(decades["count"], default=1.0)
    for edge, count in zip(decades["at_most"], decades["count"], strict=True):
        bar = "#" * max(round(BAR * (count / most) ** 0.5), 1 if count else 0)
        yield f"  <= {edge:>9g} {int(count):>9} {bar}".rstrip()


def document(ladders: Sequence[Ladder], reference: Histogram | None) -> dict[str, Any]:
    """Return the whole measurement for JSON."""
    return {
        "conclusion": conclusion(ladders),
        "drivers": [
            {
                "driver": ladder.kind,
                "where": ladder.where,
                "holds_period_s": None if ladder.held is None else ladder.held.period_s,
                "verdict": verdict(ladder),
                "periods": [_rung(rung) for rung in ladder.rungs],
            }
            for ladder in ladders
        ],
        "cyclictest": None
        if reference is None
        else {"lateness_us": reference.summary_us(), "histogram_us": reference.decades_us()},
    }


def _rung(rung: Rung) -> dict[str, Any]:
    return {
        **rung.timing.summary(rung.period_s),
        "holds": rung.holds,
        "used_p99_us": rung.busy_us,
        "fault": None if rung.fault is None else str(rung.fault),
        "requests": [request._asdict() for request in rung.requests],
    }


def _quantiles(histogram: Histogram) -> str:
    summary = histogram.summary_us()
    return f"{summary['p50']:.1f} / {summary['p99']:.1f} / {summary['p99_9']:.1f}"


def _period(period_s: float) -> str:
    return f"{1e3 * period_s:g} ms ({1.0 / period_s:g} Hz)"
