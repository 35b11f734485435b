"""Measure which period this machine and a wire hold: lateness, round trip, compute; text, latency.json, latency.png."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rtctl.session.latency import Ladder, Rung
    from rtctl.timing.histogram import Histogram


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `rtctl latency`."""
    parser.add_argument(
        "--driver", action="append", default=[], metavar="KIND",
        help="inprocess, modbus-tcp, modbus-rtu, serial; repeat for several (default: all)",
    )  # fmt: skip
    parser.add_argument(
        "--period", action="append", default=[], metavar="TIME",
        help='such as "1 ms"; repeat for several (default: 10 ms down to 0.1 ms)',
    )  # fmt: skip
    parser.add_argument("--duration", default="2 s", metavar="TIME", help="of each period (default: 2 s)")
    parser.add_argument("--priority", type=int, help="SCHED_FIFO priority, 1 to 99, if permitted")
    parser.add_argument("--cpu", type=int, help="the only CPU of the loop")
    parser.add_argument(
        "--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE",
        help="a key of [driver] or [clock], such as --set driver.address=10.0.0.7:502 for a device of your own "
        "(it is commanded its safe level only)",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, help="folder of latency.json and latency.png")


def run(args: argparse.Namespace) -> int:
    """The verb. Returns 0: some period is held by every driver; 1: not so."""
    from rtctl.border.errors import InputError, nearest
    from rtctl.border.quantities import parse_quantity
    from rtctl.cli.options import output_folder
    from rtctl.evaluation.metrics import write_json
    from rtctl.output.interrupt import stop_on_interrupt
    from rtctl.output.progress import say
    from rtctl.plots.latency import Curve, plot_latency
    from rtctl.scenario.schema import overridden
    from rtctl.session.latency import PERIODS_S, cyclictest, known_kinds, measure
    from rtctl.session.latency_report import document

    folder = output_folder(args.out)
    quiet = args.quiet or args.json
    kinds = args.driver or known_kinds()
    for kind in kinds:
        if kind not in known_kinds():
            raise InputError(f'--driver: "{kind}" cannot be measured{nearest(kind, known_kinds())}')
    try:
        periods_s = [parse_quantity(text, "s") for text in args.period] or list(PERIODS_S)
        duration_s = parse_quantity(args.duration, "s")
    except ValueError as error:
        raise InputError(f"--period, --duration: {error}") from None
    if not (duration_s > 0.0 and all(period_s > 0.0 for period_s in periods_s)):
        raise InputError("--period and --duration must be > 0 s")
    asked = {"priority": args.priority, "cpu": args.cpu, "lock_memory": args.priority is not None}
    clock = {key: value for key, value in asked.items() if value is not None}
    tables = overridden({"clock": clock}, args.overrides)
    ladders = []
    with stop_on_interrupt() as stop_requested:
        for kind in kinds:
            ladders.append(
                measure(
                    kind, tables, periods_s, duration_s, stop_requested, lambda text: say(text, quiet=quiet)
                )
            )
    shown = [(ladder, ladder.held or ladder.rungs[0]) for ladder in ladders]
    fastest_s = min(rung.period_s for _, rung in shown)
    reference = cyclictest(fastest_s, duration_s, args.priority)
    found = document(ladders, reference)
    write_json(folder / "latency.json", found)
    curves = [(_name(ladder, rung), rung.timing) for ladder, rung in shown]
    plot_latency(
        folder / "latency.png",
        [Curve(name, timing.lateness) for name, timing in curves],
        [Curve(name, timing.round_trip) for name, timing in curves],
        reference,
        "How late the loop wakes up and how long an exchange lasts",
    )
    if args.json:
        print(json.dumps(json.loads((folder / "latency.json").read_text(encoding="utf-8")), indent=2))
    elif not args.quiet:
        _print(ladders, shown, reference, fastest_s, folder)
    return 0 if all(ladder.held is not None for ladder in ladders) else 1


def _name(ladder: Ladder, rung: Rung) -> str:
    return f"{ladder.kind}, {1e3 * rung.period_s:g} ms"


def _print(
    ladders: Sequence[Ladder],
    shown: Sequence[tuple[Ladder, Rung]],
    reference: Histogram | None,
    fastest_s: float,
    folder: Path,
) -> None:
    """Tables, histograms and what they mean."""
    from rtctl.output.progress import print_table
    from rtctl.session.latency_report import HEADERS, conclusion, rows, text_histogram, verdict

    print_table("times in us", HEADERS, [row for ladder in ladders for row in rows(ladder)])
    for ladder, rung in shown:
        name, timing = _name(ladder, rung), rung.timing
        for title, histogram in (("lateness", timing.lateness), ("round trip", timing.round_trip)):
            print("\n".join(text_histogram(f"{name}: {title}", histogram)))
        for request in rung.requests:
            if not request.applied:
                print(f"{name}: {request.describe()}")
    if reference is not None:
        title = f"cyclictest, {1e3 * fastest_s:g} ms: lateness"
        print("\n".join(text_histogram(title, reference)))
    else:
        print("cyclictest is not installed here (Debian package rt-tests): nothing to compare with")
    for ladder in ladders:
        print(verdict(ladder))
    print(f"results in {folder}")
    print(conclusion(ladders))
