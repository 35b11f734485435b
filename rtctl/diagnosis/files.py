"""The files of a diagnosis: `diagnosis.json`, `model-extended.toml`."""

from __future__ import annotations

import hashlib
import shlex
import sys
from pathlib import Path
from typing import Any

from rtctl import __version__
from rtctl.diagnosis.diagnose import Diagnosis
from rtctl.measured.dataset import Dataset
from rtctl.metrics import write_json
from rtctl.models.oscillator import write_oscillator_model


def write_diagnosis(folder: Path, found: Diagnosis, dataset: Dataset, model: Path) -> None:
    """The answer last: a folder with a diagnosis.json has all of it."""
    (folder / "diagnosis.json").unlink(missing_ok=True)
    folder.mkdir(parents=True, exist_ok=True)
    extended = found.model.model_copy(update={"provenance": _provenance(found, dataset, model)})
    write_oscillator_model(folder / "model-extended.toml", extended)
    write_json(folder / "diagnosis.json", found.json)


def _provenance(found: Diagnosis, dataset: Dataset, model: Path) -> dict[str, Any]:
    return {
        "dataset": dataset.name,
        "dataset_sha256": hashlib.sha256(dataset.path.read_bytes()).hexdigest(),
        "model": model.name,
        "model_sha256": hashlib.sha256(model.read_bytes()).hexdigest(),
        "verdict": found.verdict,
        "command": shlex.join(["rtctl", *sys.argv[1:]]),
        "version": __version__,
    }
