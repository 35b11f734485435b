"""The blind campaign: seeds of oscillators and of VO2 actuators on all cores, resumable; tables and pictures.

python tests/blind/campaign.py --oscillator 0-239 --vo2 50000-50119 --ambiguous 90000-90039 --out out/blind
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
import traceback
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from campaign_pictures import draw
from case import dump, run_case
from details import details
from figures import figures, known
from program import Program
from workers import Limits, results

Line = dict[str, Any]
FULL_SIZE = {"fit_records": 5, "samples": 16_000, "least_samples": 16_000}
"""That of the target of time: every sixth oscillator."""
SHORTER = {"samples": 9_000}
"""The others: 3 to 5 records of 4,000 to 9,000 samples."""
FEW: dict[str, Line] = {
    "oscillator": {"kind": "single", "fit_records": 2, "test_records": 1, "samples": 1200, "snr_dB": 40.0},
    "vo2": {"kind": "single", "fit_records": 1, "test_records": 1, "samples": 1500, "snr_dB": 40.0},
}
"""Data that often leave several names: for the row of the next experiment, and for no other."""
ALIKE = (
    "drive.lag", "sensor.lag", "drive.delay", "input.hold", "drive.harmonics", "drive.saturation", "drive.offset",
    "sensor.offset",
)  # fmt: skip
"""Effects of an oscillator that few data confuse, one a seed: others are named alone however few the data are."""
REPORT_EVERY_S = 60.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what is missing, then write the tables."""
    asked = _parser().parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)
    path, program = asked.out / "cases.jsonl", Program.now()
    command = "python tests/blind/campaign.py " + " ".join(sys.argv[1:] if arguments is None else arguments)
    wanted = {_key(task): task for task in tasks(asked)}
    before = [line for line in read(path) if _key(line) in wanted]
    done = {_key(line): line for line in before if line["code"] == program.code}
    other = [line for line in before if line["code"] != program.code and _key(line) not in done]
    missing = [task for key, task in wanted.items() if key not in done]
    stopped = False
    if not asked.tables_only:
        try:
            for line in _run(missing, asked, program, path):
                done[_key(line)] = line
                if time.monotonic() - _written.get("at", 0.0) > REPORT_EVERY_S:
                    report(asked.out, done, wanted, other, program, command)
        except KeyboardInterrupt:
            stopped = True
    print(report(asked.out, done, wanted, other, program, command))
    return 130 if stopped else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name, default, text in (
        ("--oscillator", "0-239", "seeds of oscillators, first-last, both included; `none` for none"),
        ("--vo2", "50000-50119", "seeds of VO2 actuators"),
        ("--ambiguous", "none", "seeds of both plants with so few data that several names are left; only for the row "
         "of the next experiment"),
    ):  # fmt: skip
        parser.add_argument(name, default=default, type=seeds, help=text)
    parser.add_argument(
        "--out", type=Path, default=Path("out/blind"), help="folder of cases.jsonl and blind.md"
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--limit", type=float, default=400.0, help="[s] processor time of a case before it is ended"
    )
    parser.add_argument("--memory", type=float, default=6.0, help="[GiB] of a worker")
    parser.add_argument(
        "--next-experiment", action="store_true", help="measure what an ambiguous case proposes"
    )
    parser.add_argument(
        "--no-baselines", action="store_true", help="do not ask what two other methods would answer"
    )
    parser.add_argument(
        "--kind",
        choices=("null", "single", "pair", "outside"),
        help="of all cases but the ambiguous ones; drawn by default",
    )
    parser.add_argument(
        "--cut",
        type=float,
        default=0.0,
        help="share of each oscillator's record that is left out, so that it begins in motion",
    )
    parser.add_argument(
        "--tables-only", action="store_true", help="run nothing, write the tables of what is done"
    )
    return parser


