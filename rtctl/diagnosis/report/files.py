"""The files of a diagnosis: `model-extended.toml`, `next-experiment.toml`, `report.html`, `diagnosis.json`."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from rtctl.diagnosis.experiment_design.next_experiment import NextExperiment
from rtctl.diagnosis.report.page.html_report import report_page
from rtctl.diagnosis.report.rehearsed_device import mechanisms_without_device, write_without_mechanisms
from rtctl.diagnosis.result import EXTENDED_MODEL, Diagnosis
from rtctl.evaluation.metrics import write_json
from rtctl.measured.dataset import Dataset
from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import mark_of, refuse_foreign
from rtctl.version import __version__

REHEARSED_MODEL = "next-experiment-model.toml"
"""The re-fitted model on which a next experiment is rehearsed where there is no extended one."""
EXPERIMENT = "next-experiment.toml"
COMMAND = "diagnose"
NAMES = ("diagnosis.json", "report.html", EXTENDED_MODEL, EXPERIMENT, REHEARSED_MODEL)
HEAD = """# {statement}
# Written by {mark}; `rtctl acquire next-experiment.toml --out DIR` plays it as it stands on {device} beside
# it, as a rehearsal. On the device: --set driver.kind=modbus-tcp --set driver.address=HOST:PORT
"""
PLAYS = "`rtctl acquire {scenario} --out {folder}` plays it."
BY_HAND = (
    "Play it as you played the drive of these data, record it, and begin again with rtctl init on the new file. "
    "`rtctl acquire {scenario} --out {folder}` rehearses it on the model: the drive in its records is what to play."
)
READS_DISPLACEMENT = (
    "# The rehearsing device reads the displacement, your records have the {0}: "
    "on the bench record the {0} again.\n"
)
LACKS = (
    "# The rehearsing device leaves out {}: it takes one sample after the other, and holds each command.\n"
)


def write_diagnosis(folder: Path, diagnosis: Diagnosis, dataset: Dataset, provenance: dict[str, Any]) -> None:
    """Write all files of an answer, `diagnosis.json` last: a folder that has it is complete and holds nothing older.

    The extended model is written only where causes are claimed and reduce the error on test records with certainty.
    """
    folder.mkdir(parents=True, exist_ok=True)
    check_folder(folder)
    for name in NAMES:
        (folder / name).unlink(missing_ok=True)
    model = REHEARSED_MODEL if diagnosis.withheld else EXTENDED_MODEL
    if not diagnosis.withheld or diagnosis.next_experiment is not None:
        diagnosis.problem.subject.write_model(folder / model, diagnosis.model, provenance)
    if diagnosis.next_experiment is not None:
        device, left_out = _rehearsed(folder, model, diagnosis.problem.subject.kind)
        text = scenario_text(diagnosis.next_experiment, device, left_out, dataset.units)
        _write_text(folder / EXPERIMENT, text)
    _write_text(folder / "report.html", report_page(diagnosis, dataset, provenance, how_to_play(dataset)))
    write_json(folder / "diagnosis.json", diagnosis.json | {"provenance": provenance}, COMMAND)


def check_folder(folder: Path) -> None:
    """Raise InputError where a file of an answer is there that no diagnosis wrote."""
    for name in NAMES:
        refuse_foreign(folder / name, COMMAND)


def how_to_play(dataset: Dataset, folder: Path = Path(), out: str = "DIR") -> str:
    """Return how the next experiment is played: by rtctl acquire, which recorded the data, else by the user's means."""
    text = PLAYS if dataset.is_acquired else BY_HAND
    return text.format(scenario=folder / EXPERIMENT, folder=out)


def _rehearsed(folder: Path, model: str, kind: str) -> tuple[str, tuple[str, ...]]:
    """Return the model file of the device that rehearses, and the mechanisms that it lacks and the model has."""
    left_out = mechanisms_without_device(folder / model, kind)
    if not left_out:
        return model, ()
    write_without_mechanisms(folder / model, folder / REHEARSED_MODEL, left_out)
    return REHEARSED_MODEL, left_out


def scenario_text(
    proposed: NextExperiment,
    device: str = EXTENDED_MODEL,
    left_out: tuple[str, ...] = (),
    units: Mapping[str, str] | None = None,
) -> str:
    """Return the scenario of the next experiment, as `rtctl acquire` takes it.

    Args:
        proposed: The experiment.
        device: Model file of the device that rehearses it.
        left_out: Mechanisms that this device lacks and the diagnosed model has.
        units: Units of the dataset's signals, by name: of those that the device does not read, the text says so.
    """
    heading = dict(proposed.scenario["scenario"])
    if heading.pop("channels", None):  # those of the model
        heading["model"] = device
    driver = {**proposed.scenario["driver"], "device": device}
    scenario = {**proposed.scenario, "scenario": heading, "driver": driver}
    head = HEAD.format(statement=proposed.statement, device=device, mark=mark_of(COMMAND))
    if left_out:
        head += LACKS.format(", ".join(left_out))
    measured = [name for name in ("velocity", "acceleration") if name in (units or {})]
    if "displacement_unit" in heading and measured and "displacement" not in (units or {}):
        head += READS_DISPLACEMENT.format(measured[0])
    return head + "\n" + tomli_w.dumps(scenario)


def provenance_of(diagnosis: Diagnosis, dataset: Dataset, model: Path, command: str) -> dict[str, Any]:
    """Return what the model file and the page state of their origin."""
    files = sorted({record.file for record in dataset.records if record.file})
    return {
        "dataset": dataset.name,
        "sha256": {name: _sha256(dataset.path.parent / name) for name in [dataset.path.name, *files]},
        "model": model.name,
        "model_sha256": _sha256(model),
        "verdict": diagnosis.verdict,
        "fitted_records": [record.name for record in diagnosis.problem.records],
        "test_records": list(dict.fromkeys(record.name for record in diagnosis.tests)),
        "command": command,
        "version": __version__,
    }


def _write_text(path: Path, text: str) -> None:
    with replacing(path, COMMAND) as partial:
        partial.write_text(text, encoding="utf-8")


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
