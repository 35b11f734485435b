"""Measure which period this machine and a wire hold: lateness, round trip, compute; text, latency.json, latency.png."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl latency`."""
    parser.add_argument(
        "--driver", action="append", default=[], metavar="KIND",
        help="inprocess, modbus-tcp, modbus-rtu, serial, scpi; repeat for several (default: all)",
    )  # fmt: skip
    parser.add_argument(
        "--period", action="append", default=[], metavar="TIME",
        help='such as "1 ms"; repeat for several (default: 10 ms down to 0.1 ms; scpi: 50 ms down to 2 ms)',
    )  # fmt: skip
    parser.add_argument(
        "--duration", default="2 s", metavar="TIME", help="time at each period (default: 2 s)"
    )
    parser.add_argument("--priority", type=int, help="SCHED_FIFO priority, 1 to 99, if permitted")
    parser.add_argument("--cpu", type=int, help="the only CPU of the loop")
    parser.add_argument(
        "--set", dest="overrides", action="append", default=[], metavar="KEY=VALUE",
        help="a key of [driver] or [clock], such as --set driver.address=10.0.0.7:502 for a device of your own "
        "(it is commanded its safe level only)",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, help="folder of latency.json and latency.png")


def run(args: argparse.Namespace) -> int:
    """Run the verb. Returns 0: some period is held by every driver; 1: not so."""
    from rtctl.api.machines import measure_latency
    from rtctl.cli.options import is_quiet, output_file, output_folder, print_json
    from rtctl.cli.printing.latency import print_latency

    folder = output_folder(args.out)
    for name in ("latency.json", "latency.png"):
        output_file(folder / name, "a file of the result", "latency")
    latency = measure_latency(
        args.driver, periods=args.period, duration=args.duration, priority=args.priority, cpu=args.cpu,
        settings=args.overrides, progress=not is_quiet(args),
    )  # fmt: skip
    latency.save(folder)
    if args.json:
        print_json(latency.to_dict())
    elif not args.quiet:
        print_latency(latency, folder)
    return 0 if latency.held else 1
