"""Record what the program answers today, and compare it with what an earlier commit answered.

python tests/answers/answers.py record|compare [--only blind|loop|study] [--names NAME ...] [--quick] [--jobs 2]

Three groups: 40 blind diagnoses (search budgets switched off, so that no clock takes part), six closed-loop runs, the
three papers' short studies. `compare` prints one line an answer: "same" (to the last digit), "close" (numbers within
1e-6 relative), or what differs. Exit 1 if anything is neither.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT))  # this tree, not one that happens to be installed
RECORDED = HERE / "recorded.json"
CLOSE = 1e-6
"""Relative difference of numbers below which two answers agree."""

SMALL = {"null": 6_000, "single": 6_000, "pair": 2_500, "outside": 2_500}
"""Samples of an oscillator's records: without a budget a search for larger sets takes long."""
OSCILLATORS = {
    "null": range(4700, 4704),
    "single": range(4710, 4722),
    "pair": range(4730, 4736),
    "outside": range(4740, 4744),
}
VO2 = {
    "null": range(52340, 52343),
    "single": range(52344, 52350),
    "pair": range(52351, 52354),
    "outside": range(52355, 52357),
}
"""Seeds of the generator that were seen before: nothing is reported from them."""

LOOPS: dict[str, tuple[str, ...]] = {
    "steps": ("run", "steps"),
    "sine_1hz": ("run", "sine_1hz"),
    "multisine_1_10hz": ("run", "multisine_1_10hz"),
    "random_staircase": ("run", "random_staircase"),
    "steps_vo2_b": ("run", "steps", "--set", "driver.device=vo2_b"),
    "me_amplitude": ("run", "me_amplitude"),
}
STUDIES = ("vo2", "me", "bistable")
QUICK = {
    "oscillator-null-4700", "oscillator-single-4710", "oscillator-single-4711", "oscillator-pair-4730",
    "vo2-null-52340", "vo2-single-52344", "steps", "me_amplitude",
}  # fmt: skip
"""A look in a few minutes."""


def names_of(only: str | None) -> list[str]:
    """Every answer of the group, or of all groups."""
    blind = [f"oscillator-{kind}-{seed}" for kind, seeds in OSCILLATORS.items() for seed in seeds]
    blind += [f"vo2-{kind}-{seed}" for kind, seeds in VO2.items() for seed in seeds]
    groups = {"blind": blind, "loop": list(LOOPS), "study": [f"study-{name}" for name in STUDIES]}
    return [name for group, names in groups.items() if only in (None, group) for name in names]


def answer(name: str) -> tuple[str, dict[str, Any], float]:
    """(name, answer, seconds of processor time)."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    begin = time.process_time()
    if name in LOOPS:
        found = loop_answer(name)
    elif name.startswith("study-"):
        found = study_answer(name.removeprefix("study-"))
    else:
        plant, kind, seed = name.split("-")
        found = blind_answer(plant, kind, int(seed))
    return name, found, time.process_time() - begin


def blind_answer(plant: str, kind: str, seed: int) -> dict[str, Any]:
    """The content of diagnosis.json without figures that depend on the machine's speed."""
    sys.path.insert(0, str(HERE.parent / "blind"))
    from case import diagnosed_without_budget, identified
    from generator import generate

    with tempfile.TemporaryDirectory() as folder:
        overrides: dict[str, Any] = {"kind": kind} | (
            {"samples": SMALL[kind]} if plant == "oscillator" else {}
        )
        truth = generate(seed, Path(folder), plant=plant, **overrides)
        if plant == "vo2":
            identified(Path(folder))
        found = json.loads(json.dumps(diagnosed_without_budget(Path(folder)), default=float))
    return {"truth": list(truth.ids), **found}


