"""What is real (with `wiring_models`, `wiring_scpi`, `wiring_served`): tables become drivers, estimators, limits."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtctl.border.errors import InputError, nearest
from rtctl.border.records import DeviceProfile, Driver
from rtctl.border.units.quantities import convert, read_toml
from rtctl.estimators.reading import ReadingEstimator
from rtctl.interfaces import Clock, Estimator, Setup
from rtctl.registry import (
    Entry,
    PlantKind,
    find,
    load,
    names,
    plant_kind,
    plant_kinds,
)
from rtctl.registry.building import build
from rtctl.registry.guarding import guarded_controller, guarded_estimator
from rtctl.safety.guards import ReadingGuard
from rtctl.safety.limits import CommandLimits
from rtctl.safety.plausibility import Plausibility
from rtctl.scenario.drivers import InProcess, ModbusRtu, ModbusTcp, Serial
from rtctl.scenario.instruments import Scpi
from rtctl.scenario.own_parts import OwnController, OwnDriver, OwnEstimator
from rtctl.scenario.schema import Scenario
from rtctl.scenario.wires import Wire
from rtctl.timing.clock import SimulatedClock

if TYPE_CHECKING:
    from plant_sim.plant import Plant
    from rtctl.plant_control.support import Control, PlantSupport


def build_driver(scenario: Scenario, folder: Path) -> Driver:
    """Return the driver of `[driver]`; plant files are looked up beside the scenario, then among the bundled ones."""
    table, profile = scenario.driver, scenario.profile
    if isinstance(table, OwnDriver):
        made: Driver = build(table.entry, table.options, profile=profile, folder=folder)
        check_profile(f'driver.kind = "{table.kind}"', made.profile, profile)
        return made
    builder: Callable[..., Driver] = load(find("driver", table.kind, "driver.kind"))
    if isinstance(table, Scpi):
        builder = partial(builder, limits=scenario.limits)
    if isinstance(table, Wire) and table.faults:
        return _with_faults(table, profile, lambda reached: builder(reached, profile, folder))
    return builder(table, profile, folder)


def _with_faults(table: Wire, profile: DeviceProfile, build: Callable[[Wire], Driver]) -> Driver:
    """Return a driver with the faults of `[[driver.faults]]` on the line to its device."""
    from drivers.fault_line import Disturbance, Kind, Way
    from drivers.fault_proxy import FaultPlan
    from drivers.faulty import FaultyDriver

    key = table.place_key
    plan = FaultPlan(
        wire="tcp" if key == "address" else "pty",
        target=getattr(table, key),
        disturbances=tuple(
            Disturbance(
                kind=Kind(fault.kind),
                rate=fault.rate,
                duration_s=fault.duration_s,
                way=None if fault.way is None else Way(fault.way),
            )
            for fault in table.faults
        ),
        seed=table.faults_seed,
        host_pid=os.getpid(),
        device_pid=table.device_pid or 0,
    )
    return FaultyDriver(lambda where: build(table.model_copy(update={key: where})), plan, profile)


def in_process(table: InProcess, profile: DeviceProfile, folder: Path) -> Driver:
    """Return the driver of a simulated device in this process. Raises InputError where it is of another kind."""
    from drivers.inprocess import InProcessDriver
    from plant_sim.device import SimulatedDevice

    plant = build_device(table.device, folder, table.seed)
    check_profile(f'driver.device = "{table.device}"', plant.profile, profile)
    return InProcessDriver(SimulatedDevice(plant))


def check_profile(where: str, found: DeviceProfile, wanted: DeviceProfile) -> None:
    """Raise InputError where a device is of another kind than the scenario, or its numbers are in other units.

    A wire carries numbers alone: they must be in the units that the scenario believes.
    """
    if found.kind != wanted.kind:
        raise InputError(f'{where} is a "{found.kind}", the scenario drives a "{wanted.kind}"')
    counts = [(len(one.commands), len(one.sensed)) for one in (found, wanted)]
    if counts[0] != counts[1]:
        raise InputError(f"{where} has {counts[0]} commands and readings, the scenario {counts[1]}")
    pairs = zip((*found.commands, *found.sensed), (*wanted.commands, *wanted.sensed), strict=True)
    for own, believed in pairs:
        try:
            same = convert(1.0, own.unit, believed.unit) == 1.0
        except ValueError:
            same = False
        if not same:
            raise InputError(
                f"{where} has its {own.name} in {own.unit}, the scenario in {believed.unit}; "
                f'set scenario.{own.name}_unit = "{own.unit}"'
            )


def modbus_rtu(table: ModbusRtu, profile: DeviceProfile, folder: Path) -> Driver:
    """Return the driver of a device on a serial line."""
    from drivers.modbus import ModbusRtuDriver

    return ModbusRtuDriver(port=table.port, baud=table.baud, unit=table.unit, profile=profile)


def modbus_tcp(table: ModbusTcp, profile: DeviceProfile, folder: Path) -> Driver:
    """Return the driver of a device on a network."""
    from drivers.modbus import ModbusTcpDriver

    host, _, port = table.address.rpartition(":")
    return ModbusTcpDriver(host=host.strip("[]"), port=int(port), unit=table.unit, profile=profile)


def serial(table: Serial, profile: DeviceProfile, folder: Path) -> Driver:
    """Return the driver of a device with the plain serial protocol."""
    from drivers.serial_frames import SerialDriver

    return SerialDriver(port=table.port, baud=table.baud, pipeline=table.pipeline, profile=profile)


def build_device(name: str, folder: Path, seed: int | None) -> Plant:
    """Return a simulated device.

    Args:
        name: plant file (as given, or beside `folder`), name of a registered kind of plant with a device,
            "module:Class", or name of a bundled device.
        folder: folder of the scenario.
        seed: seed of its noise; None: its own.

    Raises:
        InputError: there is no such device, or it cannot be made.
    """
    if ":" in name or name in names("plant"):
        entry = find("plant", name, "driver.device")
        if load(entry).device is not None:
            made: Plant = build(entry, {}, **_seeded(seed))
            return made
    return load_plant(find_plant(name, folder), seed)


def _seeded(seed: int | None) -> dict[str, int]:
    """Return the argument of an own plant's constructor; nothing where its own default is to hold."""
    return {} if seed is None else {"seed": seed}


