"""Calibration of the gate: p-values of every test on cases with nothing hidden, by noise, Q, length; resumable.

Only the re-fitted nominal model is examined, not the whole search, so a case takes seconds.

python tests/blind/calibration.py --seeds 100400-100549 --samples 3000 --out out/calibration
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from generator import Truth, generate

from rtctl.diagnosis.nominal_fit.step_refinement import refine_nominal
from rtctl.diagnosis.nominal_fit.whole_record_start import fit_from_starts
from rtctl.diagnosis.problem.hypothesis import Hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis, run_residual_tests
from rtctl.diagnosis.screening.split import split_records
from rtctl.identification.scales import estimate_scales
from rtctl.measured import open_dataset, read_dataset
from rtctl.session.validation.model_validation import simulation_for
from rtctl.wiring_models import mechanism_ids

Line = dict[str, Any]
LEVELS = (0.01, 0.05, 0.20)


def main(arguments: Sequence[str] | None = None) -> int:
    """Examine what is missing, then write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="100200-100349", help="first-last, both included")
    parser.add_argument("--out", type=Path, default=Path("out/calibration"), help="folder of the cases")
    parser.add_argument("--kind", default="null", choices=("null", "single"))
    parser.add_argument("--samples", type=int, help="of the longest record; else as drawn")
    parser.add_argument("--share", type=float, nargs=2, help="of the response that a hidden effect makes")
    asked = parser.parse_args(arguments)
    first, last = (int(part) for part in asked.seeds.split("-"))
    asked.out.mkdir(parents=True, exist_ok=True)
    path = asked.out / f"{asked.kind}.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done = {line["seed"]: line for line in lines}
    overrides: Line = {"kind": asked.kind, "samples": asked.samples}
    overrides |= {"share": tuple(asked.share)} if asked.share else {}
    with path.open("a", encoding="utf-8") as file:
        for seed in range(first, last + 1):
            if seed not in done:
                done[seed] = examined_case(seed, overrides)
                file.write(json.dumps(done[seed], default=float) + "\n")
                file.flush()
                print(f"\rseed {seed} p {done[seed]['p_value']:.3g}   ", end="", file=sys.stderr)
    table = tables([done[seed] for seed in range(first, last + 1)])
    (asked.out / f"{asked.kind}.md").write_text(table, encoding="utf-8")
    print(f"\n{table}")
    return 0


def examined_case(seed: int, overrides: Line) -> Line:
    """A JSON line: what was drawn, and the p-value of each test."""
    begin = time.process_time()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = generate(seed, folder, **overrides)
        found, data = examined(folder)
    noise = [float(np.sqrt(model.power(4096).mean())) for model in found.noise]
    shift = np.abs(found.projected.shift / np.maximum(found.projected.standard_errors, 1e-300))
    return _drawn(truth) | {
        "p_value": found.p_value,
        "tests": {_kind(test.name): test.p_value for test in found.tests},
        "sharpest": min(found.tests, key=lambda test: test.p_value).name,
        "noise_over_truth": noise[0] / truth.noise.rms,
        "order": len(found.noise[0].coefficients),
        "shift": float(shift.max(initial=0.0)),
        "directions": len(found.directions),
        "samples": found.projected.samples,
        "records": len(data.records),
        "cpu_s": round(time.process_time() - begin, 2),
    }


def examined(folder: Path) -> tuple[TestedHypothesis, Problem]:
    """The re-fitted nominal model of the files in `folder`, examined as `rtctl diagnose` does."""
    nominal, data = nominal_of(folder)
    return run_residual_tests(nominal, data, mechanism_ids(nominal.simulation.kind)), data


def nominal_of(folder: Path) -> tuple[Hypothesis, Problem]:
    """The nominal model re-fitted to the files in `folder`."""
    manifest, model = folder / "dataset.toml", folder / "model.toml"
    simulation = simulation_for(model, open_dataset(manifest))
    subject = subject_of(simulation.kind)
    fit, _, _ = split_records(read_dataset(manifest), subject)
    data = Problem(
        subject=subject,
        records=fit,
        scales=estimate_scales(fit, subject.output, subject.drive),
        steps_per_period=subject.steps_per_period,
    )
    nominal = fit_from_starts(data, simulation, ())
    if nominal is None:
        raise RuntimeError(f"the nominal model diverges on {folder}")
    data, nominal = refine_nominal(data, nominal)
    return nominal, data


def _drawn(truth: Truth) -> Line:
    return {
        "seed": truth.seed,
        "truth": list(truth.ids),
        "miss_over_noise": truth.refitted_miss_over_noise,
        "noise": truth.noise.kind,
        "snr_dB": truth.noise.snr_db,
        "quality": truth.quality,
        "bistable": truth.parameters["stiffness"].value < 0.0,
        "excitations": [record.excitation for record in truth.records if record.use == "fit"],
    }


def _kind(name: str) -> str:
    return "each mechanism alone" if name.endswith(" alone") else name


def tables(lines: Sequence[Line]) -> str:
    """Share of cases under each level, of all tests together and of each, by what was drawn."""
    groups: list[tuple[str, Callable[[Line], bool]]] = [("all", lambda line: True)]
    for noise in sorted({line["noise"] for line in lines}):
        groups.append((f"noise {noise}", lambda line, noise=noise: line["noise"] == noise))  # type: ignore[misc]
    groups += [
        ("Q under 30", lambda line: line["quality"] < 30.0),
        ("Q 30 to 150", lambda line: 30.0 <= line["quality"] < 150.0),
        ("Q above 150", lambda line: line["quality"] >= 150.0),
        ("under 12 000 samples", lambda line: line["samples"] < 12_000),
        ("12 000 samples and more", lambda line: line["samples"] >= 12_000),
        ("bistable", lambda line: line["bistable"]),
    ]
    rows = [(name, *_shares([x["p_value"] for x in lines if chosen(x)])) for name, chosen in groups]
    for test in sorted({name for line in lines for name in line["tests"]}):
        rows.append((f"test: {test}", *_shares([x["tests"][test] for x in lines if test in x["tests"]])))
    head = ("cases", "number", *(f"p under {level:g}" for level in LEVELS))
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, ("---",) * len(head), *rows)) + "\n"


def _shares(values: Sequence[float]) -> Iterator[str]:
    yield str(len(values))
    for level in LEVELS:
        yield f"{100.0 * np.mean(np.array(values) < level):.1f} %" if values else "-"


if __name__ == "__main__":
    raise SystemExit(main())
