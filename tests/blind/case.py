"""One blind case from end to end: generated into a folder, diagnosed from its files alone, judged by the truth."""

from __future__ import annotations

import json
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any

from generator import OUTSIDE, Truth, generate

from rtctl.comparison import simulation_for
from rtctl.diagnosis.diagnose import Diagnosis, DiagnosisOptions, diagnose
from rtctl.measured import open_dataset, read_dataset
from rtctl.models.oscillator import read_oscillator_model
from rtctl.wiring import mechanism_ids


def run_case(seed: int, **overrides: Any) -> dict[str, Any]:
    """A JSON line: the truth, the answer, the judgement, processor time."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = generate(seed, folder, **overrides)
        line = _truth(truth)
        begin = time.process_time()
        try:
            line |= _answer(_diagnosed(folder), truth)
        except Exception:  # a crash is a result of the campaign, not its end
            line |= {"verdict": "crash", "causes": [], "error": traceback.format_exc()[-800:]}
        line["cpu_s"] = round(time.process_time() - begin, 2)
    return line | {"judgement": judged(line)}


def _diagnosed(folder: Path) -> Diagnosis:
    manifest, model = folder / "dataset.toml", folder / "model.toml"
    simulation = simulation_for(model, open_dataset(manifest))
    table = read_oscillator_model(model)
    return diagnose(
        read_dataset(manifest), table, simulation, mechanism_ids(table.kind), DiagnosisOptions(threads=1)
    )


def _truth(truth: Truth) -> dict[str, Any]:
    return {
        "seed": truth.seed,
        "kind": "null" if not truth.ids else "outside" if OUTSIDE in truth.ids
        else ("single", "pair")[len(truth.ids) - 1],
        "truth": list(truth.ids),
        "variant": [effect.variant for effect in truth.effects],
        "equivalent": list(truth.equivalent),
        "share": truth.share,
        "miss_over_noise": truth.refitted_miss_over_noise,
        "noise": truth.noise.kind,
        "snr_dB": truth.noise.snr_db,
        "quality": truth.quality,
        "samples": sum(len(record.measured) for record in truth.records if record.use == "fit"),
    }  # fmt: skip


def _answer(found: Diagnosis, truth: Truth) -> dict[str, Any]:
    return {
        "verdict": found.verdict,
        "causes": [
            {"id": one.id, "probability": one.probability, "or": list(one.indistinguishable_from)}
            for one in found.causes
        ],
        "p_value": found.search.chosen.p_value,
        "test_error_over_noise": found.gain.after / truth.noise.rms if found.gain else None,
    }


def judged(line: dict[str, Any]) -> str:
    """right | set (right within two names) | missed | part | false | wide (more than two names) | crash."""
    if line["verdict"] == "crash":
        return "crash"
    truth, same = set(line["truth"]), set(line["equivalent"])
    causes = [one for one in line["causes"] if not one["id"].startswith("parameter.")]
    names = {one["id"] for one in causes}
    if line["kind"] == "null":
        return "right" if line["verdict"] == "adequate" and not names else "false"
    if line["kind"] == "outside":
        return "right" if names <= same else "false"
    if not names:
        return "missed"
    if any(len(one["or"]) > 1 for one in causes):
        return "wide"
    if names == truth:
        return "right"
    if len(names) == len(truth) and _up_to_equivalents(causes, truth, same):
        return "set"
    return "part" if names < truth else "false"


def _up_to_equivalents(causes: list[dict[str, Any]], truth: set[str], same: set[str]) -> bool:
    """Each effect is named, or stands beside a name, or is one that describes the same outputs."""
    left = set(truth)
    for one in causes:
        hit = left & {one["id"], *one["or"]}
        if hit:
            left -= {hit.pop()}
        elif one["id"] not in same:
            return False
    return not left or len(left) == sum(one["id"] in same for one in causes)


def dump(line: dict[str, Any]) -> str:
    """One line of a campaign's file."""
    return json.dumps(line, default=float)
