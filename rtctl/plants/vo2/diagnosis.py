"""A VO2 microactuator: forces of no name change the heating current, or are added to a reading.

Along what a forward run of the fitted model visits: current, temperature (heating of the first order), branch, rates,
slow averages, time. Errors of the resistance are taken in its logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.problem.finite_differences import differentiate
from rtctl.diagnosis.problem.subject import (
    DifferenceSteps,
    FittedModel,
    FittedRecords,
    Force,
    Levels,
    Reader,
    Records,
    Signals,
    Subject,
)
from rtctl.identification.vo2.coarse_loops import (
    UNITS,
    collect_loops,
    describe_improvement,
    find_coarse_loops,
)
from rtctl.identification.vo2.staircase import estimate_static_noise
from rtctl.measured.dataset import Dataset
from rtctl.models.derived.vo2 import derive_vo2
from rtctl.models.vo2 import NOMINAL_TIME_CONSTANT_S, Vo2Model, read_model, write_model
from rtctl.plants.vo2.initial_temperature import find_initial_temperature
from rtctl.plants.vo2.log_resistance import LOG_RESISTANCE, LogReading, floor_of, log_above, without_logarithm
from rtctl.plants.vo2.loops_picture import draw_coarse_loops
from rtctl.plants.vo2.refitted_loops import refit_parts
from rtctl.plants.vo2.rehearsal import rehearse_sensing
from rtctl.simulations.vo2 import MECHANISMS
from rtctl.simulations.vo2.extending import extended_model as with_extensions
from rtctl.simulations.vo2.nominal import CORRECTIONS
from rtctl.simulations.vo2.nonparametric import UNNAMED

SLOW = (5.0, 25.0, 125.0)
"""Times the heating's time constant: of averages over the past."""
BRANCH_RADIUS = 0.05
"""Of the range of temperatures."""
NOT_TRUSTED = (
    "the identification of this model says that it is not to be trusted: its static loops are those of a device on the "
    "way, not at rest, and what is named here may be their error; first acquire and identify again with holds as long "
    "as rtctl identify says"
)
ON_OTHER_LOOPS = 2.0
"""Times what an identification left on its own data: its misfit on loops that it did not see. Of twelve devices of the
blind generator with nothing hidden 0.3 to 1.7 of the deflection's, 0.4 to 3.1 of the resistance's."""
ON_OTHER_RECORDS = 1.5
"""Times the error of a cross-validation among swings of the staircases: the misfit on records of another kind. Twelve
foreign devices with nothing hidden had 0.6 to 2.4 (`benchmarks/static_loop_errors.py`, seeds 200 to 203): up to 1.3
where films switch by domains, about 2 where the whole loop is one smooth law."""


class Course(NamedTuple):
    """What a run visits, each (n,) of order one."""

    current: FloatArray
    temperature: FloatArray
    heating: FloatArray
    """Rate of the temperature."""
    branch: FloatArray
    """-1 cooling ... 1 heating."""
    time: FloatArray
    period: float
    """Sample period, in time constants."""
    own: FloatArray
    """The reading that is added to."""


def _rate(x: FloatArray) -> FloatArray:
    size = float(np.std(found)) if len(found := np.gradient(x)) else 1.0
    return found / (size or 1.0)


def _slow(x: FloatArray, factor: float, period: float) -> FloatArray:
    return low_pass(x, factor / period)


ON_CURRENT: tuple[tuple[str, str, Callable[[Course], FloatArray]], ...] = (
    ("i^2", "current", lambda p: p.current**2),
    ("i^3", "current", lambda p: p.current**3),
    ("di", "current_rate", lambda p: _rate(p.current)),
    ("sign di", "current_rate", lambda p: np.sign(np.gradient(p.current))),
    ("T", "temperature", lambda p: p.temperature),
    ("dT", "heating_rate", lambda p: p.heating),
    ("branch", "branch", lambda p: p.branch),
    *(
        (f"mean heat over {factor:g} tau", "past_heat", lambda p, f=factor: _slow(p.temperature, f, p.period))
        for factor in SLOW
    ),
    ("t", "time", lambda p: p.time),
    ("t^2", "time", lambda p: p.time**2),
)
ON_READING: tuple[tuple[str, str, Callable[[Course], FloatArray]], ...] = (
    ("i", "current", lambda p: p.current),
    ("di", "current_rate", lambda p: _rate(p.current)),
    ("dT", "heating_rate", lambda p: p.heating),
    ("sin T", "temperature", lambda p: np.sin(0.5 * np.pi * (1.0 + p.temperature))),
    ("sin 2T", "temperature", lambda p: np.sin(np.pi * (1.0 + p.temperature))),
    ("branch", "branch", lambda p: p.branch),
    ("branch sin T", "branch", lambda p: p.branch * np.sin(0.5 * np.pi * (1.0 + p.temperature))),
    ("dy", "reading_rate", lambda p: _rate(p.own)),
    ("ddy", "reading_rate", lambda p: _rate(np.gradient(p.own))),
    *(
        (f"mean over {factor:g} tau", "past_reading", lambda p, f=factor: _slow(p.own, f, p.period))
        for factor in SLOW
    ),
    ("t", "time", lambda p: p.time),
    ("t^2", "time", lambda p: p.time**2),
    ("t y", "time", lambda p: p.time * p.own),
)
READINGS = (LOG_RESISTANCE, "deflection")
FORCES = tuple(Force(f"{name} on current", coordinate) for name, coordinate, _ in ON_CURRENT) + tuple(
    Force(f"{name} on {reading}", coordinate) for reading in READINGS for name, coordinate, _ in ON_READING
)


