"""Models of the study's devices, as `rtctl acquire` and `rtctl identify` make them: one a device and seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, NamedTuple

from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
from rtctl.measured.dataset import Dataset
from rtctl.measured.reading import read_dataset
from rtctl.models.vo2 import Vo2Model, write_model
from rtctl.reproduce.study import Run
from rtctl.reproduce.vo2.bench import IDENTIFICATION_SEEDS, devices, in_parallel, scenario_of, seeds
from rtctl.scenario.bundled import bundled_scenarios
from rtctl.session.acquisition import acquire
from rtctl.wiring import build_driver

Protocol = Literal["damped", "full"]
"""Excitation: the paper's damped oscillation alone, or reversal curves and a random staircase as well."""
Models = dict[tuple[str, int], Path]
"""Files by device and seed of the run."""


class Identification(NamedTuple):
    """One model of one device."""

    folder: Path
    """Folder of the dataset and the models."""
    plant: str
    """Bundled device or plant file."""
    seed: int
    """Seed of the noise in the dataset."""
    protocol: Protocol
    plays: int
    levels: int
    short: bool

    @property
    def model(self) -> Path:
        """Path of the model's file."""
        coarse = "-short" if self.short else ""
        return self.folder / f"{self.protocol}-{self.plays}-{self.levels}{coarse}.toml"


def identification(
    run: Run,
    device: str,
    seed: int,
    protocol: Protocol,
    *,
    plays: int = 6,
    levels: int = 10,
    plant: str = "",
) -> Identification:
    """Return the identification of the model that a run with this seed uses; `plant`: plant file behind `device`."""
    noise = IDENTIFICATION_SEEDS[seed]
    folder = run.out / "work" / f"{device}-{noise}"
    return Identification(folder, plant or device, noise, protocol, plays, levels, run.short)


def identified(job: Identification) -> Path:
    """Return the model's file; data and model are made where they are missing."""
    if not job.model.is_file():
        options = Vo2FitOptions(plays=job.plays, paper_levels=job.levels)
        if job.short:
            options = replace(options, starts=1, fine_cells=24)
        acquired(job)
        dataset = data_of(job.folder, job.protocol)
        write_model(identify_vo2(dataset, options, lambda text: None), job.model)
    return job.model


def acquired(job: Identification) -> None:
    """Return the dataset by the bundled excitation."""
    if not (job.folder / "dataset.toml").is_file():
        scenario = scenario_of("acquire_vo2", job.plant, job.seed)
        driver = build_driver(scenario, bundled_scenarios())
        acquire(scenario, driver, job.folder, lambda: False, lambda text: None)


def data_of(folder: Path, protocol: Protocol) -> Dataset:
    """Return the dataset, or only the paper's part of its staircases."""
    dataset = read_dataset(folder / "dataset.toml")
    if protocol == "full":
        return dataset
    staircases = dataset.used_for("identify")
    kept = tuple(record for record in dataset.records if record is staircases[0] or record.use != "identify")
    return replace(dataset, records=kept)


def models(run: Run, protocol: Protocol) -> Models:
    """Return the models of every device and seed: six plays, ten levels."""
    keys = [(device, seed) for device in devices(run) for seed in seeds(run)]
    jobs = [identification(run, device, seed, protocol) for device, seed in keys]
    return dict(zip(keys, all_identified(run, jobs), strict=True))


def all_identified(run: Run, jobs: Sequence[Identification]) -> list[Path]:
    """Return the model's file of each job; data first, so that no two workers make the same."""
    in_parallel(run, acquired, list({job.folder: job for job in jobs}.values()))
    return in_parallel(run, identified, jobs)


def to_the_letter(model: Vo2Model) -> Vo2Model:
    """Return the model with the composite's second half identified on the current; docs/decisions/0005 says why."""
    return replace(model, composite_egpi=model.deflection_egpi)
