"""Every estimator on every scenario, on three devices: the tables of docs/results.md.

Each device is identified once, with noise of its own seed; runs use other seeds, and the random staircase other
currents. Nothing in the program was chosen on these seeds, nor on devices B and L2P.

    python benchmarks/compare_estimators.py [--quick] [--results docs/results.md]
"""

from __future__ import annotations

import argparse
import datetime
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.estimators import ESTIMATORS
from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
from rtctl.measured.reading import read_dataset
from rtctl.models.vo2 import Vo2Model
from rtctl.scenario.schema import load_scenario
from rtctl.session.acquisition import acquire
from rtctl.session.closed_loop import track
from rtctl.wiring import build_driver

SCENARIOS = Path(__file__).resolve().parent.parent / "scenarios"
DEVICES = ("vo2_a", "vo2_b", "vo2_l2p")
ORDER = (
    "random_staircase", "steps", "sine_0p1hz", "sine_0p5hz", "sine_1hz", "multisine_1_10hz", "multisine_10_30hz",
    "multisine_1_10hz PI alone", "multisine_10_30hz PI alone",
)  # fmt: skip
IDENTIFICATION_SEED = 901
BEGIN, END = "<!-- compare_estimators: begin -->", "<!-- compare_estimators: end -->"
Never = Callable[[], bool]


def main() -> None:
    """Run, print, and replace the block between the markers of the results page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="one seed, device A only")
    parser.add_argument("--results", type=Path, help="page whose marked block is replaced")
    args = parser.parse_args()
    devices, seeds = (DEVICES[:1], (11,)) if args.quick else (DEVICES, (11, 12, 13))
    text = report({device: compare(device, seeds) for device in devices}, seeds)
    print(text)
    if args.results is not None:
        page = args.results.read_text(encoding="utf-8")
        head, _, rest = page.partition(BEGIN)
        args.results.write_text(f"{head}{BEGIN}\n{text}\n{END}{rest.partition(END)[2]}", encoding="utf-8")


def compare(device: str, seeds: tuple[int, ...]) -> dict[tuple[str, str], list[dict[str, Any]]]:
    """Summaries by (scenario, estimator)."""
    model = identified(device)
    found: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for name in ORDER:
        for estimator in ESTIMATORS:
            found[name, estimator] = [run(device, model, name, estimator, seed) for seed in seeds]
    return found


def identified(device: str) -> Vo2Model:
    """A model of the device from the bundled excitation."""
    overrides = [f"driver.device={device}", f"driver.seed={IDENTIFICATION_SEED}"]
    scenario, _ = load_scenario(SCENARIOS / "acquire_vo2.toml", overrides)
    with tempfile.TemporaryDirectory() as folder:
        manifest = acquire(
            scenario, build_driver(scenario, SCENARIOS), Path(folder), lambda: False, lambda text: None
        )
        return identify_vo2(read_dataset(manifest), Vo2FitOptions(), lambda text: None)


def run(device: str, model: Vo2Model, name: str, estimator: str, seed: int) -> dict[str, Any]:
    """One run in-process on the simulated clock."""
    overrides = [f"driver.device={device}", f"driver.seed={seed}", f"estimator.kind={estimator}"]
    if name == "random_staircase":
        overrides.append(f"excitation.0.seed={seed}")
    file, _, alone = name.partition(" ")
    if alone:
        overrides.append("controller.feedforward=none")
    scenario, _ = load_scenario(SCENARIOS / f"{file}.toml", overrides)
    return track(scenario, model, build_driver(scenario, SCENARIOS), lambda: False)[0].summary


def report(results: dict[str, dict[tuple[str, str], list[dict[str, Any]]]], seeds: tuple[int, ...]) -> str:
    """Markdown: a table a device; mean and max over the seeds."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    )
    lines = [
        f"Made {datetime.date.today().isoformat()} at commit {commit.stdout.strip()} by "
        "`python benchmarks/compare_estimators.py --results docs/results.md`; "
        f"{len(seeds)} seeds a cell: mean over the seeds of the mean absolute error, and the largest error of all, in "
        "percent of the device's deflection range.",
    ]
    for device, found in results.items():
        span = next(iter(found.values()))[0]["range_um"]
        lines += ["", f"**Device {device}** (range {span:.1f} um)", ""]
        lines.append("| scenario, error | paper | " + " | ".join(ESTIMATORS) + " |")
        lines.append("|---" * (len(ESTIMATORS) + 2) + "|")
        for name in ORDER:
            for kind in ("tracking", "self_sensing"):
                if name == "random_staircase" and kind == "tracking":
                    continue
                lines.append(row(name, kind, found))
    return "\n".join(lines)


def row(name: str, kind: str, found: dict[tuple[str, str], list[dict[str, Any]]]) -> str:
    """One line of a table; the best estimator in bold."""
    cells = {}
    for estimator in ESTIMATORS:
        errors = [summary[kind] for summary in found[name, estimator]]
        mean = float(np.mean([error["mean_abs_percent"] for error in errors]))
        cells[estimator] = (mean, max(error["max_abs_percent"] for error in errors))
    best = min(cells.values())
    paper = found[name, "observer"][0]["paper"]
    theirs = " / ".join(f"{paper[key]:g}" for key in (f"{kind}_mean", f"{kind}_max") if key in paper) or "–"
    texts = [f"{mean:.2f} / {most:.1f}" for mean, most in cells.values()]
    marked = [
        f"**{text}**" if cell == best else text for text, cell in zip(texts, cells.values(), strict=True)
    ]
    return f"| {name}, {kind.replace('_', '-')} mean / max | {theirs} | " + " | ".join(marked) + " |"


if __name__ == "__main__":
    main()
