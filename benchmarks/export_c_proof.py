"""Exported loops on every machine that is here, over many samples of noise and corners: the same bits as Python?

`lock_in` is the bundled resonator's loop; of a model with mechanisms the estimators are the extended ones.

    python benchmarks/export_c_proof.py --model MODEL.toml [--rows 1000000] [--estimators observer ...]
        [--machines gcc ...]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from rtctl.api.exporting.c import export_c
from rtctl.export.c.laws.planning import law_of
from rtctl.export.c.proof.comparison import differences
from rtctl.export.c.proof.corners import corner_rows
from rtctl.export.c.proof.in_python import PythonLaw
from rtctl.export.c.proof.machines import MACHINES, REALS, build, missing, run
from rtctl.export.c.translated import translated
from rtctl.models.resonator import read_resonator
from rtctl.models.vo2 import read_model
from rtctl.scenario.bundled import find_scenario
from rtctl.scenario.schema import load_scenario

ESTIMATORS = ("observer", "composite", "gap_free", "preisach", "egpi", "lock_in")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--estimators", nargs="+", default=ESTIMATORS)
    parser.add_argument("--machines", nargs="+", choices=tuple(MACHINES), default=tuple(MACHINES))
    args = parser.parse_args()
    print("| estimator | precision | machine | samples | faults among them | differ from Python | s |")
    print("|---|---|---|---|---|---|---|")
    for estimator in args.estimators:
        is_vo2 = estimator != "lock_in"
        name, settings = ("steps", {"controller.feedforward": "inverse"}) if is_vo2 else ("me_amplitude", {})
        settings["estimator.kind"] = estimator
        file = args.model if is_vo2 else find_scenario(name).parent / "models" / "me_a.toml"
        scenario, _ = load_scenario(
            find_scenario(name), [f"{key}={value}" for key, value in settings.items()]
        )
        exported = translated(law_of(scenario, read_model(file) if is_vo2 else read_resonator(file)))
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            export_c(name, model=file, settings=settings, out=folder)
            for precision, real in REALS.items():
                rows = corner_rows(exported.law, args.rows, real, seed=3)
                oracle = PythonLaw(*exported, real, compiled=True)(rows)
                faults = int((np.diff(oracle["fault"], prepend=0) > 0).sum())
                for machine in (MACHINES[name] for name in args.machines):
                    if missing(machine) or precision not in machine.precisions:
                        continue
                    begin = time.perf_counter()
                    found = run(build(folder, machine, precision), machine, rows, oracle.dtype)
                    unequal, first = differences(found, oracle)
                    lasted = time.perf_counter() - begin
                    print(
                        f"| {estimator} | {precision} | {machine.title} | {len(rows)} | {faults} | {unequal} {first} | "
                        f"{lasted:.0f} |",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
