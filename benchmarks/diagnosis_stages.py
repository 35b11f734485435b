"""Where a diagnosis spends its time: processor seconds by stage and by package, of three blind cases.

    python benchmarks/diagnosis_stages.py [--cases oscillator friction vo2] [--keep-compiling]

A full-size oscillator (five records of 16,000 samples), one of the same size with dry friction, a VO2 actuator, of the
generator of tests/blind. One thread. Each case is diagnosed twice and the second time counts, so nothing is compiled.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "blind"))

from campaign import FULL_SIZE  # noqa: E402
from case import generate, identified  # noqa: E402
from stack_sampler import Stack, StackSampler, deepest, is_compiling  # noqa: E402

from rtctl.diagnosis.diagnose import diagnose  # noqa: E402
from rtctl.diagnosis.problem.subjects import subject_of  # noqa: E402
from rtctl.diagnosis.report.files import provenance_of, write_diagnosis  # noqa: E402
from rtctl.diagnosis.result import Diagnosis  # noqa: E402
from rtctl.diagnosis.search.request import DiagnosisOptions  # noqa: E402
from rtctl.measured import open_dataset, read_dataset  # noqa: E402
from rtctl.output.fit_lines import Lasting  # noqa: E402
from rtctl.session.validation.model_validation import simulation_for  # noqa: E402
from rtctl.wiring_models import mechanism_ids  # noqa: E402

STAGES = {
    "screen_dataset": "screening",
    "fit_nominal": "nominal fit",
    "run_residual_tests": "residual tests",
    "propose_candidates": "candidates from linear estimates",
    "halve_successively": "fits of sets of causes",
    "select_best": "refits of the leaders",
    "refit_leader_challengers": "refits of the leaders",
    "refit_rivals": "rivals, smaller sets, each cause left out",
    "refit_smaller_sets": "rivals, smaller sets, each cause left out",
    "refit_without_each": "rivals, smaller sets, each cause left out",
    "prefer_simpler_laws": "rivals, smaller sets, each cause left out",
    "prefer_fewest_unknowns": "rivals, smaller sets, each cause left out",
    "find_better_alternative": "laws without a formula",
    "find_memory_alternative": "laws without a formula",
    "_find_coarse_loops": "refits of static loops",
    "refit_behind": "refits of static loops",
    "refit_behind_best": "refits of static loops",
    "fit_whole_records": "verification on whole and test records",
    "verify": "verification on whole and test records",
    "propose_experiment": "next experiment",
    "compute_isolability": "next experiment",
    "explain_by_changed_signals": "explanations by signals, steps, the file's values",
    "explain_by_file_value": "explanations by signals, steps, the file's values",
    "explain_by_steps": "explanations by signals, steps, the file's values",
    "write_diagnosis": "page and pictures",
}
CASES: dict[str, dict[str, Any]] = {
    "oscillator": {"seed": 5106, "plant": "oscillator", **FULL_SIZE},
    "friction": {"seed": 5112, "plant": "oscillator", "effects": ("friction.coulomb",), **FULL_SIZE},
    "vo2": {"seed": 52500, "plant": "vo2"},
}
SMALL = 0.01
"""Share of the time below which a row is left out."""


def package_of(stack: Stack) -> str:
    """The innermost package of the project, or that kernels are compiled or loaded."""
    if is_compiling(stack):
        return "kernels compiled or loaded"
    for one in reversed(stack):
        if one.file.startswith(str(ROOT)):
            parts = Path(one.file).relative_to(ROOT).with_suffix("").parts
            return ".".join(parts[: min(3, len(parts) - 1)])
    return "elsewhere"


def main() -> None:
    """Print two tables a case."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--keep-compiling", action="store_true", help="diagnose once, compilation included")
    asked = parser.parse_args()
    for name in asked.cases:
        with tempfile.TemporaryDirectory() as folder:
            profiled(name, Path(folder), once=asked.keep_compiling)


def profiled(name: str, folder: Path, *, once: bool) -> None:
    """One case."""
    truth = generate(folder=folder, **CASES[name])
    if truth.plant == "vo2":
        identified(folder)
    if not once:
        answered(folder)
    sampler = StackSampler(stage=deepest(STAGES, "other"), package=package_of)
    begun = time.process_time()
    begun_s = time.perf_counter()
    with sampler:
        found, told = answered(folder)
    total, wall_s = time.process_time() - begun, time.perf_counter() - begun_s
    causes = ", ".join(one.id for one in found.causes) or "none"
    print(
        f"\n{name} (seed {truth.seed}, hidden: {', '.join(truth.ids) or 'nothing'}; answer: {found.verdict}, "
        f"{causes}): {total:.1f} s of one core, {wall_s:.0f} s elapsed, {found.problem.samples} samples to fit\n"
        f"foretold: {told}; load {os.getloadavg()[0]:.1f}"
    )
    for column, seconds in sampler.seconds.items():
        table(column, seconds)


def answered(folder: Path) -> tuple[Diagnosis, str]:
    """As `rtctl diagnose` does it, page and pictures included, on one core; and how long it said that it would take."""
    manifest, path, heard = folder / "dataset.toml", folder / "model.toml", list[str]()
    simulation, data = simulation_for(path, open_dataset(manifest)), read_dataset(manifest)
    model = subject_of(simulation.kind).read_model(path)
    ids, options = mechanism_ids(simulation.kind), DiagnosisOptions(threads=1)
    found = diagnose(data, model, simulation, ids, options, heard.append)
    told = provenance_of(found, data, path, "python benchmarks/diagnosis_stages.py")
    write_diagnosis(folder / "answer", found, data, told)
    return found, next((text for text in heard if isinstance(text, Lasting)), "nothing")


def table(column: str, seconds: Counter[str]) -> None:
    """Rows by size."""
    total = sum(seconds.values())
    print(f"\n| {column} | s | share |\n|---|---|---|")
    for label, spent in seconds.most_common():
        if spent >= SMALL * total:
            print(f"| {label} | {spent:.1f} | {spent / total:.0%} |")


if __name__ == "__main__":
    main()
