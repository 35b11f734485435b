"""The only file that knows what is real: tables of a scenario become drivers, estimators, controllers, limits."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rtctl.border.errors import InputError, nearest
from rtctl.border.model_file import ModelFile
from rtctl.border.quantities import convert
from rtctl.border.records import DeviceProfile, Driver
from rtctl.border.simulation import Simulation
from rtctl.interfaces import Clock, Estimator
from rtctl.models.vo2 import Vo2Model
from rtctl.orbits.forced import Forced
from rtctl.safety.guards import ReadingGuard
from rtctl.safety.limits import CommandLimits
from rtctl.safety.plausibility import Plausibility
from rtctl.scenario.schema import InProcess, ModbusRtu, ModbusTcp, Scenario, Serial, Wire
from rtctl.timing.clock import SimulatedClock

if TYPE_CHECKING:
    from rtctl.plants.support import PlantSupport


def build_driver(scenario: Scenario, folder: Path) -> Driver:
    """The driver of `[driver]`; plant files are looked up beside the scenario, then among the bundled ones."""
    table, profile = scenario.driver, scenario.profile
    builder: Callable[..., Driver] = _DRIVERS[table.kind]
    if isinstance(table, Wire) and table.faults:
        return _with_faults(table, profile, lambda reached: builder(reached, profile, folder))
    return builder(table, profile, folder)


def _with_faults(
    table: ModbusRtu | ModbusTcp | Serial, profile: DeviceProfile, build: Callable[[Wire], Driver]
) -> Driver:
    """A line with the faults of `[[driver.faults]]` between the driver and its device."""
    from drivers.fault_line import Disturbance, Kind, Way
    from drivers.fault_proxy import FaultPlan
    from drivers.faulty import FaultyDriver

    key = "address" if isinstance(table, ModbusTcp) else "port"
    plan = FaultPlan(
        wire="tcp" if isinstance(table, ModbusTcp) else "pty",
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


def _in_process(table: InProcess, profile: DeviceProfile, folder: Path) -> Driver:
    from drivers.inprocess import InProcessDriver
    from plant_sim.catalogue import load_plant
    from plant_sim.device import SimulatedDevice

    plant = load_plant(find_plant(table.device, folder), table.seed)
    if plant.profile.kind != profile.kind:
        raise InputError(
            f'driver.device = "{table.device}" is a "{plant.profile.kind}", the scenario drives a "{profile.kind}"'
        )
    _check_units(table.device, plant.profile, profile)
    return InProcessDriver(SimulatedDevice(plant))


def _check_units(device: str, found: DeviceProfile, wanted: DeviceProfile) -> None:
    """A wire carries numbers alone: they must be in the units that the scenario believes."""
    pairs = zip((*found.commands, *found.sensed), (*wanted.commands, *wanted.sensed), strict=True)
    for own, believed in pairs:
        try:
            same = convert(1.0, own.unit, believed.unit) == 1.0
        except ValueError:
            same = False
        if not same:
            raise InputError(
                f'driver.device = "{device}" has its {own.name} in {own.unit}, the scenario in {believed.unit}; '
                f'set scenario.{own.name}_unit = "{own.unit}"'
            )


def _modbus_rtu(table: ModbusRtu, profile: DeviceProfile, folder: Path) -> Driver:
    from drivers.modbus import ModbusRtuDriver

    return ModbusRtuDriver(port=table.port, baud=table.baud, unit=table.unit, profile=profile)


def _modbus_tcp(table: ModbusTcp, profile: DeviceProfile, folder: Path) -> Driver:
    from drivers.modbus import ModbusTcpDriver

    host, _, port = table.address.rpartition(":")
    return ModbusTcpDriver(host=host.strip("[]"), port=int(port), unit=table.unit, profile=profile)


def _serial(table: Serial, profile: DeviceProfile, folder: Path) -> Driver:
    from drivers.serial_frames import SerialDriver

    return SerialDriver(port=table.port, baud=table.baud, pipeline=table.pipeline, profile=profile)


_DRIVERS: dict[str, Callable[..., Driver]] = {
    "inprocess": _in_process,
    "modbus-rtu": _modbus_rtu,
    "modbus-tcp": _modbus_tcp,
    "serial": _serial,
}

DRIVER_KINDS = tuple(_DRIVERS)


def _support_of(plant: str) -> PlantSupport[Any]:
    """How a kind of plant is controlled; imported here: it is heavy, and who only simulates needs none of it."""
    from rtctl.plants import support_of

    return support_of(plant)


def find_plant(name: str, folder: Path) -> Path:
    """A plant file by path (as given, or beside `folder`) or by the name of a bundled one. Raises InputError."""
    from plant_sim.catalogue import bundled_plant

    for candidate in (Path(name), folder / name):
        if candidate.is_file():
            return candidate
    if Path(name).suffix:
        raise InputError(f"{name}: no such plant file")
    return bundled_plant(name)


def model_of(scenario: Scenario, folder: Path, given: Path | None) -> Any:
    """The model of `--model` or else of `scenario.model`, beside the scenario; None: neither. Raises InputError."""
    path = model_path(scenario, folder, given)
    return None if path is None else _support_of(scenario.scenario.plant).read_model(path)


def model_path(scenario: Scenario, folder: Path, given: Path | None) -> Path | None:
    """The file of `--model` or else of `scenario.model`, beside the scenario; None: neither."""
    named = scenario.scenario.model
    return given or (None if named is None else folder / named)


def unused_extensions(scenario: Scenario, model: Any) -> tuple[str, ...]:
    """What of the model's file the loop does not use."""
    return _support_of(scenario.scenario.plant).unused(model)


