"""A scenario in closed or open loop: `run` and its `Run`."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rtctl.api.inputs import LoadedScenario, PartTable, PathText, Settings, driver_of, load_scenario, path_of
from rtctl.api.model import Model, file_of
from rtctl.api.runs.errors import ErrorFigures, OutputErrors, error_figures, errors_of_outputs
from rtctl.api.runs.watching import watched_run
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import Fault, InputError
from rtctl.extras import require
from rtctl.output.dataframes import data_frame
from rtctl.output.interrupt import stop_on_interrupt
from rtctl.output.notebook import html_table, number
from rtctl.output.own_files import refuse_foreign
from rtctl.output.progress import Progress, Reporter, reporter

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from rtctl.border.records import Driver
    from rtctl.interfaces import Controller, Estimator
    from rtctl.scenario.schema import Scenario
    from rtctl.session.run_files import RunResult


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Run:
    """What a run recorded, and how well it went."""

    scenario: Scenario
    """As it was run, overrides included."""
    summary: Mapping[str, Any]
    """Errors, checks, timing and faults: the content of `summary.json`."""
    fault: Fault | None
    """Why the run ended before its time; `Fault.INTERRUPTED` after Ctrl-C; None: it did not."""
    message: str
    """What the fault was, in words."""
    folder: Path | None
    """Where it was recorded; None: in memory."""
    _result: RunResult
    _tables: Mapping[str, Any]

    @property
    def signals(self) -> Mapping[str, FloatArray]:
        """Recorded signals by name, (n,) each, a value a step, in `units`."""
        return self._result.signals

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of each signal."""
        return self._result.units

    @property
    def time_s(self) -> FloatArray:
        """Time of each step since the first one [s], (n,)."""
        times: FloatArray = self.scenario.scenario.period_s * np.asarray(
            self.signals["index"], dtype=np.float64
        )
        return times

    @property
    def timing(self) -> Mapping[str, FloatArray]:
        """Lateness, round trip and computing time of each step [us], (n,) each."""
        return self._result.timing

    @property
    def tuning(self) -> str | None:
        """Gains and margins in one sentence; None where nothing was tuned."""
        return None if self._result.tuning is None else self._result.tuning.describe()

    @property
    def passed(self) -> bool:
        """Whether the run met the checks of its scenario."""
        return bool(self.summary["verdict"] == "pass")

    @property
    def tracking(self) -> ErrorFigures:
        """How far the output was off the set-point, by the device's reference instrument."""
        return error_figures(self.summary["tracking"])

    @property
    def self_sensing(self) -> ErrorFigures:
        """How far the estimate was off the output, by the device's reference instrument."""
        return error_figures(self.summary["self_sensing"])

    @property
    def outputs(self) -> Mapping[str, OutputErrors]:
        """Errors of each output by its name, in its unit, where the scenario has [references]; else empty."""
        return errors_of_outputs(self.summary)

    def plot(self) -> Figure:
        """Return the figure of the run: does it follow, how far off is it, what did it command and sense."""
        require("matplotlib", "Run.plot")
        from rtctl.evaluation.summary import range_of
        from rtctl.plots.run import run_figure
        from rtctl.session.run_files import marks_of

        if len(self.signals["index"]) < 2:
            raise InputError(f"{self.scenario.scenario.title}: a run of fewer than two steps has no figure")
        return run_figure(
            self.time_s,
            self.signals,
            title=self.scenario.scenario.title,
            closed_loop=self.scenario.reference is not None,
            output_range=range_of(self.summary, self.scenario.profile.reference.unit),
            profile=self.scenario.profile,
            marks=marks_of(self.scenario, self._result.changes),
        )

    def to_dataframe(self) -> pd.DataFrame:
        """Return the signals as a pandas table, a row a step at `time_s`, with their units in `attrs["units"]`.

        Raises:
            InputError: pandas is not installed (`pip install 'rtctl[pandas]'`).
        """
        return data_frame(self.signals, self.time_s, "time_s", self.units, "Run.to_dataframe")

    def save(self, folder: PathText) -> Path:
        """Write recordings, `summary.json` and `run.png` into a folder."""
        from rtctl.session.run_files import write_run

        target = path_of("folder", folder)
        target.mkdir(parents=True, exist_ok=True)
        write_run(target, self.scenario, self._tables, self._result)
        return target

    def __repr__(self) -> str:
        from rtctl.evaluation.summary import verdict_in_words

        ended = "" if self.fault is None else f", ended by {self.fault}"
        steps = len(self.signals["index"])
        return (
            f"<Run of {self.scenario.scenario.title}: {verdict_in_words(self.summary)}, {steps} steps{ended}>"
        )

    def _repr_html_(self) -> str:
        from rtctl.evaluation.summary import verdict_in_words

        errors = {"tracking": self.tracking, "self-sensing": self.self_sensing}
        rows = [
            [
                name,
                f"{number(one.mean_abs, one.unit)} ({number(one.mean_abs_percent, '%')})",
                f"{number(one.max_abs, one.unit)} ({number(one.max_abs_percent, '%')})",
            ]
            for name, one in errors.items()
        ]
        title = f"{self.scenario.scenario.title}: {verdict_in_words(self.summary)}"
        notes = [text for text in (self.tuning, self.message) if text]
        return html_table(title, ["error", "mean absolute (of range)", "largest (of range)"], rows, notes)


