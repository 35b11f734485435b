"""A functional mock-up unit as a device: its inputs are commands, its outputs readings, the first one the reference.

The unit's binary runs inside this process, as that of any simulator does: serve units alone whose origin you trust.
"""

from __future__ import annotations

import logging
import math
import shutil
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from plant_sim.fmu.reading import parameters_of, ratio, read_fmu_model
from plant_sim.fmu.unit import Unit, read_unit, unit_text
from rtctl.border.errors import InputError
from rtctl.border.records import DeviceProfile, device_profile
from rtctl.border.units.quantities import read_toml

_log = logging.getLogger(__name__)
SAME = 1e-9
"""Share of a fixed step that is rounding."""


class FmuPlant:
    """A simulated device (see `plant_sim.plant.Plant`)."""

    def __init__(self, unit: Unit, begin: Mapping[int, float] | None = None) -> None:
        """Unpack and start the unit, with parameters `begin` by reference. Raises InputError where it does not."""
        import fmpy

        self._begin = dict(begin or {})

        self.profile = profile_of(unit)
        self.identity = unit.path.stem.encode("ascii", "replace").decode()[:16]
        self.low = tuple(one.low for one in unit.inputs)
        self.high = tuple(one.high for one in unit.inputs)
        self.safe = tuple(one.start for one in unit.inputs)
        self._unit = unit
        self._slave: Any = None
        folder = tempfile.mkdtemp(prefix="rtctl-fmu-")
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        self._folder = fmpy.extract(str(unit.path), folder)
        self.reset()

    def reset(self) -> None:
        """Start the unit anew, at its start values. Raises InputError where it does not start."""
        import fmpy

        self._free()
        self._time_s, self._ahead_s, self.diverged = 0.0, 0.0, False
        try:
            self._slave = fmpy.instantiate_fmu(self._folder, self._unit.description, "CoSimulation")
            if self._is_3:
                self._slave.enterInitializationMode(startTime=0.0)
            else:
                self._slave.setupExperiment(startTime=0.0)
                self._slave.enterInitializationMode()
            self._put(list(self._begin), list(self._begin.values()))
            self._set(self.safe)
            self._slave.exitInitializationMode()
        except Exception as error:  # the unit's own code: anything
            raise InputError(f"{self._unit.path}: the unit does not start: {error}") from None

    @property
    def _is_3(self) -> bool:
        return bool(self._unit.description.fmiVersion == "3.0")

    def _free(self) -> None:
        if self._slave is None:
            return
        slave, self._slave = self._slave, None
        try:
            slave.terminate()
            slave.freeInstance()
        except Exception as error:  # it failed before: it is thrown away
            _log.warning("%s: %s", self._unit.path, error)

    def _set(self, levels: Sequence[float]) -> None:
        self._put([one.reference for one in self._unit.inputs], [float(one) for one in levels])

    def _put(self, references: list[int], values: list[float]) -> None:
        slave = self._slave
        (slave.setFloat64 if self._is_3 else slave.setReal)(references, values)

    def advance(self, levels: Sequence[float], dt_s: float) -> None:
        """Hold `levels` (inputs,) for `dt_s` [s]; a unit with a fixed step moves by whole steps and keeps the rest.

        Raises ValueError on what cannot be held. Where the unit fails, the motion is lost, and the log says so.
        """
        if not (all(map(math.isfinite, levels)) and dt_s >= 0.0):
            raise ValueError(
                f"levels {list(levels)!r} for {dt_s!r} s: finite levels and a time >= 0 are needed"
            )
        if self.diverged:
            return
        fixed = self._unit.fixed_step_s
        try:
            self._set(levels)
            if fixed is None:
                self._step(dt_s)
                return
            self._ahead_s += dt_s
            while self._ahead_s >= fixed * (1.0 - SAME):
                self._step(fixed)
                self._ahead_s -= fixed
        except Exception as error:  # the unit's own code: anything
            _log.error("%s: the unit failed at %.6g s: %s", self._unit.path, self._time_s, error)
            self.diverged = True

    def _step(self, dt_s: float) -> None:
        if dt_s > 0.0:
            slave = self._slave
            slave.doStep(currentCommunicationPoint=self._time_s, communicationStepSize=dt_s)
            self._time_s += dt_s

    def measure(self) -> tuple[tuple[float, ...], float]:
        """Return the outputs, and the first one as the reference; NaN once the unit failed."""
        count = len(self._unit.outputs)
        if self.diverged:
            return (math.nan,) * count, math.nan
        slave = self._slave
        references = [one.reference for one in self._unit.outputs]
        try:
            found = (slave.getFloat64 if self._is_3 else slave.getReal)(references)
        except Exception as error:  # the unit's own code: anything
            _log.error("%s: the unit failed at %.6g s: %s", self._unit.path, self._time_s, error)
            self.diverged = True
            return (math.nan,) * count, math.nan
        values = tuple(float(one) for one in found)
        return values, values[0]

    def step(self, levels: Sequence[float], dt_s: float) -> tuple[tuple[float, ...], float]:
        """Call `advance`, then `measure`."""
        self.advance(levels, dt_s)
        return self.measure()