def build_estimator(scenario: Scenario, model: Any) -> Estimator:
    """The estimator of `[estimator]`. Raises InputError for one of another kind of plant."""
    kind, plant = scenario.estimator.kind, scenario.scenario.plant
    known = _support_of(plant).estimators
    if kind not in known:
        raise InputError(
            f'key "estimator.kind": "{kind}" does not estimate a "{plant}"; known: {", ".join(known)}'
        )
    return known[kind](model)


def build_limits(scenario: Scenario, model: Any) -> tuple[CommandLimits, ...]:
    """Limits of each command: of `[limits]`; in closed loop (a model is given) no wider than it can be controlled.

    Raises InputError where the two contradict.
    """
    if model is None:
        return tuple(table.command_limits() for table in scenario.limits.commands(scenario.profile))
    return _support_of(scenario.scenario.plant).limits(scenario, model)


def build_plausibility(scenario: Scenario, profile: DeviceProfile) -> Plausibility:
    """What the loop believes of a reading."""
    ranges = scenario.limits.readings(profile)
    return Plausibility(
        sensed_low=tuple(found.low for found in ranges),
        sensed_high=tuple(found.high for found in ranges),
        names=tuple(f"{channel.name} [{channel.unit}]" for channel in profile.sensed),
    )


def build_guard(scenario: Scenario, profile: DeviceProfile) -> ReadingGuard:
    """What the loop believes of readings over time."""
    period_s = scenario.scenario.period_s
    return ReadingGuard(
        scenario.safety.reading_rules(
            scenario.limits, scenario.clock, profile, period_s, scenario.reading_delay
        )
    )


def build_clock(scenario: Scenario) -> Clock:
    """Simulated for lockstep, monotonic for live runs."""
    if scenario.clock.mode == "lockstep":
        return SimulatedClock()
    return scenario.clock.monotonic(scenario.scenario.period_s)


def build_simulation(model: ModelFile | Vo2Model, units: Mapping[str, str], source: str) -> Simulation:
    """`model` bound to a dataset's `units`. Raises InputError that names `source`, its file."""
    from plant_sim.oscillator.model import oscillator_simulation
    from rtctl.simulations.vo2 import vo2_simulation

    if isinstance(model, Vo2Model):
        return vo2_simulation(model, units, source)
    known = {"oscillator": oscillator_simulation}
    if model.kind not in known:
        raise InputError(
            f'{source}: a model of kind "{model.kind}" cannot be simulated{nearest(model.kind, known)}'
        )
    return known[model.kind](model, units, source)


def build_forced(model: ModelFile, units: Mapping[str, str], source: str) -> Forced:
    """An oscillator's `model` under harmonic drive, bound to `units`. Raises InputError that names `source`."""
    from plant_sim.oscillator.forced import forced_oscillator
    from plant_sim.oscillator.model import oscillator_simulation

    return forced_oscillator(oscillator_simulation(model, units, source), source)


def serve_plant(
    name: str,
    seed: int | None,
    *,
    rtu_path: Path | None = None,
    serial_path: Path | None = None,
    tcp: str | None = None,
    baud: int | None = None,
    journal: Path | None = None,
) -> None:
    """Serve a plant file or bundled plant until interrupted. Raises InputError."""
    from plant_sim.catalogue import load_plant
    from plant_sim.wire.serve import Wires, serve

    wires = Wires(rtu_path=rtu_path, serial_path=serial_path, tcp=tcp, baud=baud)
    serve(load_plant(find_plant(name, Path()), seed), wires, journal)


def mechanism_ids(kind: str) -> tuple[str, ...]:
    """Ids of all mechanisms that a kind of plant knows, in the order of its catalogue. Raises InputError."""
    from plant_sim.oscillator.mechanisms import MECHANISMS
    from rtctl.simulations.vo2 import MECHANISMS as OF_VO2

    known = {"oscillator": tuple(MECHANISMS), "vo2": tuple(OF_VO2)}
    if kind not in known:
        raise InputError(f'a model of kind "{kind}" has no mechanisms to choose from{nearest(kind, known)}')
    return known[kind]
