"""The command line: one verb a file. Heavy imports happen inside a verb, so that `--help` answers at once."""

from __future__ import annotations

import argparse
import errno
import importlib
import io
import os
import re
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from rtctl.border.errors import RtctlError, check_utf8, nearest
from rtctl.cli.examples import VerbHelp, epilog_of
from rtctl.registry import load_plugin
from rtctl.version import __version__


class Verb(NamedTuple):
    """A verb of the command line."""

    module: str
    """Below `rtctl.cli.verbs`."""
    summary: str
    """One line for `rtctl --help`."""


VERBS = {
    "run": Verb("device.run", "play a scenario in closed loop (or open loop) and score it"),
    "set": Verb("device.set", "change the set-point or a gain of a run that is under way"),
    "watch": Verb("device.watch", "a run in a browser, while it lasts and afterwards; --control changes it"),
    "export": Verb("export", "a run, a model or a loop for other programs and machines (mcap, fmu, c)"),
    "replay": Verb(
        "device.replay",
        "a recorded run through estimator and controller again: the same commands to the bit?",
    ),
    "doubt": Verb(
        "device.doubt", "whether a run's device still is its model, and what changed; also while it runs"
    ),
    "recover": Verb("device.recover", "what a run that was killed has recorded, as Parquet with a summary"),
    "acquire": Verb("device.acquire", "play an open-loop excitation through a driver into a dataset"),
    "init": Verb(
        "modelling.init", "data files -> manifest: columns, units, rate, roles; a picture of the data"
    ),
    "preview": Verb("modelling.preview", "what was read of a dataset: tables and a picture"),
    "identify": Verb("modelling.identify", "measured data -> model"),
    "simulate": Verb("modelling.simulate", "how far a model is from a dataset"),
    "diagnose": Verb("modelling.diagnose", "what the simulation gets wrong, why, and the model with it"),
    "reproduce": Verb(
        "modelling.reproduce", "a paper's study on our plants, its tables and figures beside ours"
    ),
    "sweep": Verb("modelling.sweep", "many simulations of one model, on all cores or a cluster"),
    "latency": Verb(
        "device.latency", "which period this machine and a wire hold: lateness, round trip, compute"
    ),
    "serve": Verb("device.serve", "a simulated device on a wire"),
    "firmware": Verb("device.firmware", "C sources of a device on a microcontroller, or on an emulated one"),
    "list": Verb(
        "list", "scenarios, plants, drivers, estimators, controllers and mechanisms, your own included"
    ),
    "sbom": Verb("sbom", "packages, versions and licences of which the program consists here (CycloneDX)"),
    "completion": Verb("completion", "a script by which bash, zsh or fish completes verbs and options"),
    "demo": Verb(
        "device.demo", "serve, acquire, identify and all scenarios, one table (what `make run` calls)"
    ),
}


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> None:  # type: ignore[override]
        self.exit(2, f"{self.prog}: {message}{_nearest_choice(message)}\n{self.format_usage()}")


def _nearest_choice(message: str) -> str:
    """Return `; did you mean "x"?` for a message of argparse about a choice that is none; "" where none is near."""
    found = re.search(r"invalid choice: '(.*)' \(choose from (.*)\)", message)
    return "" if found is None else nearest(found[1], re.findall(r"[\w.-]+", found[2]), listed=True)


def _refuse(verb: argparse.ArgumentParser, extra: Sequence[str]) -> None:
    """End with a message about arguments that a verb does not know, with the nearest option of a misspelt one."""
    options = [one for action in verb._actions for one in action.option_strings if one.startswith("--")]
    near = [nearest(one.partition("=")[0], options, listed=True) for one in extra if one.startswith("--")]
    verb.error(f"unrecognized arguments: {' '.join(extra)}{next(filter(None, near), '')}")


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of all verbs."""
    parser = _Parser(prog="rtctl", description="Feedback control of actuators that sense themselves.")
    parser.add_argument("--version", action="version", version=f"rtctl {__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for name, known in VERBS.items():
        verb = verbs.add_parser(
            name, help=known.summary, description=_module(name).__doc__, epilog=epilog_of(name),
            formatter_class=VerbHelp,
        )  # fmt: skip
        _module(name).add_arguments(verb)
        verb.add_argument(
            "--plugin", dest="plugins", action="append", default=[], metavar="FILE.py",
            help="import a file that registers parts of your own (rtctl.register); may be given several times",
        )  # fmt: skip
        verb.add_argument("--quiet", action="store_true", help="print nothing but errors")
        verb.add_argument("--json", action="store_true", help="print the result as JSON instead of tables")
        verb.set_defaults(verb_parser=verb)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line. Exit 0: done. 1: it ran and failed. 2: bad input, one message, no traceback."""
    _replace_closed_streams()
    _print_what_the_encoding_has()
    args, extra = build_parser().parse_known_args(argv)
    if extra:
        _refuse(args.verb_parser, extra)
    try:
        _check_names(args)
        for plugin in args.plugins:
            load_plugin(plugin)
        return int(_module(args.verb).run(args))
    except RtctlError as error:
        print(f"rtctl {args.verb}: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print(f"rtctl {args.verb}: stopped by the user", file=sys.stderr)
        return 1
    except BrokenPipeError:  # the reader of our output went away: nothing left to tell
        sys.stderr.close()
        return 1
    except MemoryError as error:  # a duration of years
        print(f"rtctl {args.verb}: {error}", file=sys.stderr)
        return 1
    except OSError as error:  # a full disk
        print(f"rtctl {args.verb}: {_about_system(error, args)}", file=sys.stderr)
        return 1


def _about_system(error: OSError, args: argparse.Namespace) -> str:
    """Return what the system refused, where, and what to do."""
    where = error.filename2 or error.filename or (None if _is_output_full() else getattr(args, "out", None))
    text = f"{where}: {error.strerror}" if where is not None and error.strerror else str(error)
    if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return text
    if where is None:
        return f"{text}: the output cannot be written"
    return f"{text}; free some space, or write elsewhere with --out{_kept(Path(str(where)))}"


def _is_output_full() -> bool:
    """Return whether it is standard output that takes no more; what was to go there may be gone from its buffer."""
    try:
        print(flush=True)
    except OSError:
        return True
    return False


def _kept(where: Path) -> str:
    """Return how to get at what a run recorded before the disk was full; "": there is no such recording."""
    folder = where if where.is_dir() else where.parent
    is_there = all((folder / name).exists() for name in ("signals.rec", "timing.rec", "events.jsonl"))
    return f". What was recorded by then stays: rtctl recover {shlex.quote(str(folder))}" if is_there else ""


def _replace_closed_streams() -> None:
    """Write to nowhere where standard output or error was closed before the start: Python then has none."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 - until the end


def _print_what_the_encoding_has() -> None:
    """Print "?" for a character that the streams' encoding lacks, such as an en dash in Latin-1, instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="replace")


def _check_names(args: argparse.Namespace) -> None:
    """Raise InputError for the name of a file or folder that is no UTF-8, which no manifest or report can hold."""
    for value in vars(args).values():
        for one in value if isinstance(value, list | tuple) else [value]:
            check_utf8(one)


def _module(verb: str) -> ModuleType:
    return importlib.import_module(f"rtctl.cli.verbs.{VERBS[verb].module}")
