"""A loop over several outputs of a user's equations: what they are, their estimates, and PIDs behind a decoupler."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import ModelOutput, StateSpace
from rtctl.border.errors import InputError
from rtctl.controllers.pid import PidGains
from rtctl.controllers.pid_table import PidTable
from rtctl.controllers.pid_tuning import best_gains
from rtctl.controllers.several.decoupled_pid import DecoupledPid
from rtctl.controllers.several.decoupling import Decoupler, decoupler
from rtctl.controllers.several.margins import SampledPlant, SeveralPlant
from rtctl.estimators.cubature import CubatureFilter
from rtctl.estimators.equations.rest import jacobian, state_at_rest
from rtctl.estimators.reading import ReadingEstimator
from rtctl.estimators.several_outputs import Further, SeveralOutputs
from rtctl.interfaces import Estimator
from rtctl.models.span import Span
from rtctl.plant_control.support import Control
from rtctl.scenario.further_references import course
from rtctl.scenario.schema import Scenario

PLACES = (0.5, 0.25, 0.75)
"""Shares of all command ranges at which the plant is looked at; the first is the working point of the decoupler."""
SHARE = 1e-5
"""Step of a finite difference, as a share of a command's range."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SeveralTuning:
    """Gains of the PIDs of all outputs, and what they leave."""

    outputs: tuple[ModelOutput, ...]
    gains: PidGains
    """Of each: behind the decoupler every output has the gain 1."""
    condition: float
    maximum_sensitivity: float
    commands: int

    def describe(self) -> str:
        """Return sentences for a person."""
        more = self.commands - len(self.outputs)
        beside = f"; {more} more commands than outputs, the least ones are taken" if more else ""
        names = ", ".join(one.name for one in self.outputs)
        return (
            f"PIDs of {names} behind a static decoupler (condition number {self.condition:.3g}{beside}): "
            f"kp = {self.gains.kp:.4g}, ki = {self.gains.ki:.4g} 1/s, kd = {self.gains.kd:.4g} s for each; maximum "
            f"sensitivity of all together {self.maximum_sensitivity:.2f}"
        )


def controlled_outputs(scenario: Scenario, model: StateSpace) -> tuple[ModelOutput, ...]:
    """Return the outputs of a loop, its own one first. Raises InputError where the range of one is not known."""
    by_name = {one.name: one for one in model.outputs}
    found = (model.outputs[model.shown], *(by_name[name] for name in scenario.references))
    for one in found:
        if one.reach is None:
            raise InputError(
                f"the range of the controlled output {one.name} is not known: give low and high [{one.unit}] under "
                f"[device.outputs.{one.name}] in the model file"
            )
    return found


def with_further_outputs(estimator: Estimator, scenario: Scenario, model: StateSpace) -> Estimator:
    """Return an estimator of all outputs of a loop. Raises InputError for one that knows the loop's own alone."""
    names = [one.name for one in controlled_outputs(scenario, model)]
    places = [[one.name for one in model.outputs].index(name) for name in names[1:]]
    read = [one.name for one in scenario.profile.sensed]
    if isinstance(estimator, ReadingEstimator):
        if names[0] not in read:
            raise InputError(
                f'estimator.kind = "none": the loop does not read {names[0]}; take "kalman", which estimates it'
            )
        estimator = ReadingEstimator(scenario.profile, names[0])

    def of_readings(levels: Sequence[float], sensed: Sequence[float]) -> tuple[float, ...]:
        return tuple(sensed[read.index(name)] for name in names[1:])

    further: Further = of_readings
    if isinstance(estimator, CubatureFilter):
        of_filter = estimator

        def believed(levels: Sequence[float], sensed: Sequence[float]) -> tuple[float, ...]:
            return tuple(of_filter.outputs(levels)[places].tolist())

        further = believed
    return SeveralOutputs(estimator, further)