def load_plant(path: Path, seed: int | None = None) -> Plant:
    """Return the simulated device of a plant file by its `[plant] kind`, a model file by its `[model] kind`, a unit.

    Args:
        path: plant file, or model file of a kind whose devices are their models.
        seed: replaces that of its noise.

    Raises:
        InputError: the file does not describe a device.
    """
    tables = {"plant": {"kind": "fmu"}} if path.suffix.lower() == ".fmu" else read_toml(path)
    plant, model = tables.get("plant"), tables.get("model")
    kinds = plant_kinds()
    known = [name for name, one in kinds.items() if one.device is not None or one.device_file is not None]
    key, kind = "plant.kind", plant.get("kind") if isinstance(plant, dict) else None
    if plant is None and isinstance(model, dict) and model.get("kind") in kinds:
        files = kinds[model["kind"]].model
        kind = model["kind"] if files is not None and files.is_device else None
    if kind is None:
        raise InputError(f'{path}: key "{key}" is missing{nearest("", known)}')
    if not isinstance(kind, str) or (kind not in known and ":" not in kind):
        raise InputError(f'{path}: key "{key}": unknown kind {kind!r}{nearest(str(kind), known)}')
    entry = find("plant", kind, key)
    record: PlantKind = load(entry)
    if record.device_file is not None:
        made: Plant = record.part(record.device_file)(path, seed)
        return made
    options = {name: value for name, value in (plant or {}).items() if name != "kind"}
    try:
        built: Plant = build(entry, options, **_seeded(seed))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return built


def _support_of(plant: str) -> PlantSupport[Any]:
    """Return how a kind of plant is controlled; imported here: it is heavy, and who only simulates needs none of it."""
    from rtctl.plant_control.lookup import support_of

    return support_of(plant)


def find_plant(name: str, folder: Path) -> Path:
    """Return a plant file by path (as given, or beside `folder`) or by the name of a bundled one. Raises InputError."""
    from plant_sim.catalogue import bundled_plant

    for candidate in (Path(name), folder / name):
        if candidate.is_file():
            return candidate
    if Path(name).suffix:
        raise InputError(f"{name}: no such plant file")
    return bundled_plant(name)


def model_of(scenario: Scenario, folder: Path, given: Path | None) -> Any:
    """Return the model of `--model`, else of `scenario.model` beside the scenario, else None. Raises InputError."""
    path = model_path(scenario, folder, given)
    return None if path is None else _support_of(scenario.scenario.plant).read_model(path)


def model_path(scenario: Scenario, folder: Path, given: Path | None) -> Path | None:
    """Return the file of `--model`, else of `scenario.model` beside the scenario, else None."""
    named = scenario.scenario.model
    return given or (None if named is None else folder / named)


def needs_model(scenario: Scenario) -> bool:
    """Whether a run of `scenario` needs a model: not where only the user's parts control its kind of plant."""
    return plant_kind(scenario.scenario.plant).control is not None


