"""The only file that knows what is real: tables of a scenario become drivers, estimators, controllers, limits."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from rtctl.border.errors import InputError
from rtctl.border.records import PROFILES, DeviceProfile, Driver
from rtctl.clock import MonotonicClock, SimulatedClock
from rtctl.controllers.feedforward import InverseFeedforward
from rtctl.controllers.pi import Feedforward, NoFeedforward, PiController, PiGains
from rtctl.controllers.tuning import Tuning, margins, tune
from rtctl.interfaces import Clock, Controller, Estimator
from rtctl.limits import CommandLimits, Plausibility
from rtctl.models.vo2 import Span, Vo2Model
from rtctl.models.working_range import WorkingRange
from rtctl.scenario import InProcess, ModbusRtu, ModbusTcp, Scenario


def build_driver(scenario: Scenario, folder: Path) -> Driver:
    """The driver of `[driver]`; plant files are looked up beside the scenario, then among the bundled ones."""
    table, profile = scenario.driver, PROFILES[scenario.scenario.plant]
    builder: Callable[..., Driver] = _DRIVERS[table.kind]
    return builder(table, profile, folder)


def _in_process(table: InProcess, profile: DeviceProfile, folder: Path) -> Driver:
    from drivers.inprocess import InProcessDriver
    from plant_sim.catalogue import load_plant
    from plant_sim.device import SimulatedDevice

    plant = load_plant(find_plant(table.device, folder), table.seed)
    if plant.profile.kind != profile.kind:
        raise InputError(
            f'driver.device = "{table.device}" is a "{plant.profile.kind}", the scenario drives a "{profile.kind}"'
        )
    return InProcessDriver(SimulatedDevice(plant))


def _modbus_rtu(table: ModbusRtu, profile: DeviceProfile, folder: Path) -> Driver:
    from drivers.modbus import ModbusRtuDriver

    return ModbusRtuDriver(port=table.port, baud=table.baud, unit=table.unit, profile=profile)


def _modbus_tcp(table: ModbusTcp, profile: DeviceProfile, folder: Path) -> Driver:
    from drivers.modbus import ModbusTcpDriver

    host, _, port = table.address.rpartition(":")
    return ModbusTcpDriver(host=host.strip("[]"), port=int(port), unit=table.unit, profile=profile)


_DRIVERS: dict[str, Callable[..., Driver]] = {
    "inprocess": _in_process,
    "modbus-rtu": _modbus_rtu,
    "modbus-tcp": _modbus_tcp,
}


def find_plant(name: str, folder: Path) -> Path:
    """A plant file by path (as given, or beside `folder`) or by the name of a bundled one. Raises InputError."""
    from plant_sim.catalogue import bundled_plant

    for candidate in (Path(name), folder / name):
        if candidate.is_file():
            return candidate
    if Path(name).suffix:
        raise InputError(f"{name}: no such plant file")
    return bundled_plant(name)


def build_estimator(kind: str, model: Vo2Model) -> Estimator:
    """The estimator of `[estimator]`."""
    from rtctl.estimators import ESTIMATORS

    return ESTIMATORS[kind](model)


def build_controller(
    scenario: Scenario, model: Vo2Model, working: WorkingRange, delay: int
) -> tuple[Controller, Tuning]:
    """The controller of `[controller]` with gains from the model, or hand-set ones with their margins."""
    table = scenario.controller
    plant = {
        "plant_gain": working.steepest_slope,
        "time_constant_s": model.time_constant_s,
        "period_s": scenario.scenario.period_s,
    }
    if table.kp is not None and table.ki is not None:
        tuning = margins(PiGains(kp=table.kp, ki=table.ki), **plant, delay=delay)
    else:
        least_phase_deg = math.degrees(table.phase_margin_rad)
        tuning = tune(
            **plant, delay=delay, least_gain_margin=table.gain_margin, least_phase_margin_deg=least_phase_deg
        )
        if tuning.gain_margin < table.gain_margin or tuning.phase_margin_deg < least_phase_deg:
            raise InputError(
                f"controller.gain_margin = {table.gain_margin:g} and controller.phase_margin = {least_phase_deg:.3g} "
                f"deg are out of a PI's reach: the slowest one tried leaves {tuning.gain_margin:.3g} and "
                f"{tuning.phase_margin_deg:.3g} deg; ask for less, or give kp and ki"
            )
    deadband = table.deadband.resolve_width(0.0, model.deflection.width)
    return PiController(tuning.gains, _feedforward(scenario, model, working), deadband=deadband), tuning


def _feedforward(scenario: Scenario, model: Vo2Model, working: WorkingRange) -> Feedforward:
    if scenario.controller.feedforward == "none":
        return NoFeedforward()
    limits = build_limits(scenario, working)
    return InverseFeedforward(model, Span(limits.low, limits.high))


def build_limits(scenario: Scenario, working: WorkingRange | None) -> CommandLimits:
    """Command limits; in closed loop no wider than where the model says that more current means more deflection.

    Raises InputError where the two contradict.
    """
    table = scenario.limits
    low, high = table.low, table.high
    safe = low if table.safe is None else table.safe
    if working is not None:
        low, high = max(low, working.current.low), min(high, working.current.high)
        if not low < high:
            raise InputError(
                f"limits.low = {table.low:g} mA and limits.high = {table.high:g} mA leave nothing of the range "
                f"{working.current.low:g} to {working.current.high:g} mA in which the model can be controlled"
            )
        if safe > high:
            raise InputError(
                f"limits.safe = {safe:g} mA lies above {high:g} mA, where the model's controllable range ends; lower it"
            )
    return CommandLimits(low=low, high=high, safe=safe, slew_per_s=table.slew_mA_per_s)


def build_plausibility(scenario: Scenario, profile: DeviceProfile) -> Plausibility:
    """What the loop believes of a reading."""
    names = tuple(f"{channel.name} [{channel.unit}]" for channel in profile.sensed)
    return Plausibility(
        sensed_low=(scenario.limits.sensed_low,), sensed_high=(scenario.limits.sensed_high,), names=names
    )


def build_clock(scenario: Scenario) -> Clock:
    """Simulated for lockstep, monotonic for live runs."""
    return SimulatedClock() if scenario.clock.mode == "lockstep" else MonotonicClock()


def serve_plant(name: str, seed: int | None, *, rtu_path: Path | None, tcp: str | None) -> None:
    """Serve a plant file or bundled plant until interrupted."""
    from plant_sim.catalogue import load_plant
    from plant_sim.serve import serve

    serve(load_plant(find_plant(name, Path()), seed), rtu_path=rtu_path, tcp=tcp)
