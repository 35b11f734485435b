"""Readings that a converter rounds: their step, told by their levels, and what it explains of the error that is left.

A step is a cause where a model that rounds too is nearer to the test records, which takes a noise below an eighth of
the step: of white noise s, rounding the simulation misses by 0.8 s step in the square, leaving it by step^2 / 12 + s^2.
With more noise a rounded simulation is no better, and the step is only mentioned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import plain_unit
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.problem.quantization import grid_level, quantization_step
from rtctl.diagnosis.problem.statement import state_mechanism
from rtctl.diagnosis.result import Cause, Diagnosis
from rtctl.diagnosis.search.holdout_error import Gain, ScoredOutput, compare_errors, simulate_free_run
from rtctl.diagnosis.search.request import SearchRequest
from rtctl.diagnosis.verification.whole_record_fits import extend_model
from rtctl.identification.fit_record import FitRecord

ID = "sensor.quantisation"
EXPLAINS = "{}, which explains {:.0%} of the squared error that is left on the test records."
LEFT = "what is left then"
"""What the share of a step is of: the error of the model with all other causes."""
MENTIONED = (
    "the {} readings have a step of {:.4g} {}: rounding to it is {:.0%} of the squared error that is left on the test "
    "records"
)


class Step(NamedTuple):
    """The step of a signal's readings, and what it does on the test records."""

    signal: str
    size: float
    """Step in the signal's unit."""
    level: float
    """One of the levels, the nearest to zero."""
    share: float
    """Share of the squared error that rounding makes."""
    gain: Gain
    """Errors of the nominal model as it is, and of the extended one with readings that are rounded."""
    alone: Gain
    """Errors of the extended model as it is, and with readings that are rounded."""


def explain_by_steps(answer: Diagnosis, request: SearchRequest, given: Simulation) -> Diagnosis:
    """Return the answer with the steps of the readings: as causes, or as a remark where they gain nothing.

    Args:
        answer: The answer that the fits give.
        request: Records of the diagnosis.
        given: The model of the file, with the steps that it knows of.
    """
    if ID not in request.ids or not request.tests:
        return answer
    found = [_examine(answer, request, signal) for signal in request.problem.subject.levels]
    least = answer.problem.thresholds.verification.rounding_share
    steps = [
        one for one in found if one is not None and one.share > least and not _is_known(one, request, given)
    ]
    causes = [one for one in steps if one.alone.ratio_low > 1.0 and answer.verdict != "unexplained"]
    mentioned = tuple(
        MENTIONED.format(
            one.signal, one.size, plain_unit(f"({request.dataset.units[one.signal]})"), one.share
        )
        for one in steps
        if one not in causes
    )
    answer = replace(answer, warnings=(*answer.warnings, *mentioned))
    return _named(answer, request, causes) if causes else answer


def _examine(answer: Diagnosis, request: SearchRequest, signal: str) -> Step | None:
    """Return the step of a signal's readings; None where none is visible, or where no test record has it."""
    whole = {one.name: one.signals.get(signal) for one in request.dataset.records}
    readings = [values for values in whole.values() if values is not None]
    size = quantization_step(readings, answer.problem.thresholds.problem) if readings else 0.0
    tests = [one for one in request.tests if _is_whole(one, whole.get(one.name))]
    if not (size > 0.0 and tests):
        return None
    level = _level(np.concatenate(readings), size)
    tests = [replace(one, measured={signal: np.asarray(whole[one.name])}) for one in tests]
    before, after = (
        [_error(one.hypothesis.simulation, record, signal, request) for record in tests]
        for one in (answer.fits.before, answer.fits.after)
    )
    rounded = [
        _at_steps(error + record.measured[signal][record.first :], size, level)
        - record.measured[signal][record.first :]
        for error, record in zip(after, tests, strict=True)
    ]  # fmt: skip
    square = float(np.mean(np.concatenate(after) ** 2))
    floor = answer.noise_rms if signal == request.problem.subject.output else 0.0
    output = ScoredOutput(signal, request.dataset.units[signal], floor)
    rate = request.problem.scales.rate
    return Step(
        signal, size, level, min(size**2 / 12.0 / square, 1.0) if square > 0.0 else 1.0,
        gain=compare_errors(before, rounded, tests, output, rate),
        alone=compare_errors(after, rounded, tests, output, rate),
    )  # fmt: skip


