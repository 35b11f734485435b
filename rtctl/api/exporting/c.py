"""Loops for other machines: `export_c`, `replay_export`, `run_on_board`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtctl.api.inputs import LoadedScenario, PathText, Settings, load_scenario, path_of
from rtctl.api.model import Model, file_of
from rtctl.api.runs.running import Run
from rtctl.border.errors import Fault, InputError
from rtctl.border.options import check_integer
from rtctl.output.progress import Progress, reporter

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


# 8 parameters because each is an option of `rtctl export c`
def export_c(  # noqa: PLR0913
    scenario: PathText | Mapping[str, Any],
    *,
    model: Model | PathText | None = None,
    out: PathText,
    settings: Settings = (),
    extrema: int = 64,
    force: bool = False,
    progress: Progress = False,
) -> ExportedLoop:
    """Write the loop of a scenario as C99 for a microcontroller: estimator, controller, limits and guards.

    Args:
        scenario: A scenario's file, a bundled name such as "steps", or its tables.
        model: A model or its file; None: the one that the scenario names.
        out: Folder of the sources.
        settings: Further keys of the scenario to override.
        extrema: Turning points that each Preisach memory keeps; beyond them the innermost loop is forgotten.
        force: Whether sources of any origin in `out` are overwritten; else those of an earlier export alone.
        progress: True prints what is under way, a callable hears (text, None).

    Returns:
        What was written.

    Raises:
        InputError: There is no model, or a part of the loop cannot be exported; says which, and why; or `out`
            holds files of another origin.
    """
    from rtctl.export.c.folder import Manifest, digest, digest_of_numbers, refuse_foreign_folder, write_folder
    from rtctl.export.c.laws.planning import law_of
    from rtctl.export.c.sizes import state_bytes, table_bytes
    from rtctl.export.c.translated import translated
    from rtctl.wiring import model_of, model_path

    folder = path_of("out", out)
    if not force:
        refuse_foreign_folder(folder)
    check_integer("extrema", extrema, LEAST_EXTREMA, MOST_EXTREMA)
    loaded = load_scenario(scenario, settings)
    with file_of(model) as given:
        content = model_of(loaded.scenario, loaded.folder, given)
        file = model_path(loaded.scenario, loaded.folder, given)
        if content is None or file is None:
            raise InputError(
                "export c: a model is needed (--model MODEL.toml, or scenario.model); `rtctl identify` makes one"
            )
        model_sha256 = digest(file)
    reporter(progress).say(f"translating the loop of {loaded.name}")
    exported = translated(law_of(loaded.scenario, content, extrema))
    folder.mkdir(parents=True, exist_ok=True)
    write_folder(
        folder, exported,
        Manifest(
            scenario=loaded.name, estimator=exported.law.name, extrema=extrema, model_sha256=model_sha256,
            numbers_sha256=digest_of_numbers(exported.law),
        ),
    )  # fmt: skip
    return ExportedLoop(
        folder=folder,
        estimator=exported.law.name,
        functions=len(exported.program.instances),
        state_bytes=state_bytes(exported.law),
        table_bytes=table_bytes(exported.law),
    )


# 8 parameters because each is an option of `rtctl run --on`
def run_on_board(  # noqa: PLR0913
    scenario: PathText | Mapping[str, Any],
    *,
    board: PathText,
    model: Model | PathText | None = None,
    out: PathText,
    settings: Settings = (),
    plot: bool = True,
    progress: Progress = False,
) -> Run:
    """Run a scenario with the loop on the emulated Cortex-M4F; this computer gives it the plan and watches.

    Args:
        scenario: A scenario's file, a bundled name such as "steps", or its tables; its driver is a serial line with a
            device in lockstep.
        board: Folder of `export_c`, of the same scenario and model.
        model: A model or its file; None: the one that the scenario names.
        out: Folder of the results: `summary.json`, `signals.parquet`, `run.png`; a run that it holds is moved aside.
        settings: Further keys of the scenario to override.
        plot: Whether the folder gets a picture of the run.
        progress: True prints what is under way, a callable hears (text, None).

    Returns:
        The run, recorded in `out`; nothing is known of the times of single samples (`Run.timing` is empty).

    Raises:
        InputError: The driver is no serial line, the folders do not belong together, compiler or emulator are missing.
    """
    from rtctl.evaluation.metrics import write_json
    from rtctl.export.c.emulated import run_emulated
    from rtctl.recording import write_parquet
    from rtctl.session.run_files import draw_run
    from rtctl.session.run_folder import check_run_folder, set_finished_aside

    loaded = load_scenario(scenario, settings)
    place, port = path_of("board", board), getattr(loaded.scenario.driver, "port", None)
    if loaded.scenario.driver.kind != "serial" or port is None or loaded.scenario.clock.mode != "lockstep":
        raise InputError(
            "run --on: the board reaches its device over a serial line in lockstep: --set driver.kind=serial --set "
            "driver.port=PATH (such as that of `rtctl serve vo2_a --serial PATH`)"
        )
    if len(loaded.scenario.profile.commands) > 1:
        raise InputError(
            "run --on: the board's program of a serial line is for one command and one reading; "
            f"this device has {len(loaded.scenario.profile.commands)} commands"
        )
    content = _exported_model(loaded, model, place)
    folder = path_of("out", out)
    check_run_folder(folder)
    reporter(progress).say(f"{loaded.name}: on the emulated board, with the device at {port}")
    result = run_emulated(place, loaded.scenario, content, str(port)).result
    folder.mkdir(parents=True, exist_ok=True)
    set_finished_aside(folder)
    write_parquet(
        folder / "signals.parquet",
        result.signals,
        result.units,
        {"board": str(place)},
        "run",
    )
    write_json(folder / "summary.json", result.summary, "run")
    if plot and len(result.signals["index"]) > 1:
        draw_run(folder / "run.png", loaded.scenario, result)
    ended = next((one for one in reversed(result.summary["faults"]) if not one.get("rearmed")), None)
    return Run(
        scenario=loaded.scenario, summary=result.summary, fault=None if ended is None else Fault(ended["fault"]),
        message="" if ended is None else ended["message"], folder=folder, _result=result, _tables=loaded.tables,
    )  # fmt: skip


def _exported_model(loaded: LoadedScenario, model: Model | PathText | None, board: Path) -> Any:
    """Return the content of the model of a run. Raises InputError where the loop was exported from another one."""
    from rtctl.export.c.folder import check_origin, digest, read_manifest
    from rtctl.export.c.laws.planning import law_of
    from rtctl.wiring import model_of, model_path

    with file_of(model) as given:
        content = model_of(loaded.scenario, loaded.folder, given)
        file = model_path(loaded.scenario, loaded.folder, given)
        manifest = read_manifest(board)
        if content is None or file is None or manifest.model_sha256 != digest(file):
            raise InputError(f"{board}: exported from another model than that of the run; export it anew")
    check_origin(board, manifest, law_of(loaded.scenario, content, manifest.extrema))
    return content


def replay_export(run: PathText, export: PathText, *, progress: Progress = False) -> Proof:
    """Compute a recorded run with an exported loop, on every machine whose tools are there, and compare the bits.

    Args:
        run: Folder of a run with the model and the scenario of the export.
        export: Folder of `export_c`.
        progress: True prints what is under way, a callable hears (text, None).

    Raises:
        InputError: The folders do not belong together, or there is no compiler.
    """
    from rtctl.export.c.proof.comparison import prove

    folder, recorded = path_of("export", export), path_of("run", run)
    reporter(progress).say(f"computing {recorded} with the loop of {folder} on every machine that is here")
    return prove(folder, recorded)
