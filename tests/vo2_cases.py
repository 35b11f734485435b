"""Bundled devices measured and identified once a test session, and estimators run over records as a loop would.

Workers of pytest-xdist share a folder of the session: the first that needs a device identifies it, the others wait.
"""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
from rtctl.interfaces import Estimator
from rtctl.measured.dataset import Dataset, Record
from rtctl.measured.reading import read_dataset
from rtctl.models.vo2 import Vo2Model, read_model, write_model
from rtctl.scenario.schema import Scenario, load_scenario
from rtctl.session.acquisition import acquire
from rtctl.wiring import build_driver

FloatArray = NDArray[np.float64]
SCENARIOS = Path(__file__).resolve().parent.parent / "scenarios"
RANGE_MA = {"vo2_a": (3.68, 8.49), "vo2_b": (4.0, 9.2), "vo2_l2p": (3.68, 8.49)}
"""Currents in which each bundled device is meant to be used."""
DEVICES = ["vo2_a", *(pytest.param(name, marks=pytest.mark.slow) for name in RANGE_MA if name != "vo2_a")]
"""The bundled devices; to identify the second and the third one takes a quarter of a minute, weekly."""
UNSEEN_NOISE = 20260101  # seed of the validation records; the identification data have the device's own


class IdentifiedDevice(NamedTuple):
    """What is known of one device."""

    name: str
    dataset: Dataset
    model: Vo2Model
    unseen: Record
    """A random staircase with other noise, which no fit has seen."""

    @property
    def rest_mA(self) -> float:
        """Where every acquired record begins at rest."""
        return RANGE_MA[self.name][0]


class Run(NamedTuple):
    """An estimator over one record, a row a sample."""

    value: FloatArray
    surrogate: FloatArray
    confidence: FloatArray
    status: NDArray[np.int64]


def identified_device(name: str, session: Path) -> IdentifiedDevice:
    """Measure and identify, or read what another worker of this session has made in the folder `session`."""
    folder = session / name
    with _locked(session / f"{name}.lock"):
        if not (folder / "model.toml").exists():
            measure(_scenario("acquire_vo2", name), folder / "identification")
            measure(_scenario("random_staircase", name, f"driver.seed={UNSEEN_NOISE}"), folder / "unseen")
            dataset = read_dataset(folder / "identification" / "dataset.toml")
            options = Vo2FitOptions(
                fine_cells=40
            )  # half of the default's time, and the bounds of the tests are of it
            write_model(identify_vo2(dataset, options, lambda _: None), folder / "model.toml")
    return IdentifiedDevice(
        name,
        read_dataset(folder / "identification" / "dataset.toml"),
        read_model(folder / "model.toml"),
        read_dataset(folder / "unseen" / "dataset.toml").records[0],
    )


def measure(scenario: Scenario, folder: Path) -> Dataset:
    """The scenario's excitations on its simulated device."""
    return read_dataset(
        acquire(scenario, build_driver(scenario, folder), folder, lambda: False, lambda _: None)
    )


def staircase_on(plant: Path, folder: Path, *, low: str, high: str) -> Record:
    """The bundled random staircase, 5 s, between two levels (percent of the current range) on a plant file."""
    levels = f'kind = "random_staircase"\nlow = "{low}"\nhigh = "{high}"'
    scenario = folder.with_suffix(".toml")
    text = (SCENARIOS / "random_staircase.toml").read_text()
    scenario.write_text(text.replace('kind = "random_staircase"', levels))
    return measure(load_scenario(scenario, [f'driver.device="{plant}"'])[0], folder).records[0]


def _scenario(scenario: str, device: str, *overrides: str) -> Scenario:
    low, high = RANGE_MA.get(device, RANGE_MA["vo2_a"])
    values = [f'driver.device="{device}"', f'limits.low="{low} mA"', f'limits.high="{high} mA"', *overrides]
    return load_scenario(SCENARIOS / f"{scenario}.toml", values)[0]


def run_over(estimator: Estimator, record: Record, rest_mA: float) -> Run:
    """The estimates at each sample of a record that begins at rest at `rest_mA`.

    Row k was measured before its own current took effect.
    """
    current, resistance = record.signals["current"], record.signals["resistance"]
    answers = [estimator.start([rest_mA], [resistance[0]])]
    for k in range(1, record.samples):
        answers.append(estimator.step([current[k - 1]], [resistance[k]], record.period_s))
    value, surrogate, confidence, status = (np.array(part) for part in zip(*answers, strict=True))
    return Run(value, surrogate, confidence, status)


def percent_of_range(run: Run, record: Record, model: Vo2Model) -> tuple[float, float]:
    """Mean and largest self-sensing error, in percent of the deflection range."""
    error = 100.0 * np.abs(run.value - record.signals["deflection"]) / model.deflection.width
    return float(error.mean()), float(error.max())


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