def decoupled_control(scenario: Scenario, model: StateSpace, delay: int) -> Control:
    """Return PIDs behind a decoupler. Raises InputError where the plant cannot be decoupled, or gains are by hand."""
    table = scenario.controller
    assert isinstance(table, PidTable)
    if table.kp is not None:
        raise InputError(
            "[controller]: kp, ki and kd are for a loop of one output; leave them out, so that each output's PID is "
            "tuned on the model"
        )
    outputs = controlled_outputs(scenario, model)
    limits = scenario.limits.commands(scenario.profile)
    low, high = (np.array([getattr(one, word) for one in limits]) for word in ("low", "high"))
    plants = [_slopes(model, outputs, low + share * (high - low), high - low) for share in PLACES]
    widths, period_s = np.array([_width(one) for one in outputs]), scenario.scenario.period_s
    names = [one.name for one in outputs]
    try:
        commands = [one.name for one in scenario.profile.commands]
        apart = decoupler(_gains_at_rest(plants[0]), high - low, widths, commands, names)
        gains, sensitivity = _tuned(plants, apart, widths, table, period_s, delay)
    except ValueError as error:
        raise InputError(f"[controller]: {error}") from None
    made = DecoupledPid(
        gains, apart, low + PLACES[0] * (high - low), [(one.name, one.unit) for one in outputs],
        _further_setpoints(scenario, outputs), period_s=period_s, setpoint_weight=table.setpoint_weight,
    )  # fmt: skip
    tuning = SeveralTuning(
        outputs=outputs, gains=gains, condition=apart.condition, maximum_sensitivity=sensitivity, commands=len(limits)
    )  # fmt: skip
    return Control(made, tuning)


def _gains_at_rest(plant: SeveralPlant) -> FloatArray:
    """Return the outputs (outputs, commands) that each command moves at rest. Raises ValueError without rest."""
    try:
        return np.asarray(plant.d - plant.c @ np.linalg.solve(plant.a, plant.b))
    except np.linalg.LinAlgError:
        raise ValueError(
            "the device does not rest at the middle of its limits: some state goes on moving there, and has no "
            "steady-state gain; give it a leak, or control one output"
        ) from None


def _slopes(
    model: StateSpace, outputs: Sequence[ModelOutput], levels: FloatArray, spans: FloatArray
) -> SeveralPlant:
    """Return the plant where `levels` (commands,) hold it."""
    rows = [[one.name for one in model.outputs].index(one.name) for one in outputs]
    x = state_at_rest(model, levels.tolist())
    moving = ~model.switched
    b, d = [], []
    for k, span in enumerate(spans):
        up, down = levels.copy(), levels.copy()
        up[k], down[k] = levels[k] + SHARE * span, levels[k] - SHARE * span
        step = 2.0 * SHARE * span
        rates = (model.rates(x[None], up.tolist()) - model.rates(x[None], down.tolist()))[0]
        beside = model.all_outputs(x[None], up.tolist()) - model.all_outputs(x[None], down.tolist())
        b.append(rates / step)
        d.append(beside[0, rows] / step)
    steps = SHARE * np.maximum(np.abs(x), SHARE)
    up_x, down_x = (
        model.all_outputs(x + sign * np.diag(steps), levels.tolist())[:, rows] for sign in (1.0, -1.0)
    )
    c = ((up_x - down_x) / (2.0 * steps[:, None])).T
    a = jacobian(model, x, levels.tolist())
    return SeveralPlant(a=a[moving][:, moving], b=np.array(b).T[moving], c=c[:, moving], d=np.array(d).T)


def _tuned(
    plants: Sequence[SeveralPlant], apart: Decoupler, widths: FloatArray, table: PidTable, period_s: float, delay: int
) -> tuple[PidGains, float]:  # fmt: skip
    """Return the gains of the PIDs, and the sensitivity of all loops together. Raises ValueError: there are none."""
    sampled = [
        SampledPlant(
            SeveralPlant(a=one.a, b=one.b @ apart.inverse, c=one.c, d=one.d @ apart.inverse), widths, period_s, delay
        )
        for one in plants
    ]  # fmt: skip

    def worst(gains: PidGains) -> float:
        return max(one.largest_sensitivity(gains) for one in sampled)

    bound = table.maximum_sensitivity
    gains = best_gains(
        np.concatenate([one.loci() for one in sampled]), lambda gains: worst(gains) <= bound,
        period_s=period_s, maximum_sensitivity=bound, setpoint_weight=table.setpoint_weight,
    )  # fmt: skip
    return gains, worst(gains)


def _width(one: ModelOutput) -> float:
    assert one.reach is not None
    return one.reach[1] - one.reach[0]


def _further_setpoints(scenario: Scenario, outputs: Sequence[ModelOutput]) -> FloatArray:
    """Return the setpoints (outputs - 1, n) of the further outputs."""
    heading = scenario.scenario
    samples = round((heading.duration_s or 0.0) / heading.period_s)
    time_s = heading.period_s * np.arange(samples, dtype=np.float64)
    rows = [
        course(scenario.references[one.name], time_s, Span(*one.reach), one.unit, f"references.{one.name}")
        for one in outputs[1:]
        if one.reach is not None
    ]
    return np.array(rows)
