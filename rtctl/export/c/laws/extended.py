"""Estimators and feedforward of a model with mechanisms, as exported parts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.controllers.extended_feedforward import ExtendedFeedforward, extended_inverse_step
from rtctl.estimators.corrected import SURROGATE, SensorParams, film_resistance, sensor_at_rest
from rtctl.estimators.drive import FIRST, DriveParams
from rtctl.estimators.extended_observer import ExtendedObserver, extended_observer_step
from rtctl.export.c.laws.parts import Part, Rest, preisach_sources, shortened
from rtctl.translation.memory import Memory, by_precision

SINGLE_SHORTEST_S = 1e-8
"""What is left of a time below this is rounding in single precision [s]."""
STACKS = ("film", "beam", "probe_film", "probe_beam", "forward_film", "forward_beam")
COMMENTS = {
    "filter": "not used twice, b, m, P_bb, P_bm, P_mm",
    "path": "T_1, T_2, T, capacity, heat, film's T, relays' T, R, read R, D, q, q', last turn, its way",
    "film": "extrema of H: k, s_0 ... [mA], H_0 ... [ln ohm]",
    "beam": "extrema of D",
    "probe": "the same a little hotter",
    "drive": "behind the backlash, kept [mA], how many on their way, then current [mA] and time [s] of each",
    "before": "reading and both predictions of the sample before [ohm]",
    "clock": "time since the start and its rounding [s]",
    "swing": "part of the estimate by which the beam swings [um]",
    "forward_path": "as of an observer's path, of the feedforward's own model",
}
PATH_SOURCES = {
    "balance": "model.parameters.thermal_time_constant, model.mechanisms: thermal.*, heater.tcr, sensor.self_heating",
    "phases": "model.mechanisms: hysteresis.rate_dependence; model.parameters.resistance_low, resistance_high",
    "substep_s": "an eighth of the shortest time constant",
    "reading_gain": "model.corrections",
    "ageing": "model.mechanisms: sensor.ageing",
    "leak": "model.mechanisms: sensor.crosstalk",
    "sensor_lag_s": "model.mechanisms: sensor.lag",
    "participation": "model.mechanisms: structure.resonance",
    "back": "model.mechanisms: actuation.deadband",
}
STACK_SOURCES = {
    **preisach_sources("resistance", "resistance_preisach"),
    **preisach_sources("deflection", "deflection_preisach"),
}


def extended_observer_part(estimator: ExtendedObserver, rest: Rest) -> Part:
    """Return the observer of a model with mechanisms, at rest."""
    constants = estimator.constants
    return Part(
        name="observer",
        function=extended_observer_step,
        constants={**constants._asdict(), "drive": _drive(constants.drive)},
        memory=_memory(estimator.at_rest(rest.level), rest, estimator.delay_s),
        sources={
            "errors.deflection": "model.parameters.deflection_error",
            "observer.time_constant_s": "model.parameters.thermal_time_constant",
            **{f"path.{name}": source for name, source in PATH_SOURCES.items()},
            "drive": "model.corrections, model.mechanisms: actuation.deadband",
            **STACK_SOURCES,
        },
        swings=True,
    )


def extended_feedforward_part(forward: ExtendedFeedforward, rest: Rest) -> Part:
    """Return the feedforward of a model with mechanisms, at rest."""
    constants = forward.constants
    return Part(
        name="feedforward",
        function=extended_inverse_step,
        constants={
            **constants._asdict(),
            "forward_drive": _drive(constants.forward_drive),
        },
        memory=_memory(forward.at_rest(rest.level), rest, 0.0),
        sources={
            "inverse.low": "limits.low, or where the model can be controlled",
            "inverse.high": "limits.high, likewise",
            **{f"forward_path.{name}": source for name, source in PATH_SOURCES.items()},
            "forward_drive": "model.corrections, model.mechanisms: actuation.deadband",
            **STACK_SOURCES,
        },
    )


def corrected_part(inner: Part, params: SensorParams, rest: Rest) -> Part:
    """Return an estimator behind the sensor of a model with mechanisms, at rest."""
    sensor = Memory(
        "sensor",
        sensor_at_rest(rest.level),
        "last reading [ohm], last surrogate [mA], time and its rounding [s]",
    )
    return replace(
        inner,
        function=corrected(inner.function),
        constants={**inner.constants, "sensor": params},
        memory=(sensor, *inner.memory),
        sources={**inner.sources, "sensor": "model.corrections, model.mechanisms: sensor.*"},
    )


def corrected(estimate: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function of an estimator behind a sensor; see `rtctl.estimators.corrected`."""

    def corrected_estimate(
        s: Any, c: Any, level: float, sensed: float, elapsed_s: float
    ) -> tuple[float, float, float, int]:
        """Return deflection [um], surrogate [mA], standard error [um] and status bits, of the film's resistance."""
        film = film_resistance(s.sensor, level, sensed, elapsed_s, c.sensor)
        value, surrogate, error, status = estimate(s, c, level, film, elapsed_s)
        s.sensor[SURROGATE] = surrogate
        gain, offset = c.sensor.deflection_gain, c.sensor.deflection_offset
        return gain * value + offset, surrogate, abs(gain) * error, status

    return corrected_estimate


def _drive(params: DriveParams) -> DriveParams:
    return params._replace(shortest_s=by_precision(params.shortest_s, SINGLE_SHORTEST_S))


def _memory(start: Any, rest: Rest, delay_s: float) -> tuple[Memory, ...]:
    """Return the fields of a memory at rest: shorter stacks, and as many held currents on their way as a delay has."""
    entries = []
    for one in fields(start):
        value: FloatArray | float = getattr(start, one.name)
        if one.name in STACKS:
            value = shortened(np.asarray(value), rest.extrema)
        elif isinstance(value, np.ndarray):
            value = value.copy()
            if one.name.endswith("drive"):
                on_their_way = math.ceil(delay_s / rest.period_s) + 3
                value = np.resize(
                    np.concatenate((value, np.zeros(FIRST + 2 * on_their_way))), FIRST + 2 * on_their_way
                )
        entries.append(Memory(one.name, value, COMMENTS.get(one.name, "")))
    return tuple(entries)
