"""Units beside the simulation: largest difference, size, and the time of a communication step in FMPy.

python benchmarks/fmu_vs_simulate.py
"""

from __future__ import annotations

import logging
import sys
import tempfile
import time
import warnings
import zipfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
EQUATIONS = ROOT / "scenarios" / "models" / "equations"


def main() -> None:
    """Print the table of docs/results.md."""
    import fmpy
    from export.fmu_cases import MECHANISMS, free_runs, oscillator, oscillator_data
    from export.test_fmu_equals_simulate import PERIODS_S, equations_data
    from export.test_fmu_signals import ALL as SIGNALS
    from export.test_fmu_signals import with_mechanisms
    from export.test_fmu_vo2 import CASES, recorded, vo2

    import rtctl

    warnings.simplefilter("ignore")
    logging.disable(logging.CRITICAL)
    with tempfile.TemporaryDirectory() as work:
        folder = Path(work)
        groups: dict[str, list[tuple[Path, rtctl.Dataset]]] = {"equations": [], "oscillator": [], "vo2": []}
        for path in sorted(EQUATIONS.glob("*.toml")):
            own = folder / path.stem
            own.mkdir()
            groups["equations"].append(
                (path, equations_data(path, own, "linear", PERIODS_S.get(path.stem, 2e-3)))
            )
        data = oscillator_data(folder, "linear")
        for k, case in enumerate(("", *MECHANISMS)):
            own = folder / f"oscillator{k}"
            own.mkdir()
            groups["oscillator"].append((oscillator(own, *([case] if case else [])), data))
        groups["equations, a signal's mechanism"] = []
        plain = EQUATIONS / "oscillator.toml"
        for k, identity in enumerate(SIGNALS):
            own = folder / f"signal{k}"
            own.mkdir()
            groups["equations, a signal's mechanism"].append(
                (with_mechanisms(own, identity), equations_data(plain, own, "linear", 2e-3))
            )
        for k, case in enumerate(CASES):
            own = folder / f"vo2-{k}"
            own.mkdir()
            groups["vo2"].append((vo2(own, *([] if case == "nothing" else [case])), recorded(own, "linear")))
        print(
            "| kind | models | largest difference, of the range | file [kB] | library [kB] | step in FMPy [us] |"
        )
        print("|---|---|---|---|---|---|")
        for kind, cases in groups.items():
            errors, files, libraries, steps = [], [], [], []
            for model, records in cases:
                errors.append(max(free_runs(model, records, folder).values()))
                unit = folder / "unit.fmu"
                with zipfile.ZipFile(unit) as archive:
                    libraries += [one.file_size for one in archive.infolist() if one.filename.endswith(".so")]
                files.append(unit.stat().st_size)
                period, samples = records.records[0].period_s, records.records[0].samples
                begun = time.perf_counter()
                fmpy.simulate_fmu(
                    str(unit), stop_time=period * (samples - 1), step_size=period, output_interval=period
                )
                steps.append((time.perf_counter() - begun) / samples)
            print(
                f"| {kind} | {len(cases)} | {max(errors):.1e} | {min(files) / 1e3:.0f} to {max(files) / 1e3:.0f} | "
                f"{min(libraries) / 1e3:.0f} to {max(libraries) / 1e3:.0f} | {1e6 * np.median(steps):.0f} |"
            )


if __name__ == "__main__":
    main()
