"""Loops for other machines: `export_c`, `replay_export`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtctl.api.inputs import PathText, Settings, load_scenario, path_of
from rtctl.border.errors import InputError
from rtctl.border.options import check_integer

if TYPE_CHECKING:
    from rtctl.export.c.proof.comparison import Proof

LEAST_EXTREMA, MOST_EXTREMA = 8, 256


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportedLoop:
    """A loop that was written as C99."""

    folder: Path
    estimator: str
    """Kind of the estimator."""
    functions: int
    """Number of translated kernels."""
    state_bytes: int
    """Memory of the loop in single precision [byte]."""
    table_bytes: int
    """Tables of constants in single precision [byte]."""


def export_c(
    scenario: PathText | Mapping[str, Any],
    *,
    model: PathText | None = None,
    out: PathText,
    settings: Settings = (),
    extrema: int = 64,
) -> ExportedLoop:
    """Write the loop of a scenario as C99 for a microcontroller: estimator, controller, limits and guards.

    Args:
        scenario: A scenario's file, a bundled name such as "steps", or its tables.
        model: Model file; None: the one that the scenario names.
        out: Folder of the sources.
        settings: Further keys of the scenario to override.
        extrema: Turning points that each Preisach memory keeps; beyond them the innermost loop is forgotten.

    Returns:
        What was written.

    Raises:
        InputError: There is no model, or a part of the loop cannot be exported; says which, and why.
    """
    from rtctl.export.c.folder import Manifest, digest, write_folder
    from rtctl.export.c.laws.planning import law_of
    from rtctl.export.c.sizes import state_bytes, table_bytes
    from rtctl.export.c.translated import translated
    from rtctl.wiring import model_of, model_path

    check_integer("extrema", extrema, LEAST_EXTREMA, MOST_EXTREMA)
    loaded = load_scenario(scenario, settings)
    given = None if model is None else path_of("model", model)
    content = model_of(loaded.scenario, loaded.folder, given)
    file = model_path(loaded.scenario, loaded.folder, given)
    if content is None or file is None:
        raise InputError(
            "export c: a model is needed (--model MODEL.toml, or scenario.model); `rtctl identify` makes one"
        )
    exported = translated(law_of(loaded.scenario, content, extrema))
    folder = path_of("out", out)
    folder.mkdir(parents=True, exist_ok=True)
    write_folder(
        folder, exported,
        Manifest(
            scenario=loaded.name, estimator=exported.law.name, extrema=extrema, model_sha256=digest(file)
        ),
    )  # fmt: skip
    return ExportedLoop(
        folder=folder,
        estimator=exported.law.name,
        functions=len(exported.program.instances),
        state_bytes=state_bytes(exported.law),
        table_bytes=table_bytes(exported.law),
    )


def replay_export(run: PathText, export: PathText) -> Proof:
    """Compute a recorded run with an exported loop, on every machine whose tools are there, and compare the bits.

    Args:
        run: Folder of a run with the model and the scenario of the export.
        export: Folder of `export_c`.

    Raises:
        InputError: The folders do not belong together, or there is no compiler.
    """
    from rtctl.export.c.proof.comparison import prove

    return prove(path_of("export", export), path_of("run", run))
