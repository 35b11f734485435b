"""Devices, seeds, models and runs of the study, made as `rtctl acquire`, `identify` and `run` make them.

What was tuned on what: the observer's and controller's constants on device A with noise seed 5; docs/results.md showed
seeds 11 to 13 and 901. All figures here are from other seeds, of the noise and of the random currents.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar

import numpy as np
import tomli_w
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from rtctl.acquisition import acquire
from rtctl.border.quantities import read_toml
from rtctl.bundled import bundled_scenarios
from rtctl.identification.vo2 import Vo2FitOptions, identify_vo2
from rtctl.measured.dataset import Dataset
from rtctl.measured.reading import read_dataset
from rtctl.models.vo2 import Vo2Model, read_model, write_model
from rtctl.plants.vo2 import build_controller, controllable
from rtctl.reproduce.study import Run
from rtctl.scenario import Scenario, load_scenario
from rtctl.session import track
from rtctl.wiring import build_driver, find_plant

FloatArray = NDArray[np.float64]
Job = TypeVar("Job")
Result = TypeVar("Result")
Protocol = Literal["damped", "full"]
"""Identified on the paper's damped oscillation alone, or on reversal curves and a random staircase as well."""

DEVICES = ("vo2_a", "vo2_b", "vo2_l2p")
SEEDS = (21, 22, 23, 24, 25)
"""Of the noise in a run, and of the currents of a random staircase."""
IDENTIFICATION_SEED = 902
ESTIMATORS = ("composite", "gap_free", "preisach", "egpi", "observer")
WORKERS = 2


def devices(run: Run) -> tuple[str, ...]:
    """All, or one."""
    return DEVICES[:1] if run.short else DEVICES


def seeds(run: Run) -> tuple[int, ...]:
    """All, or one."""
    return SEEDS[:1] if run.short else SEEDS


def length(run: Run, scenario: str) -> tuple[str, ...]:
    """Overrides that make a run short."""
    if not run.short:
        return ()
    return ("excitation.0.levels=150",) if scenario == "random_staircase" else ("scenario.duration=2 s",)


def in_parallel(run: Run, work: Callable[[Job], Result], jobs: Sequence[Job]) -> list[Result]:
    """`work` of each job, in order; on two processes unless the run is short."""
    if run.short or len(jobs) < 2 * WORKERS:
        with threadpool_limits(1):
            return [work(job) for job in jobs]
    with ProcessPoolExecutor(WORKERS, get_context("spawn"), _one_thread) as pool:
        return list(pool.map(work, jobs))


def _one_thread() -> None:
    """In a worker: small matrices on many threads cost more than they give."""
    threadpool_limits(1)


class Identification(NamedTuple):
    """One model of one device."""

    folder: Path
    """Of the dataset and the models."""
    protocol: Protocol
    plays: int
    levels: int
    short: bool

    @property
    def model(self) -> Path:
        """The model's file."""
        coarse = "-short" if self.short else ""
        return self.folder / f"{self.protocol}-{self.plays}-{self.levels}{coarse}.toml"


def identification(
    run: Run, device: str, protocol: Protocol, plays: int = 6, levels: int = 10
) -> Identification:
    """With the device's dataset on disk."""
    return Identification(dataset_folder(run, device), protocol, plays, levels, run.short)


def dataset_folder(run: Run, device: str) -> Path:
    """Where the device's identification data are, acquired at the first call."""
    folder = run.out / "work" / device
    if not (folder / "dataset.toml").is_file():
        scenario = scenario_of("acquire_vo2", device, IDENTIFICATION_SEED)
        acquire(
            scenario, build_driver(scenario, bundled_scenarios()), folder, lambda: False, lambda text: None
        )
    return folder


def identified(job: Identification) -> Path:
    """The model's file, made at the first call."""
    if not job.model.is_file():
        options = Vo2FitOptions(plays=job.plays, paper_levels=job.levels)
        if job.short:
            options = replace(options, starts=3, fine_cells=24)
        dataset = data_of(job.folder, job.protocol)
        write_model(identify_vo2(dataset, options, lambda text: None), job.model)
    return job.model