# 9 parameters because each part of a loop can be exchanged
def run(  # noqa: PLR0913
    scenario: PathText | Mapping[str, Any],
    *,
    model: Model | PathText | None = None,
    driver: str | Mapping[str, Any] | Driver | None = None,
    controller: str | Mapping[str, Any] | Controller | type | Callable[..., Controller] | None = None,
    estimator: str | Mapping[str, Any] | Estimator | type | Callable[..., Estimator] | None = None,
    settings: Settings = (),
    out: PathText | None = None,
    plot: bool = True,
    progress: Progress = False,
) -> Run:
    """Play a scenario in closed loop, or in open loop where it has excitations, and score it.

    Args:
        scenario: A scenario's file, a bundled name such as "steps", or its tables.
        model: A model or its file; None: the one that the scenario names, else a VO2 device is identified first.
        driver: A kind such as "modbus-tcp", a mapping of the keys of [driver], or a driver of your own.
        controller: A kind, a mapping of the keys of [controller], or a class or object of your own; with options,
            `{"kind": MyController, "rate": 4.0}`.
        estimator: The same of [estimator].
        settings: Further keys of the scenario to override, such as `{"scenario.duration": "2 s"}`.
        out: Folder into which the run records while it lasts; None: into memory.
        plot: Whether the folder gets a picture of the run.
        progress: True shows set-point, estimate, error and lateness while it runs (a bar where it records into memory),
            a callable hears (text, share that is done or None).

    Returns:
        The run; Ctrl-C ends it after the exchange under way and gives what was recorded by then.

    Raises:
        InputError: Scenario or model are wrong, no device is at the port, or a file of another origin is in the way.
        RunError: The identification of the device failed.
    """
    from rtctl.scenario.command_sequence import steps_of
    from rtctl.session.run_folder import check_run_folder

    folder, report = None if out is None else path_of("out", out), reporter(progress)
    if folder is not None:
        check_run_folder(folder)
    own = driver_of(driver)
    parts: dict[PartTable, Any] = {
        "driver": None if own is not None else driver, "controller": controller, "estimator": estimator,
    }  # fmt: skip
    loaded = load_scenario(scenario, settings, parts)
    device = own or _driver(loaded)
    title = loaded.scenario.scenario.title
    with ExitStack() as stack:
        given = stack.enter_context(file_of(model))
        place = folder or Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="rtctl-")))
        if folder is None:
            stop = stack.enter_context(watched_run(title, steps_of(loaded.scenario), report))
        else:  # its recording tells how it goes
            stop = stack.enter_context(stop_on_interrupt())
        content, file, identified = _model(loaded, given, device, place, stop, report)
        if identified and own is None:
            device = _driver(loaded)  # the first one was closed after the identification
        return _track(loaded, content, file, device, folder, stop, report, plot=plot)