def unused_extensions(scenario: Scenario, model: Any) -> tuple[str, ...]:
    """Return the mechanisms and parameters of the model's file that the loop does not use."""
    return _support_of(scenario.scenario.plant).unused(model)


def build_estimator(scenario: Scenario, model: Any) -> Estimator:
    """Return the estimator of `[estimator]`. Raises InputError for one of another kind of plant."""
    kind, plant = scenario.estimator.kind, scenario.scenario.plant
    if scenario.references and (
        isinstance(scenario.estimator, OwnEstimator) or isinstance(scenario.controller, OwnController)
    ):
        raise InputError("[references]: own estimators and controllers have one output; leave the tables out")
    if isinstance(scenario.estimator, OwnEstimator):
        entry = scenario.estimator.entry
        _check_fits(entry, plant)
        return guarded_estimator(
            kind, build(entry, scenario.estimator.options, setup=setup_of(scenario, model))
        )
    known = _support_of(plant).estimators
    if kind == "none":
        made: Estimator = ReadingEstimator(scenario.profile)
    elif kind in known:
        made = known[kind](model)
    else:
        raise InputError(
            f'key "estimator.kind": "{kind}" does not estimate a "{plant}"; known: {", ".join((*known, "none"))}'
        )
    return _of_several(made, scenario, model) if scenario.references else made


def _of_several(estimator: Estimator, scenario: Scenario, model: Any) -> Estimator:
    """Return an estimator of all outputs of a loop with [references]. Raises InputError."""
    kind = plant_kind(scenario.scenario.plant)
    assert kind.control is not None
    made: Estimator = kind.part(kind.control.several)(estimator, scenario, model)
    return made


def build_control(scenario: Scenario, model: Any) -> Control:
    """Return the controller of `[controller]` and its tuning. Raises InputError where it does not fit the plant."""
    table = scenario.controller
    if isinstance(table, OwnController):
        _check_fits(table.entry, scenario.scenario.plant)
        made = build(table.entry, table.options, setup=setup_of(scenario, model))
        from rtctl.plant_control.support import Control

        return Control(guarded_controller(table.kind, made, len(scenario.profile.commands)), None)
    return _support_of(scenario.scenario.plant).control(scenario, model, scenario.reading_delay)


def _check_fits(entry: Entry, plant: str) -> None:
    if not entry.fits(plant):
        raise InputError(
            f'key "{entry.part}.kind": "{entry.name}" is registered for {", ".join(entry.plants)}, not for a "{plant}"'
        )


def setup_of(scenario: Scenario, model: Any) -> Setup:
    """Return what an own estimator or controller may know of the run."""
    limits, reach = (
        build_limits(scenario, model),
        _support_of(scenario.scenario.plant).output_range(scenario, model),
    )
    return Setup(
        profile=scenario.profile,
        period_s=scenario.scenario.period_s,
        delay=scenario.reading_delay,
        low=tuple(limit.low for limit in limits),
        high=tuple(limit.high for limit in limits),
        output_low=reach.low,
        output_high=reach.high,
        model=model,
    )


def build_limits(scenario: Scenario, model: Any) -> tuple[CommandLimits, ...]:
    """Limits of each command: of `[limits]`; in closed loop (a model is given) no wider than it can be controlled.

    Raises InputError where the two contradict.
    """
    if model is None:
        return scenario.limits.of_commands(scenario.profile)
    return _support_of(scenario.scenario.plant).limits(scenario, model)


def build_plausibility(scenario: Scenario, profile: DeviceProfile) -> Plausibility:
    """Return the range in which the loop believes a reading."""
    ranges = scenario.limits.readings(profile)
    return Plausibility(
        sensed_low=tuple(found.low for found in ranges),
        sensed_high=tuple(found.high for found in ranges),
        names=tuple(f"{channel.name} [{channel.unit}]" for channel in profile.sensed),
    )


def build_guard(scenario: Scenario, profile: DeviceProfile) -> ReadingGuard:
    """Return the guard that compares readings over time."""
    period_s = scenario.scenario.period_s
    return ReadingGuard(
        scenario.safety.reading_rules(
            scenario.limits,
            scenario.clock,
            profile,
            period_s,
            delay=scenario.reading_delay,
            open_loop=bool(scenario.excitation),
        )
    )


def build_clock(scenario: Scenario) -> Clock:
    """Return a simulated clock for lockstep, the monotonic one for live runs."""
    if scenario.clock.mode == "lockstep":
        return SimulatedClock()
    return scenario.clock.monotonic(scenario.scenario.period_s)
