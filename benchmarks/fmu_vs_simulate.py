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
    from vo2_model_cases import small_model, telegraph

    import rtctl
    from rtctl.models.vo2 import save_model

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
        save_model(folder / "vo2.toml", small_model())
        current = telegraph(600)
        signals = {"current": current, "resistance": np.full(600, 1e4), "deflection": np.zeros(600)}
        record = rtctl.Record(name="a", period_s=1e-3, use="test", signals=signals)
        units = {"current": "mA", "resistance": "ohm", "deflection": "um"}
        groups["vo2"].append(
            (
                folder / "vo2.toml",
                rtctl.write_dataset(
                    folder / "v", [record], name="x", plant="vo2", units=units, holds={"current": "linear"}
                ),
            )
        )
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
