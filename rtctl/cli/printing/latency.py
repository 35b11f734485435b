"""Latencies as a person reads them in a terminal: tables, histograms and what they mean."""

from __future__ import annotations

from pathlib import Path

from rtctl.api.machines import Latency, name_of
from rtctl.output.tables import print_table
from rtctl.session.latency_report import HEADERS, conclusion, rows, text_histogram, verdict


def print_latency(latency: Latency, folder: Path) -> None:
    """Print one row for each driver and period, histograms at the shortest period held, and the conclusion."""
    print_table("times in us", HEADERS, [row for ladder in latency.ladders for row in rows(ladder)])
    for ladder, rung in latency.shown:
        name, timing = name_of(ladder, rung), rung.timing
        for title, histogram in (("lateness", timing.lateness), ("round trip", timing.round_trip)):
            print("\n".join(text_histogram(f"{name}: {title}", histogram)))
        for request in rung.requests:
            if not request.applied:
                print(f"{name}: {request.describe()}")
    if latency.reference is not None:
        title = f"cyclictest, {1e3 * latency.fastest_s:g} ms: lateness"
        print("\n".join(text_histogram(title, latency.reference)))
    else:
        print("cyclictest is not installed here (Debian package rt-tests): nothing to compare with")
    for ladder in latency.ladders:
        print(verdict(ladder))
    print(f"results in {folder}")
    print(conclusion(latency.ladders))
