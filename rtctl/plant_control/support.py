"""The protocol of a kind of plant: everything about estimators, controllers and models that depends on the kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

from rtctl.interfaces import Controller, Estimator
from rtctl.models.span import Span
from rtctl.safety.limits import CommandLimits
from rtctl.scenario.schema import Scenario

ModelT = TypeVar("ModelT")


class Tuning(Protocol):
    """Gains and what they leave."""

    def describe(self) -> str:
        """One sentence for a person, numbers with units."""
        ...


class Control(NamedTuple):
    """A controller and how it was tuned; None where nothing was (playback)."""

    controller: Controller
    tuning: Tuning | None


class PlantSupport(Protocol[ModelT]):
    """A kind of plant, given a model of one device."""

    estimators: Mapping[str, Callable[[ModelT], Estimator]]

    def read_model(self, path: Path) -> ModelT:
        """Return the model of a file. Raises InputError."""
        ...

    def identity(self, model: ModelT) -> str:
        """Return the identity of the device on which the model was identified; "" where nobody knows."""
        ...

    def unused(self, model: ModelT) -> tuple[str, ...]:
        """Return the mechanisms and parameters of the model's file that neither estimators nor tuning use."""
        ...

    def output_range(self, scenario: Scenario, model: ModelT) -> Span:
        """Return the range of the controlled output [its unit]: that of setpoints, and what percents refer to."""
        ...

    def reading_at_rest(self, model: ModelT) -> tuple[float, ...]:
        """Return a reading with which an estimator can be compiled before the device is opened."""
        ...

    def limits(self, scenario: Scenario, model: ModelT) -> tuple[CommandLimits, ...]:
        """Return the limits of each command, no wider than where the model can be controlled. Raises InputError."""
        ...

    def control(self, scenario: Scenario, model: ModelT, delay: int) -> Control:
        """Return the controller of `[controller]`; a reading is `delay` periods late. Raises InputError."""
        ...

    def predict(self, model: ModelT, level: Mapping[str, float]) -> dict[str, float]:
        """Return what the model predicts for a settled level of a run; the keys are names with units."""
        ...