def low_pass(x: FloatArray, samples: float) -> FloatArray:
    """Average of x (n,) over the past with a time constant of so many samples, from x[0] at rest."""
    keep = float(np.exp(-1.0 / max(samples, 1e-9)))
    found, _ = lfilter([1.0 - keep], [1.0, -keep], x, zi=[keep * x[0]])
    smooth: FloatArray = found
    return smooth


def force_sensitivities(hypothesis: FittedModel, problem: FittedRecords, index: int) -> FloatArray:
    """Return (forces, outputs, n) of record `index`, in parts of the RMS variation of the current or reading."""
    record, outputs = problem.records[index], hypothesis.sensitivity.outputs
    values, start = hypothesis.values_of(index), np.atleast_2d(hypothesis.start(index))
    base = hypothesis.simulation.predict(record.stimulus, values, start, problem.steps_per_period)
    current = record.stimulus.inputs["current"]
    path = _path(current, hypothesis, record.period_s)
    found = np.zeros((len(FORCES), len(outputs), record.samples - record.first))
    swing = float(current.std()) or 1.0
    for k, (_, _, force) in enumerate(ON_CURRENT):

        def moved(step: float, force: Callable[[Course], FloatArray] = force) -> FloatArray:
            moved_current = np.maximum(current + step * swing * force(path), 0.0)
            stimulus = replace(record.stimulus, inputs={"current": moved_current})
            run = hypothesis.simulation.predict(stimulus, values, start, problem.steps_per_period)
            return np.array([(run.outputs[n] - base.outputs[n])[0, record.first :] for n in outputs])

        found[k] = differentiate(moved, problem, outputs)
    k = len(ON_CURRENT)
    for reading in READINGS:
        for _, _, force in ON_READING:
            if reading in outputs:
                own = base.outputs[reading][0]
                along = path._replace(own=(own - own.mean()) / problem.size(reading))
                found[k, outputs.index(reading)] = problem.size(reading) * force(along)[record.first :]
            k += 1
    return found


def _path(current: FloatArray, hypothesis: FittedModel, period_s: float) -> Course:
    tau_s = next(
        (one.value for one in hypothesis.simulation.parameters if one.name == "time_constant"),
        NOMINAL_TIME_CONSTANT_S,
    )
    period = period_s / tau_s
    temperature = _to_unit(low_pass(current**2, 1.0 / period))
    return Course(
        current=_to_unit(current),
        temperature=temperature,
        heating=_rate(temperature),
        branch=_branch(temperature),
        time=np.linspace(-1.0, 1.0, len(current)),
        period=period,
        own=temperature,
    )


def _to_unit(x: FloatArray) -> FloatArray:
    """-1 ... 1 over its range."""
    low, high = float(x.min()), float(x.max())
    return (2.0 * x - low - high) / ((high - low) or 1.0)


def _branch(temperature: FloatArray) -> FloatArray:
    """Where the temperature stands in a play of BRANCH_RADIUS: -1 at its lower edge ... 1 at the upper one."""
    from rtctl.simulations.vo2.mechanisms.hysteresis.shape import branch_of

    return branch_of(np.ascontiguousarray(temperature), 2.0 * BRANCH_RADIUS)


def extended_model(
    start: Vo2Model, simulation: Simulation, estimates: Mapping[str, Mapping[str, Estimate]]
) -> Vo2Model:
    """Return the model of a fitted simulation, which holds `start` already, with 95 % intervals."""
    intervals = {
        f"{mechanism}.{name}" if mechanism else name: (estimate.low, estimate.high)
        for mechanism, by_name in estimates.items()
        for name, estimate in by_name.items()
    }
    made = with_extensions(VO2.from_comparable(simulation), intervals)  # type: ignore[arg-type]
    steps = {one.id: one for one in start.mechanisms if MECHANISMS[one.id].by_levels}  # which no fit has
    kept = (one if estimates.get(one.id) else steps.get(one.id, one) for one in made.mechanisms)
    return replace(made, mechanisms=tuple(kept))


