"""Whether `rtctl diagnose` says beforehand how long it will take: foretold beside taken, on six blind cases.

    python benchmarks/foretold.py [--first 5301] [--cases 6]

Oscillators of the generator of tests/blind, three records to fit, sizes by turns 3,000 and 12,000 samples a record;
every third one a VO2 actuator. Wall time on one thread; a first diagnosis of a small case compiles.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "blind"))

from case import generate, identified  # noqa: E402

import rtctl  # noqa: E402

SMALL = {"fit_records": 2, "test_records": 1, "samples": 1500}
SIZES = (3000, 12_000)


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--first", type=int, default=5301, help="seed of the first case")
    parser.add_argument("--cases", type=int, default=6)
    asked = parser.parse_args()
    for plant in ("oscillator", "vo2"):
        diagnosed(plant, asked.first - 1, SMALL if plant == "oscillator" else {})
    print(f"load {os.getloadavg()[0]:.1f}")
    print(
        "| case | samples | foretold | taken [s] | verdict | causes | hidden |\n|---|---|---|---|---|---|---|"
    )
    for k in range(asked.cases):
        plant = "vo2" if k % 3 == 2 else "oscillator"
        sizes = {"fit_records": 3, "samples": SIZES[k % 2]} if plant == "oscillator" else {}
        told, taken_s, samples, found, hidden = diagnosed(plant, asked.first + k, sizes)
        causes = ", ".join(one.id for one in found.causes) or "none"
        print(
            f"| {plant} {asked.first + k} | {samples} | {told} | {taken_s:.1f} | {found.verdict} | {causes} | "
            f"{', '.join(hidden) or 'nothing'} |",
            flush=True,
        )
    print(f"load {os.getloadavg()[0]:.1f}")


def diagnosed(
    plant: str, seed: int, sizes: dict[str, Any]
) -> tuple[str, float, int, rtctl.Diagnosis, list[str]]:
    """What is foretold, what it takes [s], samples to fit, the answer, what is hidden."""
    heard: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = generate(seed, folder, plant=plant, **sizes)
        if plant == "vo2":
            identified(folder)
        begun = time.perf_counter()
        found = rtctl.diagnose(
            folder / "dataset.toml", folder / "model.toml", progress=lambda text, share: heard.append(text)
        )
        taken_s = time.perf_counter() - begun
    told = next((text for text in heard if text.startswith("about ")), "nothing")
    return told, taken_s, found.answer.problem.samples, found, list(truth.ids)


if __name__ == "__main__":
    main()