def data_of(folder: Path, protocol: Protocol) -> Dataset:
    """The dataset, or of its staircases only the paper's."""
    dataset = read_dataset(folder / "dataset.toml")
    if protocol == "full":
        return dataset
    staircases = dataset.used_for("identify")
    kept = tuple(record for record in dataset.records if record is staircases[0] or record.use != "identify")
    return replace(dataset, records=kept)


def models(run: Run, protocol: Protocol) -> dict[str, Path]:
    """The model's file of each device: six plays, ten levels."""
    jobs = [identification(run, device, protocol) for device in devices(run)]
    return dict(zip(devices(run), in_parallel(run, identified, jobs), strict=True))


@lru_cache(maxsize=8)
def model_of(path: Path) -> Vo2Model:
    """Read once a process."""
    return read_model(path)


def to_the_letter(model: Vo2Model) -> Vo2Model:
    """With the composite's second half identified on the current; docs/decisions/0005 says why ours is not."""
    return replace(model, composite_egpi=model.deflection_egpi)


def scenario_of(name: str, device: str, seed: int, overrides: Sequence[str] = ()) -> Scenario:
    """A bundled scenario on a device (a bundled one, or a plant file)."""
    given = [f'driver.device="{device}"', f"driver.seed={seed}", *overrides]
    return load_scenario(bundled_scenarios() / f"{name}.toml", given)[0]


@lru_cache(maxsize=8)
def gains_of(path: Path) -> tuple[str, ...]:
    """Overrides that set the PI's gains to those that every run would tune anew: they follow from the model alone."""
    model, scenario = model_of(path), scenario_of("steps", DEVICES[0], 0)
    gains = build_controller(scenario, model, controllable(model), scenario.reading_delay)[0].gains
    return f'controller.kp="{gains.kp!r} mA/um"', f'controller.ki="{gains.ki!r} mA/(um*s)"'


class Trial(NamedTuple):
    """A run of a bundled scenario."""

    scenario: str
    device: str
    """The model's; the plant is `plant` where that is given."""
    model: Path
    estimator: str
    seed: int
    overrides: tuple[str, ...] = ()
    feedforward: bool = False
    plant: str = ""


class Scores(NamedTuple):
    """Errors [% of the model's deflection range]; NaN of tracking in an open-loop run."""

    tracking_mean: float
    tracking_max: float
    sensing_mean: float
    sensing_max: float


def played(trial: Trial) -> tuple[Scores, Mapping[str, FloatArray]]:
    """The run's scores and recorded signals: in-process, in lockstep, as `rtctl run` does it."""
    overrides = [f"estimator.kind={trial.estimator}", *trial.overrides]
    if trial.scenario == "random_staircase":
        overrides.append(f"excitation.0.seed={trial.seed}")
    else:
        overrides.append(f"controller.feedforward={'inverse' if trial.feedforward else 'none'}")
        if not any(one.startswith("controller.kp") for one in overrides):
            overrides += gains_of(trial.model)
    scenario = scenario_of(trial.scenario, trial.plant or trial.device, trial.seed, overrides)
    driver = build_driver(scenario, bundled_scenarios())
    result, outcome = track(scenario, model_of(trial.model), driver, lambda: False)
    if outcome.fault is not None:
        raise RuntimeError(f"{trial}: {outcome.fault}: {outcome.message}")
    found = [
        result.summary[of][f"{which}_abs_percent"]
        for of in ("tracking", "self_sensing")
        for which in ("mean", "max")
    ]
    return Scores(*(float("nan") if value is None else value for value in found)), result.signals


def scored(trial: Trial) -> Scores:
    """The scores alone: what crosses a process border."""
    return played(trial)[0]


def variant(run: Run, device: str, name: str, **tables: Mapping[str, Any]) -> str:
    """A plant file in the study's folder: the bundled device with keys of some of its tables changed; its path."""
    content = read_toml(find_plant(device, Path()))
    for table, keys in tables.items():
        content[table] = {**content.get(table, {}), **keys}
    path = run.out / "work" / f"{device}-{name}.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(tomli_w.dumps(content), encoding="utf-8")
    return str(path.resolve())


def spread(values: Sequence[float], digits: int = 2) -> str:
    """Mean over the seeds and their least to largest."""
    mean, low, high = float(np.mean(values)), min(values), max(values)
    return f"{mean:.{digits}f} ({low:.{digits}f}–{high:.{digits}f})"