# 8 parameters because all parts of a run meet here
def _track(  # noqa: PLR0913
    loaded: LoadedScenario, model: Any, file: Path | None, device: Driver, folder: Path | None, stop: Any,
    report: Reporter, *, plot: bool,
) -> Run:  # fmt: skip
    """Run the loop with all parts known, and write the files of a run that has a folder."""
    from rtctl.loop.live_parameters import ParameterChannel
    from rtctl.models.provenance import doubt_of_model
    from rtctl.session.closed_loop import track
    from rtctl.session.rest import begins_too_early
    from rtctl.session.run_files import write_run
    from rtctl.session.run_folder import RunFolder, run_metadata
    from rtctl.wiring import unused_extensions

    if unused := unused_extensions(loaded.scenario, model):
        report.say(f"does not change the loop: {', '.join(unused)}")
    if file is not None and (doubt := doubt_of_model(file)):
        report.say(doubt)
    if early := begins_too_early(loaded.scenario, model):
        report.say(early)
    changes, run_folder = ParameterChannel(), None
    if folder is not None:
        metadata = run_metadata(loaded.tables)
        run_folder = RunFolder(
            path=folder, metadata=metadata, model=file, report=report.say, is_announced=True,
            keeps_earlier=True,
        )  # fmt: skip
    with _listening(folder, changes), _telling(folder, loaded, report):
        result, outcome = track(loaded.scenario, model, device, stop, run_folder, changes)
    if folder is not None:
        write_run(folder, loaded.scenario, loaded.tables, result, plot=plot)
    return Run(
        scenario=loaded.scenario, summary=result.summary, fault=outcome.fault, message=outcome.message, folder=folder,
        _result=result, _tables=loaded.tables,
    )  # fmt: skip


def _model(
    loaded: LoadedScenario, given: Path | None, device: Driver, folder: Path, stop: Any, report: Reporter
) -> tuple[Any, Path | None, bool]:
    """Return the model that the loop uses, its file, and whether the device was identified for it."""
    from rtctl.wiring import model_of, model_path, needs_model

    model = model_of(loaded.scenario, loaded.folder, given)
    if model is not None:
        return model, model_path(loaded.scenario, loaded.folder, given), False
    if not needs_model(loaded.scenario):
        return None, None, False
    from rtctl.api.identifying.identify_first import identify_first

    refuse_foreign(folder / "model.toml", "identify")
    report.say("no --model given: identifying the device first")
    return identify_first(loaded.scenario, device, folder, stop, report.say), folder / "model.toml", True


def _driver(loaded: LoadedScenario) -> Driver:
    from rtctl.wiring import build_driver

    return build_driver(loaded.scenario, loaded.folder)


@contextmanager
def _listening(folder: Path | None, changes: Any) -> Iterator[None]:
    """Take changes of parameters while a recorded run lasts (`rtctl set`)."""
    from rtctl.session.live.control_socket import listening

    if folder is None:
        yield
        return
    with listening(folder, changes):
        yield


@contextmanager
def _telling(folder: Path | None, loaded: LoadedScenario, report: Reporter) -> Iterator[None]:
    """Tell how a recorded run goes while it lasts."""
    from rtctl.scenario.command_sequence import steps_of
    from rtctl.session.live.live_status import live_status

    if folder is None:
        yield
        return
    scenario = loaded.scenario
    with (
        report.live(scenario.scenario.title) as show,
        live_status(folder, scenario, steps_of(scenario), show),
    ):
        yield
