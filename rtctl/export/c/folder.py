"""The folder of an exported loop: sources, boards, Makefile, and what it was made from."""

from __future__ import annotations

import hashlib
import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rtctl.border.errors import InputError
from rtctl.export.c.laws.law import Law
from rtctl.export.c.printing import c_program
from rtctl.export.c.translated import Translated
from rtctl.output.own_files import is_written_by, mark_of
from rtctl.translation.c99.arithmetic import ARITHMETIC
from rtctl.translation.c99.tables import first_value_lines
from rtctl.version import __version__
from rtctl.wiring_served import write_boards

RUNTIME = Path(__file__).parent / "runtime"
MANIFEST, MODEL, SCENARIO = "export.json", "model.toml", "scenario.toml"


COMMAND = "export c"


def refuse_foreign_folder(folder: Path) -> None:
    """Raise InputError where a folder holds files and no exported loop: its sources have names that others have too."""
    own = (folder / MANIFEST).is_file() and is_written_by(folder / MANIFEST, COMMAND)
    if folder.is_dir() and any(folder.iterdir()) and not own:
        raise InputError(f"{folder}: is not empty, and holds no exported loop; choose a new folder")


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """What a folder was exported from."""

    scenario: str
    """Name of the scenario."""
    estimator: str
    extrema: int
    """Turning points that a Preisach memory keeps."""
    model_sha256: str
    """Of the model file."""
    numbers_sha256: str
    """Of all numbers of the loop: constants, gains, limits, times."""


def write_folder(folder: Path, exported: Translated, manifest: Manifest) -> None:
    """Write all files; what is there of them is replaced.

    Args:
        folder: the folder; made if it is not there.
        exported: the law.
        manifest: what it is made from.
    """
    law, program, entry = exported
    heading = (
        f"Loop of the scenario {manifest.scenario}, estimator {manifest.estimator}, "
        f"written by rtctl export c {__version__}."
    )
    shutil.copytree(
        RUNTIME, folder, ignore=shutil.ignore_patterns("__pycache__", "build"), dirs_exist_ok=True
    )
    shutil.copy(ARITHMETIC, folder / ARITHMETIC.name)
    write_boards(folder)
    if (
        law.output.of("level_2") is not None
    ):  # the program of the serial line is for one command and one reading
        for name in ("loop.c", "link.c", "link.h"):
            (folder / "boards" / name).unlink()
    files = {
        "rtctl.h": c_program.header(law, heading),
        "rtctl_types.h": c_program.types(program),
        "rtctl_tables.h": c_program.tables(law, heading),
        "rtctl.c": c_program.functions(
            law, program, entry, f"{heading}\nTranslated from the kernels of rtctl."
        ),
    }
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    contents: dict[str, Any] = {
        "program": mark_of(COMMAND),
        "scenario": manifest.scenario,
        "estimator": manifest.estimator,
        "extrema": manifest.extrema,
        "model_sha256": manifest.model_sha256,
        "numbers_sha256": manifest.numbers_sha256,
        "sources": dict(law.sources),
    }
    (folder / MANIFEST).write_text(json.dumps(contents, indent=2) + "\n", encoding="utf-8")


def read_manifest(folder: Path) -> Manifest:
    """Return what a folder was made from. Raises InputError."""
    path = folder / MANIFEST
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        return Manifest(
            scenario=str(found["scenario"]),
            estimator=str(found["estimator"]),
            extrema=int(found["extrema"]),
            model_sha256=str(found["model_sha256"]),
            numbers_sha256=str(found["numbers_sha256"]),
        )
    except OSError:
        raise InputError(f"{path}: missing; {folder} is not a folder of rtctl export c") from None
    except (ValueError, KeyError) as error:
        raise InputError(f"{path}: {error}; export the folder anew") from None


def check_origin(folder: Path, manifest: Manifest, law: Law) -> None:
    """Refuse a loop of other numbers than those of a run: its gains, limits or times would be another scenario's.

    Args:
        folder: the exported folder.
        manifest: what it was made from.
        law: the loop of the run.

    Raises:
        InputError: their numbers differ.
    """
    if manifest.numbers_sha256 != digest_of_numbers(law):
        raise InputError(
            f'{folder}: exported from the scenario "{manifest.scenario}", whose gains, limits or times are not those '
            "of this run; export the run's scenario, with the same --set"
        )


def digest_of_numbers(law: Law) -> str:
    """Return the digest of all numbers of a loop, as they are written."""
    lines = [c_program.tables(law, ""), *first_value_lines(law.memory)]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def digest(model: Path) -> str:
    """Return the digest of a model file."""
    return hashlib.sha256(model.read_bytes()).hexdigest()
