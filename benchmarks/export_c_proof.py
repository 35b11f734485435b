"""Exported loops on every machine that is here, over many samples of noise and corners: the same bits as Python?

`lock_in` is the bundled resonator's loop, `voice_coil_steps` and alike are those of equations with a Kalman filter; of
a model with mechanisms the estimators are the extended ones.

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
from rtctl.api.inputs import load_scenario
from rtctl.export.c.laws.planning import law_of
from rtctl.export.c.proof.comparison import differences
from rtctl.export.c.proof.corners import corner_rows
from rtctl.export.c.proof.in_python import PythonLaw
from rtctl.export.c.proof.machines import MACHINES, REALS, build, missing, run
from rtctl.export.c.translated import translated
from rtctl.wiring import model_of

VO2 = ("observer", "composite", "gap_free", "preisach", "egpi")
ESTIMATORS = (*VO2, "lock_in", "voice_coil_steps", "sma_steps", "piezo_steps")


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
        name = "steps" if estimator in VO2 else "me_amplitude" if estimator == "lock_in" else estimator
        settings = (
            {"controller.feedforward": "inverse", "estimator.kind": estimator} if estimator in VO2 else {}
        )
        file = args.model if estimator in VO2 else None
        loaded = load_scenario(name, settings)
        exported = translated(law_of(loaded.scenario, model_of(loaded.scenario, loaded.folder, file)))
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