def _write(path: Path, model: Vo2Model, provenance: dict[str, Any]) -> None:
    write_model(model.with_provenance(**{key: _text(value) for key, value in provenance.items()}), path)


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key}: {entry}" for key, entry in value.items())
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _to_comparable(simulation: Simulation, records: Records) -> tuple[Simulation, Reader]:
    floor = floor_of([record.measured["resistance"] for record in records])

    def readings(signals: Signals) -> dict[str, FloatArray]:
        found = {name: values for name, values in signals.items() if name != "resistance"}
        return found | {LOG_RESISTANCE: log_above(signals["resistance"], floor)}

    return LogReading(plain=simulation, floor=floor), readings


def _doubt(model: Vo2Model) -> str:
    """Return a sentence where the identification wrote that its static loops are not those of a device at rest."""
    return NOT_TRUSTED if model.provenance.get("trusted") == "false" else ""


def _stated_misfit(model: Vo2Model, dataset: Dataset) -> dict[str, float]:
    """Return the RMS misfit, by output, that identified loops may have on other records.

    Where the identification predicted swings of its staircases from the others, that is what it missed there. Else it
    is what it left, and at most the noise of one reading, as far as the dataset has staircases: a larger residual means
    that the model is too coarse.
    """
    noise = estimate_static_noise(dataset)
    left = {"resistance": model.reading_error, "deflection": model.deflection_error}
    names = {"resistance": LOG_RESISTANCE}
    elsewhere: dict[str, float | None] = {
        "resistance": model.reading_error_elsewhere, "deflection": model.deflection_error_elsewhere,
    }  # fmt: skip
    return {
        names.get(name, name): (
            min(ON_OTHER_LOOPS * left[name], noise.get(name, np.inf))
            if predicted is None
            else ON_OTHER_RECORDS * predicted
        )
        for name, predicted in elsewhere.items()
    }


def _resistance_rms(records: Records) -> float:
    """ohm, of records that may be read as logarithms."""
    square = count = 0.0
    for record in records:
        readings = record.measured
        ohm = np.exp(readings[LOG_RESISTANCE]) if LOG_RESISTANCE in readings else readings.get("resistance")
        if ohm is not None:
            square, count = square + float(ohm @ ohm), count + len(ohm)
    return math.sqrt(square / count) if count else 1.0


def _heating_time(scales: Scales) -> float:
    return scales.response_s or NOMINAL_TIME_CONSTANT_S


VO2 = Subject(
    kind="vo2",
    drive="current",
    output="deflection",
    required_signal="deflection",
    clippable_outputs=(),
    spike_outputs=("resistance", "deflection"),
    size_is_variation=True,
    forces=FORCES,
    force_sensitivities=force_sensitivities,
    memory_forces=None,
    difference_steps=DifferenceSteps((1e-4, 1e-7), small=0.3),
    nonparametric_alternatives=tuple(UNNAMED),
    sensed_rms=_resistance_rms,
    lag_s=_heating_time,
    time_parameter="time_constant",
    slower_sampling=(),
    is_at_rest_undriven=True,
    growth_is_misfit=False,
    allowed_share=0.05,
    stated_misfit=_stated_misfit,
    doubt=_doubt,
    least_share_removed=0.6,
    steps_per_period=8.0,
    screening_samples=12_000,
    to_comparable=_to_comparable,
    from_comparable=without_logarithm,
    find_coarse_parts=find_coarse_loops,
    find_identified_parts=collect_loops,
    refit_parts=refit_parts,
    session_corrections={name: float(declared.default or 0.0) for name, declared in CORRECTIONS.items()},
    output_offsets={"deflection": "deflection_offset"},
    offset_mechanism="",
    levels={name: Levels(name, f"{name}_level") for name in ("resistance", "deflection")},
    output_units={LOG_RESISTANCE: "ln(ohm)"},
    coarse_part_units=UNITS,
    coarse_part_readings={"resistance": LOG_RESISTANCE, "deflection": "deflection"},
    describe_coarse_parts=describe_improvement,
    coarse_part_figure=draw_coarse_loops,
    find_initial_state=find_initial_temperature,
    rehearse=rehearse_sensing,
    derive=lambda model, estimates, units, problem: derive_vo2(model, estimates, units),
    read_model=read_model,
    relative_errors=lambda model: {},
    extended_model=extended_model,
    write_model=_write,
)

BY_RESISTANCE = replace(VO2, output=LOG_RESISTANCE, required_signal="resistance")
"""Of records without an instrument for the deflection: the film senses itself, and what ails it shows there."""

SUBJECTS = (VO2, BY_RESISTANCE)
"""In the order of preference."""