def loop_answer(name: str) -> dict[str, Any]:
    """Verdict and scores of a run on the simulated clock, and a digest of every recorded number."""
    import pyarrow.parquet as pq

    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "rtctl", *LOOPS[name], "--out", folder, "--quiet"]
        subprocess.run(command, check=False, cwd=HERE.parent.parent)
        summary = json.loads((Path(folder) / "summary.json").read_text(encoding="utf-8"))
        table = pq.read_table(Path(folder) / "signals.parquet")
        digest = hashlib.sha256()
        for column in table.column_names:
            digest.update(table[column].to_numpy().tobytes())
    kept = {
        key: summary[key]
        for key in ("verdict", "tracking", "self_sensing", "faults", "checks")
        if key in summary
    }
    return {**kept, "columns": table.column_names, "sha256": digest.hexdigest()}


def study_answer(name: str) -> dict[str, Any]:
    """The figures of a paper's short study."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "rtctl", "reproduce", name, "--short", "--out", folder, "--quiet"]
        subprocess.run(command, check=True, cwd=HERE.parent.parent)
        return dict(json.loads((Path(folder) / "results.json").read_text(encoding="utf-8")))


IN_WORDS = {"statement", "warnings", "cut_by_clock"}
"""Keys that are not compared: sentences may be written anew."""


def differences(old: Any, new: Any, where: str = "") -> Iterator[tuple[str, str]]:
    """(how: "close" or "differs", where and what) of every place that is not the same."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted((old.keys() | new.keys()) - IN_WORDS):
            if key not in old or key not in new:
                yield "differs", f"{where}.{key}: only in the {'recorded' if key in old else 'new'} answer"
            else:
                yield from differences(old[key], new[key], f"{where}.{key}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for k, (a, b) in enumerate(zip(old, new, strict=True)):
            yield from differences(a, b, f"{where}[{k}]")
    elif isinstance(old, float) and isinstance(new, float) and not isinstance(old, bool):
        if old != new and not (math.isnan(old) and math.isnan(new)):
            near = math.isclose(old, new, rel_tol=CLOSE, abs_tol=1e-12)
            yield "close" if near else "differs", f"{where}: {old!r} -> {new!r}"
    elif old != new:
        yield "differs", f"{where}: {old!r} -> {new!r}"


def answers(names: list[str], jobs: int) -> Iterator[tuple[str, dict[str, Any], float]]:
    """As they come."""
    with ProcessPoolExecutor(jobs) as pool:
        for future in as_completed([pool.submit(answer, name) for name in names]):
            yield future.result()


def main() -> int:
    """Record or compare. Returns 0; 1 where an answer differs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("record", "compare"))
    parser.add_argument("--only", choices=("blind", "loop", "study"))
    parser.add_argument("--names", nargs="*", default=[])
    parser.add_argument("--quick", action="store_true", help="eight of the answers")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--show", type=int, default=6, help="differences shown an answer")
    parser.add_argument("--recorded", type=Path, default=RECORDED)
    asked = parser.parse_args()
    names = asked.names or [name for name in names_of(asked.only) if not asked.quick or name in QUICK]
    recorded = json.loads(asked.recorded.read_text(encoding="utf-8")) if asked.recorded.exists() else {}
    worst, begin = 0, time.monotonic()
    for count, (name, found, seconds) in enumerate(answers(names, asked.jobs), 1):
        text = f"{count}/{len(names)} {name} {seconds:.1f} s"
        if asked.what == "record":
            recorded[name] = found
            lines = json.dumps(dict(sorted(recorded.items())), indent=1, default=float)
            asked.recorded.write_text(lines + "\n", encoding="utf-8")
            print(f"{text} {found.get('verdict', '')}", flush=True)
            continue
        found = json.loads(json.dumps(found, default=float))
        apart = (
            list(differences(recorded[name], found)) if name in recorded else [("differs", "not recorded")]
        )
        hows = {how for how, _ in apart}
        verdict = "differs" if "differs" in hows else "close" if hows else "same"
        worst |= verdict == "differs"
        print(f"{text}: {verdict}", flush=True)
        for how, what in [one for one in apart if one[0] == "differs"][: asked.show]:
            print(f"    {how} {what}", flush=True)
    print(f"{len(names)} answers in {time.monotonic() - begin:.0f} s")
    return int(worst)


if __name__ == "__main__":
    raise SystemExit(main())
