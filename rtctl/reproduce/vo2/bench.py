"""Devices, seeds, models and runs of the study, made as `rtctl acquire`, `identify` and `run` make them.

What was tuned on what: the observer's and controller's constants on device A with noise seed 5; docs/results.md showed
seeds 11 to 13 and 901. All figures here are from other seeds, of the noise and of the random currents.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
import tomli_w
from threadpoolctl import threadpool_limits

from rtctl.border.arrays import FloatArray
from rtctl.border.units.quantities import read_toml
from rtctl.models.vo2 import Vo2Model, read_model
from rtctl.plants.vo2.control import build_controller, controllable
from rtctl.reproduce.study import Run
from rtctl.scenario.bundled import bundled_scenarios
from rtctl.scenario.schema import Scenario, load_scenario
from rtctl.session.closed_loop import track
from rtctl.wiring import build_driver, find_plant

Job = TypeVar("Job")
Result = TypeVar("Result")

DEVICES = ("vo2_a", "vo2_b", "vo2_l2p")
SEEDS = (21, 22, 23, 24, 25)
"""Seeds of the noise in a run, and of the currents of a random staircase."""
IDENTIFICATION_SEEDS = dict(zip(SEEDS, (902, 903, 904, 905, 906), strict=True))
"""Seed of the noise in the identification data of the model that a run with that seed uses."""
ESTIMATORS = ("composite", "gap_free", "preisach", "egpi", "observer")
WORKERS = 2


def devices(run: Run) -> tuple[str, ...]:
    """Return all devices, or one for a short run."""
    return DEVICES[:1] if run.short else DEVICES


def seeds(run: Run) -> tuple[int, ...]:
    """Return all seeds, or one for a short run."""
    return SEEDS[:1] if run.short else SEEDS


def length(run: Run, scenario: str) -> tuple[str, ...]:
    """Return overrides that make a run short."""
    if not run.short:
        return ()
    return ("excitation.0.levels=150",) if scenario == "random_staircase" else ("scenario.duration=2 s",)


def in_parallel(run: Run, work: Callable[[Job], Result], jobs: Sequence[Job]) -> list[Result]:
    """Return `work` of each job, in order; on two processes unless the run is short."""
    if run.short or len(jobs) < 2 * WORKERS:
        with threadpool_limits(1):
            return [work(job) for job in jobs]
    context = get_context("forkserver")
    context.set_forkserver_preload(
        ["rtctl.reproduce.vo2.models"]
    )  # numba and all: seconds, once and not a worker
    with ProcessPoolExecutor(WORKERS, context, _one_thread) as pool:
        return list(pool.map(work, jobs))


def _one_thread() -> None:
    """Limit a worker to one thread: on small matrices many threads cost more than they gain."""
    threadpool_limits(1)


def scenario_of(name: str, device: str, seed: int, overrides: Sequence[str] = ()) -> Scenario:
    """Return a bundled scenario on a device (a bundled one, or a plant file)."""
    given = [f'driver.device="{device}"', f"driver.seed={seed}", *overrides]
    return load_scenario(bundled_scenarios() / f"{name}.toml", given)[0]


@lru_cache(maxsize=64)
def model_of(path: Path) -> Vo2Model:
    """Return the model of a file, read once a process."""
    return read_model(path)


@lru_cache(maxsize=64)
def gains_of(path: Path) -> tuple[str, ...]:
    """Return overrides that set the PI's gains, which every run would tune anew: they follow from the model alone."""
    model, scenario = model_of(path), scenario_of("steps", DEVICES[0], 0)
    gains = build_controller(scenario, model, controllable(model), scenario.reading_delay)[0].gains
    return f'controller.kp="{gains.kp!r} mA/um"', f'controller.ki="{gains.ki!r} mA/(um*s)"'


class Trial(NamedTuple):
    """A run of a bundled scenario."""

    scenario: str
    device: str
    """Device of the model; the plant is `plant` where that is given."""
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
    """Return the run's scores and recorded signals: in-process, in lockstep, as `rtctl run` does it."""
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
    """Return the scores alone, which cross a process border."""
    return played(trial)[0]


def variant(run: Run, device: str, name: str, **tables: Mapping[str, Any]) -> str:
    """Write a plant file to the study's folder, the bundled device with some keys changed; return its path."""
    content = read_toml(find_plant(device, Path()))
    for table, keys in tables.items():
        content[table] = {**content.get(table, {}), **keys}
    path = run.out / "work" / f"{device}-{name}.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(tomli_w.dumps(content), encoding="utf-8")
    return str(path.resolve())


def spread(values: Sequence[float], digits: int = 2) -> str:
    """Format the mean over the seeds and their range."""
    mean, low, high = float(np.mean(values)), min(values), max(values)
    return f"{mean:.{digits}f} ({low:.{digits}f}–{high:.{digits}f})"