def _is_whole(record: FitRecord, readings: FloatArray | None) -> bool:
    return readings is not None and len(readings) == record.samples


def _level(readings: FloatArray, size: float) -> float:
    """Return the level nearest to zero; exactly zero where it is one but for round-off."""
    off = grid_level(readings, size)
    return off if abs(off) > 1e-3 * size else 0.0


def _error(simulation: Simulation, record: FitRecord, signal: str, request: SearchRequest) -> FloatArray:
    """Return simulated minus read (n,) of a test record, in the signal's own unit."""
    plain = request.problem.subject.from_comparable(simulation)
    run = simulate_free_run(plain, record, signal, limits=request.problem.thresholds.search)
    error: FloatArray = (run.outputs[signal][0] - record.measured[signal])[record.first :]
    return error


def _is_known(step: Step, request: SearchRequest, given: Simulation) -> bool:
    """Return whether the model of the file rounds by this step already, or by a larger one."""
    name = f"{ID}.{request.problem.subject.levels[step.signal].step}"
    return any(one.name == name and one.value > 0.99 * step.size for one in given.parameters)


def _named(answer: Diagnosis, request: SearchRequest, steps: Sequence[Step]) -> Diagnosis:
    """Return the answer with steps as a cause, and the extended model that rounds."""
    subject, after = request.problem.subject, answer.fits.after
    estimates = {}
    for one in steps:
        names, unit = subject.levels[one.signal], request.dataset.units[one.signal]
        estimates[names.step] = Estimate(one.size, one.size, one.size, unit)
        estimates[names.level] = Estimate(one.level, one.level, one.level, unit)
    simulation = _rounding(after.hypothesis.simulation, {name: one.value for name, one in estimates.items()})
    mechanism = next(one for one in simulation.mechanisms if one.id == ID)
    share = max(one.share for one in steps)
    cause = Cause(
        id=ID,
        statement=EXPLAINS.format(state_mechanism(mechanism, estimates).removesuffix("."), share),
        kind="mechanism",
        probability=answer.problem.thresholds.report.max_probability if answer.verdict != "partly_explained" else None,
        parameters=estimates,
        share_removed=share,
        indistinguishable_from=(),
        share_of=LEFT,
    )  # fmt: skip
    gain = next((_bounded(one.gain) for one in steps if one.signal == subject.output), answer.gain)
    model = extend_model(request.problem, request.model, after, simulation, {ID: estimates})
    verdict = "explained" if answer.verdict == "adequate" else answer.verdict
    return replace(
        answer, verdict=verdict, causes=(*answer.causes, cause), gain=gain, model=model, helps=True
    )  # fmt: skip


def rounded(diagnosis: Diagnosis, output: str, simulated: FloatArray) -> FloatArray:
    """Return simulated readings (n,) of an output, in its unit, at the steps that are a cause; else as they are."""
    names = diagnosis.problem.subject.levels.get(output)
    for cause in diagnosis.causes:
        if cause.id == ID and names is not None and names.step in cause.parameters:
            step, level = (cause.parameters[name].value for name in (names.step, names.level))
            return _at_steps(simulated, step, level)
    return simulated


def _at_steps(readings: FloatArray, step: float, level: float) -> FloatArray:
    """Return the levels (n,) nearest to readings (n,)."""
    found: FloatArray = level + step * np.rint((readings - level) / step)
    return found


def _bounded(gain: Gain) -> Gain:
    """Return the gain with a noise that is no larger than the error of the model that rounds: it counted the steps."""
    return gain._replace(noise_floor=min(gain.noise_floor, gain.after))


def _rounding(simulation: Simulation, values: dict[str, float]) -> Simulation:
    """Return the model with steps in its readings."""
    if all(one.id != ID for one in simulation.mechanisms):
        simulation = simulation.extended((ID,))
    return simulation.with_values(
        np.array(
            [
                values.get(one.declared.name, one.value) if one.mechanism == ID else one.value
                for one in simulation.parameters
            ]
        )
    )
