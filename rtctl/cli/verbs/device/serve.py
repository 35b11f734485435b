"""A simulated device on a wire: Modbus RTU or the plain serial protocol on a pty, Modbus TCP, or a source meter."""

from __future__ import annotations

import argparse
from pathlib import Path

USUAL_PORT = -1
"""Of the page: that of `rtctl watch`, or a free one."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `rtctl serve`."""
    parser.add_argument(
        "plant",
        help="plant file, a unit (FILE.fmu), or the name of a bundled one: vo2_a, vo2_b, vo2_l2p, me_a, beam_hm, ...",
    )
    wire = parser.add_mutually_exclusive_group(required=True)
    wire.add_argument(
        "--modbus-rtu", type=Path, metavar="PATH", help="Modbus RTU on a new pty, linked to PATH"
    )
    wire.add_argument("--modbus-tcp", metavar="HOST:PORT", help="Modbus TCP; port 0: a free one, printed")
    wire.add_argument(
        "--serial", type=Path, metavar="PATH", help="plain serial protocol on a new pty, linked to PATH"
    )
    wire.add_argument(
        "--scpi",
        metavar="PLACE",
        help="a simulated source meter in front of the device, at HOST:PORT or on a new pty, linked to PLACE",
    )
    parser.add_argument(
        "--instrument", default="keithley-2450", metavar="NAME",
        help="which source meter with --scpi: keithley-2400, keithley-2450 (default), keithley-2600 or keysight-b2900",
    )  # fmt: skip
    parser.add_argument(
        "--voltmeter", metavar="PLACE",
        help="with --scpi: also an SCPI voltmeter that reads the external instrument, 0.1 V for 1 um",
    )  # fmt: skip
    parser.add_argument(
        "--baud",
        type=int,
        help="with a pty: bytes take the time of a line of this baud rate (default: no time)",
    )
    parser.add_argument(
        "--journal", type=Path, metavar="CSV", help="file in which the device writes at its end what it did"
    )
    parser.add_argument("--seed", type=int, help="seed of the noise (default: the plant file's)")
    parser.add_argument(
        "--faults", default="", metavar="FILE|SPEC",
        help='what goes wrong on purpose: a TOML file, or "drop rate=0.01; sensor_fault at=5s duration=200ms"',
    )  # fmt: skip
    parser.add_argument(
        "--page", nargs="?", type=int, const=USUAL_PORT, metavar="PORT",
        help="also a page in the browser: what the device really does; injects faults, switches hidden effects on",
    )  # fmt: skip
    parser.add_argument(
        "--record", type=Path, metavar="DIR", help="what the device really does, recorded there like a run"
    )


def run(args: argparse.Namespace) -> int:
    """Run the verb: serve until Ctrl-C or SIGTERM."""
    from rtctl.api.machines import serve

    serve(
        args.plant,
        seed=args.seed,
        rtu_path=args.modbus_rtu,
        serial_path=args.serial,
        tcp=args.modbus_tcp,
        scpi=args.scpi,
        instrument=args.instrument,
        voltmeter=args.voltmeter,
        baud=args.baud,
        journal=args.journal,
        faults=args.faults,
        record=args.record,
        page=False if args.page is None else True if args.page == USUAL_PORT else args.page,
    )
    return 0