def seeds(text: str) -> range:
    """`first-last`, both included, or `none`."""
    if text == "none":
        return range(0)
    try:
        first, last = (int(part) for part in text.split("-"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: first-last such as 0-239, or none") from None
    return range(first, last + 1)


def tasks(asked: argparse.Namespace) -> list[Line]:
    """All cases, the sorts spread evenly so that an unfinished campaign is a small one."""
    made: list[tuple[float, Line]] = []
    for sort, plant, chosen in (
        ("main", "oscillator", asked.oscillator), ("main", "vo2", asked.vo2),
        ("ambiguous", "oscillator", asked.ambiguous[: 2 * len(asked.ambiguous) // 3]),
        ("ambiguous", "vo2", asked.ambiguous[2 * len(asked.ambiguous) // 3 :]),
    ):  # fmt: skip
        for place, seed in enumerate(chosen):
            overrides = overrides_of(sort, plant, seed)
            if asked.kind and sort == "main":
                overrides = overrides | {"kind": asked.kind}
            if asked.cut and sort == "main" and plant == "oscillator":
                overrides = overrides | {"cut": asked.cut}
            task = {"sort": sort, "plant": plant, "seed": seed, "overrides": overrides}
            further = asked.next_experiment or sort == "ambiguous"
            task |= {"baselines": sort == "main" and not asked.no_baselines, "next_experiment": further}
            made.append(((place + 0.5) / len(chosen), task))
    return [task for _, task in sorted(made, key=lambda one: one[0])]


def overrides_of(sort: str, plant: str, seed: int) -> Line:
    """Sizes that the generator is told; all else comes from the seed."""
    if sort == "ambiguous":
        return FEW[plant] | ({"effects": (ALIKE[seed % len(ALIKE)],)} if plant == "oscillator" else {})
    if plant == "vo2":
        return {}
    return FULL_SIZE if seed % 6 == 0 else SHORTER


def run_task(task: Line, report: Any) -> Line:
    """One case in a worker."""
    options = {name: task[name] for name in ("plant", "baselines", "next_experiment")}
    try:
        line = run_case(task["seed"], report=report, **options, **task["overrides"])
    except Exception:  # of the generator, or of a baseline
        line = {"died": "crash", "stage": "outside the diagnosis", "error": traceback.format_exc()[-800:]}
    return task | line


def _key(line: Line) -> tuple[str, str, int]:
    return line["sort"], line["plant"], line["seed"]


def read(path: Path) -> list[Line]:
    """Lines of the file; one that was cut off when the campaign was killed is left out."""
    lines = []
    for text in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        try:
            lines.append(json.loads(text))
        except json.JSONDecodeError:
            print(f"{path}: a line that ends early is left out, its case runs again", file=sys.stderr)
    return lines


def _run(missing: Sequence[Line], asked: argparse.Namespace, program: Program, path: Path) -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    limits = Limits(cpu_s=asked.limit, memory_GiB=asked.memory)
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
               TextColumn("left {task.fields[left]}"))  # fmt: skip
    begin = time.monotonic()
    whole = not path.exists() or path.read_bytes().endswith(b"\n") or path.stat().st_size == 0
    with (
        path.open("a", encoding="utf-8") as file,
        Progress(*columns, console=console, disable=not _seen()) as bar,
    ):
        if not whole:
            file.write("\n")
        shown = bar.add_task("blind cases", total=len(missing), left="?")
        for count, line in enumerate(results(missing, run_task, asked.workers, limits, program.check), 1):
            line |= {"commit": program.commit, "version": program.version, "code": program.code}
            file.write(dump(line) + "\n")
            file.flush()
            left = _minutes((time.monotonic() - begin) / count * (len(missing) - count))
            bar.update(shown, advance=1, left=left)
            if not _seen():
                word = known(line)["judgement"]
                text = f"{count}/{len(missing)}  {line['plant']} {line['seed']} {word}, left {left}"
                print(text, file=sys.stderr, flush=True)
            yield line


def _seen() -> bool:
    """Whether a person watches a terminal."""
    return sys.stderr.isatty()


def _minutes(seconds: float) -> str:
    return f"{seconds / 60:.0f} min" if seconds >= 90 else f"{seconds:.0f} s"


def report(
    out: Path,
    done: dict[Any, Line],
    wanted: dict[Any, Line],
    other: Sequence[Line],
    program: Program,
    command: str,
) -> str:
    """blind.md and its pictures from what is done; returns its head, the figures."""
    lines = [known(line) for key, line in done.items() if key in wanted]
    drawn = [line for line in lines if line["kind"] != "not generated"]
    main_ones = [line for line in drawn if line["sort"] == "main"]
    ambiguous = [line for line in drawn if line.get("next")]
    head = "\n\n".join([
        f"`{command}`, commit {program.commit}, rtctl {program.version}: {len(lines)} of {len(wanted)} cases are done.",
        *_remarks(lines, other), figures(main_ones, ambiguous),
    ])  # fmt: skip
    (out / "blind.md").write_text(f"{head}\n\n{details(main_ones, ambiguous)}\n", encoding="utf-8")
    draw(main_ones, out)
    _written["at"] = time.monotonic()
    return head


_written: dict[str, float] = {}


def _remarks(lines: Sequence[Line], other: Sequence[Line]) -> list[str]:
    found = []
    if other:
        counts = Counter(line["commit"] for line in other)
        text = ", ".join(f"{count} of {commit}" for commit, count in counts.most_common())
        found.append(f"Not counted: lines of another state of the program ({text}).")
    bad = [line for line in lines if line["kind"] == "not generated"]
    if bad:
        names = ", ".join(f"{line['plant']} {line['seed']}" for line in bad)
        found.append(f"Not generated (no draw of the seed makes the effect at its size): {names}.")
    cut = [line for line in lines if line.get("died") and line["kind"] != "not generated"]
    if cut:
        names = "; ".join(
            f"{line['plant']} {line['seed']} ({line['error'].splitlines()[-1][:90]})" for line in cut
        )
        found.append(f"Ended by their limit or by a crash: {names}.")
    return found


if __name__ == "__main__":
    raise SystemExit(main())