def profile_of(unit: Unit) -> DeviceProfile:
    """Return the channels of a unit. Raises InputError where the registers have no room for them."""
    shown = unit.outputs[0]
    try:
        return device_profile(
            "fmu",
            commands={one.name: one.unit for one in unit.inputs},
            sensed={one.name: one.unit for one in unit.outputs},
            reference=(f"reference_{shown.name}", shown.unit),
        )
    except ValueError as error:
        raise InputError(f"{unit.path}: no device of this unit: {error}") from None


def load_plant(path: Path, seed: int | None = None) -> FmuPlant:
    """Return the device of a unit, of a plant file whose `plant.file` names one, or of a model file with its values.

    It has no noise to seed.

    Raises:
        InputError: The unit cannot be a device, or does not start.
    """
    unit = read_unit(unit_file_of(path))
    return FmuPlant(unit, _values_of(path, unit) if _is_model(path) else None)


def _is_model(path: Path) -> bool:
    return path.suffix.lower() != ".fmu" and "model" in read_toml(path)


def _values_of(path: Path, unit: Unit) -> dict[int, float]:
    """Return the parameters of a model file by reference, in the unit's units. Raises InputError for its mechanisms."""
    model = read_fmu_model(path).model
    if model.mechanisms:
        raise InputError(
            f"{path}: a unit as a device has no mechanisms beside it, such as {model.mechanisms[0].id}; serve the "
            "model without [[model.mechanisms]]"
        )
    known = {one.name: one for one in parameters_of(unit)}
    asked = [(name, one.value, one.unit) for name, one in model.parameters.items()]
    asked += [(one.start, one.initial, one.unit) for one in model.states.values()]
    return {
        known[name].valueReference: value
        * ratio(text, unit_text(known[name], unit.description) or "dimensionless")
        for name, value, text in asked
    }


def read_profile(path: Path) -> DeviceProfile:
    """Return the channels of the device of a unit or of a plant file. Raises InputError."""
    return profile_of(read_unit(unit_file_of(path)))


def unit_file_of(path: Path) -> Path:
    """Return the unit that a plant file names under `plant.file`, a model file under `model.file`; a unit itself.

    Raises:
        InputError: None is named.
    """
    if path.suffix.lower() == ".fmu":
        return path
    tables = read_toml(path)
    key = "model" if "model" in tables else "plant"
    table = tables.get(key)
    named = table.get("file") if isinstance(table, dict) else None
    if not isinstance(named, str):
        raise InputError(f'{path}: key "{key}.file" must name a unit, such as "model.fmu", got {named!r}')
    return path.parent / named
