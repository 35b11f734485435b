"""What comes with the program, one line each: name -> where it is imported from, when it is needed."""

from __future__ import annotations

from typing import NamedTuple


class BuiltIn(NamedTuple):
    """A part of the program."""

    target: str
    """"module:attribute"."""
    summary: str
    plants: tuple[str, ...] = ()
    """Kinds of plant that it is for; empty: all."""


PLANTS = {
    "oscillator": BuiltIn("rtctl.plants.oscillator.kind:OSCILLATOR", "oscillator with one degree of freedom"),
    "vo2": BuiltIn(
        "rtctl.plants.vo2.kind:VO2", "VO2 microactuator that senses itself by its film's resistance"
    ),
    "equations": BuiltIn("rtctl.plants.equations.kind:EQUATIONS", "equations of your own, with units"),
    "fmu": BuiltIn("rtctl.plants.fmu.kind:FMU", "functional mock-up unit (FMI 2.0 or 3.0, co-simulation)"),
    "me": BuiltIn("rtctl.plants.me.kind:ME", "magnetoelectric resonator, read by a lock-in amplifier"),
}

DEFAULT_PLANT = "vo2"
"""Kind of plant of a scenario that names none."""

DRIVERS = {
    "inprocess": BuiltIn("rtctl.wiring:in_process", "simulated device in this process"),
    "modbus-rtu": BuiltIn("rtctl.wiring:modbus_rtu", "Modbus RTU on a serial port"),
    "modbus-tcp": BuiltIn("rtctl.wiring:modbus_tcp", "Modbus TCP"),
    "serial": BuiltIn("rtctl.wiring:serial", "plain serial protocol (docs/serial-protocol.md)"),
    "scpi": BuiltIn("rtctl.wiring_scpi:scpi", "source meter with SCPI or TSP (docs/instruments.md)"),
}

ESTIMATORS = {
    "none": BuiltIn(
        "rtctl.estimators.reading:ReadingEstimator", "the reading itself, where it has the output's unit"
    ),
    "composite": BuiltIn(
        "rtctl.estimators:CompositeEstimator", "two hysteresis read-outs, combined", ("vo2",)
    ),
    "gap_free": BuiltIn("rtctl.estimators:GapFreeEstimator", "inverse of a gap-free play model", ("vo2",)),
    "preisach": BuiltIn("rtctl.estimators:DirectPreisachEstimator", "inverse Preisach model", ("vo2",)),
    "egpi": BuiltIn("rtctl.estimators:DirectEgpiEstimator", "inverse extended play model", ("vo2",)),
    "observer": BuiltIn("rtctl.estimators:observer_of", "observer of heating and hysteresis", ("vo2",)),
    "kalman": BuiltIn(
        "rtctl.estimators.cubature:CubatureFilter",
        "cubature Kalman filter of equations of your own",
        ("equations",),
    ),
    "lock_in": BuiltIn(
        "rtctl.estimators.lock_in:LockInEstimator", "amplitude from X and Y of a lock-in", ("me",)
    ),
}

CONTROLLERS = {
    "pi": BuiltIn("rtctl.plants.vo2.tables:PiTable", "PI with gains from the model or by hand", ("vo2",)),
    "pid": BuiltIn(
        "rtctl.controllers.pid_table:PidTable",
        "PID with gains from equations, or by hand (also of a plant without a model)",
        ("equations",),
    ),
    "agc_pll": BuiltIn(
        "rtctl.plants.me.tables:AgcPllTable", "amplitude and phase loops of a resonator", ("me",)
    ),
}

TABLES: dict[str, dict[str, BuiltIn]] = {
    "plant": PLANTS,
    "driver": DRIVERS,
    "estimator": ESTIMATORS,
    "controller": CONTROLLERS,
    "mechanism": {},  # in the catalogue of each kind of plant
}
