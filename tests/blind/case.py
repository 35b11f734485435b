"""One blind case from end to end: generated into a folder, diagnosed from its files alone, judged by the truth."""

from __future__ import annotations

import json
import math
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from further import further
from generator import OUTSIDE, generate
from judge import judged
from least_bic import least_bic
from sindy import sindy

from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.search.request import DiagnosisOptions
from rtctl.diagnosis.thresholds import BudgetThresholds
from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
from rtctl.measured import open_dataset, read_dataset
from rtctl.models.vo2 import write_model
from rtctl.session.validation.model_validation import simulation_for
from rtctl.wiring_models import mechanism_ids

Line = dict[str, Any]
Told = Callable[[str, Line], None]


def run_case(
    seed: int,
    *,
    plant: str = "oscillator",
    baselines: bool = False,
    next_experiment: bool = False,
    report: Told = lambda stage, known: None,
    **overrides: Any,
) -> Line:
    """A JSON line: the truth, the answer, the judgement, processor time; `overrides` as `generate` has them.

    `told` hears which stage begins and what is known by then. `baselines`: what two other ways would answer.
    `next_experiment`: where several names are left, the proposed records and as many random ones are measured.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = generate(seed, folder, plant=plant, **overrides)
        line = known_of(truth)
        report("diagnose", line)
        begin, found = time.process_time(), None
        try:
            if plant == "vo2":
                identified(folder)
                line["identify_cpu_s"] = round(time.process_time() - begin, 2)
                begin = time.process_time()
            found = diagnosed(folder)
            line |= answer_of(found, truth)
        except Exception:  # a crash is a result of the campaign, not its end
            line |= {"verdict": "crash", "causes": [], "error": traceback.format_exc()[-800:]}
        line["cpu_s"] = round(time.process_time() - begin, 2)
        line["judgement"] = judged(line)
        if baselines and found is not None:
            report("baseline", line)
            line["bic"] = least_bic(found)
            if plant == "oscillator":
                nominal = found.search.nominal.hypothesis.simulation.parameters
                cubic = any(one.name == "stiffness_cubic" and one.value != 0.0 for one in nominal)
                line["sindy"] = sindy(found.problem, cubic=cubic)
        if next_experiment and found is not None:
            report("next experiment", line)
            again = further(found, folder, seed, plant, overrides, lambda where: _again(where, truth))
            line |= {"next": again} if again else {}
    return line


def identified(folder: Path) -> None:
    """The model of a vo2's staircases, as `rtctl identify` makes it, into `folder`.

    With few plays from one start: the Preisach models and the time constant, all that a diagnosis takes, do not see it.
    """
    options = Vo2FitOptions(plays=2, starts=1)
    model = identify_vo2(read_dataset(folder / "dataset.toml"), options, lambda text: None)
    write_model(model, folder / "model.toml")


def diagnosed(folder: Path, work: float = BudgetThresholds().search, **options: Any) -> Diagnosis:
    """Diagnose as `rtctl diagnose` does, on one core."""
    manifest, path = folder / "dataset.toml", folder / "model.toml"
    simulation = simulation_for(path, open_dataset(manifest))
    return diagnose(
        read_dataset(manifest), subject_of(simulation.kind).read_model(path), simulation,
        mechanism_ids(simulation.kind),
        DiagnosisOptions(threads=1, work=work, **options),
    )  # fmt: skip


def diagnosed_without_budget(folder: Path) -> Line:
    """The content of diagnosis.json where no budget ends a search."""
    return diagnosed(folder, work=math.inf).json


def known_of(truth: Any) -> Line:
    """What the generator knows."""
    noises = getattr(truth, "noises", None) or {"": truth.noise}
    return {
        "plant": truth.plant,
        "seed": truth.seed,
        "kind": "null" if not truth.ids else "outside" if OUTSIDE in truth.ids
        else ("single", "pair")[len(truth.ids) - 1],
        "truth": list(truth.ids),
        "variant": [effect.variant for effect in truth.effects],
        "equivalent": list(truth.equivalent),
        "share": truth.share,
        "miss_over_noise": truth.refitted_miss_over_noise,
        "noise": " + ".join(noise.kind for noise in noises.values()),
        "snr_dB": truth.noise.snr_db,
        "quality": getattr(truth, "quality", None),
        "fit_records": sum(record.use == "fit" for record in truth.records),
        "samples": sum(len(record.drive) for record in truth.records if record.use == "fit"),
    }  # fmt: skip


def answer_of(found: Diagnosis, truth: Any) -> Line:
    """What the diagnosis says."""
    return {
        "verdict": found.verdict,
        "causes": [
            {"id": one.id, "probability": one.probability, "or": list(one.indistinguishable_from)}
            for one in found.causes
        ],
        "p_value": found.search.chosen.p_value,
        "test_error_over_noise": found.gain.after / _noise(truth, found.gain.output) if found.gain else None,
    }


def _noise(truth: Any, output: str) -> float:
    """True rms of an output's noise, in its unit."""
    noises = getattr(truth, "noises", None)
    return float((noises[output] if noises else truth.noise).rms)


def _again(folder: Path, truth: Any) -> Line:
    """The judged answer on a folder that one more record was added to."""
    line = known_of(truth) | answer_of(diagnosed(folder), truth)
    return {"verdict": line["verdict"], "causes": line["causes"], "judgement": judged(line)}


def dump(line: Line) -> str:
    """One line of a campaign's file."""
    return json.dumps(line, default=float)
