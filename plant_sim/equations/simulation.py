"""A user's equations bound to the units of a dataset, as `rtctl.border.simulation.Simulation`."""

from __future__ import annotations

import weakref
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from plant_sim.equations.compiled.kernels import march
from plant_sim.equations.integration.inputs import input_nodes
from plant_sim.equations.integration.steps import Plan, check_work, places_of, plan, rates_at, slopes
from plant_sim.equations.language.evaluation import evaluate
from plant_sim.equations.language.functions import TIME
from plant_sim.equations.system import System
from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.errors import nearest
from rtctl.border.mechanisms import Mechanism
from rtctl.border.simulation import FreeParameter, Prediction, Stimulus
from rtctl.border.work import count_work

ABSURD = 1e100
"""Value [SI] that only a model without bound reaches."""
MOST_PLANS = 5
BAND_LIMITED_SUBSTEPS = 4
"""Least steps between two samples of an input that swings between them."""
SAME_PLAN = 0.05
"""Relative change of the parameters below which a record's plan holds on."""
CONVERGED = 1e-6
"""Change of the states, relative to their swing, below which twice as many implicit steps do nothing."""
MOST_DOUBLINGS = 8
DISTINCT_LANES = 4
"""Lanes at most whose slopes are looked at, where lanes are not neighbours."""
_plans: weakref.WeakKeyDictionary[Stimulus, dict[tuple[System, float | None], tuple[FloatArray, Plan]]] = (
    weakref.WeakKeyDictionary()
)


@dataclass(frozen=True, slots=True, kw_only=True)
class EquationsSimulation:
    """The simulation of a user's equations; its states are those whose start is not known."""

    system: System
    parameters: tuple[FreeParameter, ...]
    output_factors: FloatArray
    """SI units (outputs,) of the unit in which each output of the system is given."""
    input_factors: FloatArray
    """SI units (inputs,) of the unit in which each input is given."""
    mechanisms: tuple[Mechanism, ...] = ()
    kind: str = "equations"

    @property
    def outputs(self) -> tuple[str, ...]:
        """Outputs of the model, then its states, in their own units, but those that an output shadows."""
        shown = tuple(one.name for one in self.system.outputs)
        return (*shown, *(one.name for one in self.system.states if one.name not in shown))

    @property
    def state(self) -> tuple[str, ...]:
        """Names of the states whose start is not known."""
        return tuple(one.name for one in self.system.states if not one.known)

    def starting(self, stimulus: Stimulus, values: FloatArray) -> FloatArray:
        """See `Simulation.starting`; each state in its own unit."""
        own = self._start(stimulus)
        return np.array(
            [own[k] / one.factor for k, one in enumerate(self.system.states) if not one.known],
            dtype=np.float64,
        )

    def _start(self, stimulus: Stimulus) -> FloatArray:
        """Return all states (states,) [SI] at the first sample: the record's own, else the model's."""
        stated = {name: value for name, value in stimulus.initial.items() if name not in stimulus.read}
        names = [one.name for one in self.system.states]
        for name in stated:
            if name not in names:
                raise ValueError(f'initial.{name}: the model has no state "{name}"{nearest(name, names)}')
        return np.array([stated.get(one.name, one.initial) for one in self.system.states])

    def predict(
        self,
        stimulus: Stimulus,
        values: FloatArray,
        initial: FloatArray | None = None,
        steps_per_period: float | None = None,
        refine: int = 1,
    ) -> Prediction:
        """See `Simulation.predict`. Raises ValueError where no sensible step resolves the model."""
        missing = [one.name for one in self.system.inputs if one.name not in stimulus.inputs]
        if missing:
            raise ValueError(f"the input {', '.join(missing)} of the model is no input of the data")
        values = np.atleast_2d(np.asarray(values, dtype=np.float64))
        factors = np.array([one.factor for one in self.system.parameters])
        p = np.ascontiguousarray(values.T * factors[:, None])
        start = np.repeat(self._start(stimulus)[:, None], len(values), axis=1)
        if initial is not None and self.state:
            free = [k for k, one in enumerate(self.system.states) if not one.known]
            own = np.array([self.system.states[k].factor for k in free])
            start[free] = (np.asarray(initial, dtype=np.float64) * own).reshape(-1, len(free)).T
        x, how = self._march(stimulus, start, p, steps_per_period, refine)
        found = self._read(stimulus, x, p, how)
        return Prediction(found, _diverged(x, found))

    def with_values(self, values: FloatArray) -> EquationsSimulation:
        """Return the same model with `values` (parameters,) as its own."""
        moved = zip(self.parameters, np.asarray(values, dtype=np.float64).tolist(), strict=True)
        return replace(self, parameters=tuple(parameter._replace(value=value) for parameter, value in moved))

    def extended(self, mechanisms: tuple[str, ...]) -> EquationsSimulation:
        """Return the model itself: there are no mechanisms of equations yet."""
        if mechanisms:
            raise ValueError(f"a model of equations has no mechanism {', '.join(mechanisms)}")
        return self

    def _nodes(self, stimulus: Stimulus, substeps: int) -> FloatArray:
        return input_nodes(stimulus, self.system, self.input_factors, substeps)

    def _march(
        self,
        stimulus: Stimulus,
        start: FloatArray,
        p: FloatArray,
        steps_per_period: float | None,
        refine: int,
    ) -> tuple[FloatArray, int]:
        """Return the states (samples, states, lanes) [SI] and the steps between two samples."""
        kept = _plans.setdefault(stimulus, {})
        key = (self.system, steps_per_period)
        if key in kept and _is_near(kept[key][0], p):
            how = kept[key][1]
            how = how._replace(substeps=refine * how.substeps)
            return self._run(stimulus, start, p, how), how.substeps
        self._check_start(stimulus, start, p)
        how = self._first_plan(stimulus, start, p, steps_per_period)
        x = self._run(stimulus, start, p, how)
        for _ in range(MOST_PLANS):
            wanted = self._plan_along(stimulus, x, p, steps_per_period)
            if wanted.implicit and wanted.substeps <= how.substeps and how.implicit:
                break
            if wanted.implicit == how.implicit and wanted.substeps <= how.substeps and np.isfinite(x).all():
                break
            how = wanted
            x = self._run(stimulus, start, p, how)
        if how.implicit:
            how, x = self._converged(stimulus, start, p, how, x)
        kept[key] = (p.copy(), how)
        if refine > 1:
            how = how._replace(substeps=refine * how.substeps)
            x = self._run(stimulus, start, p, how)
        return x, how.substeps

    def _check_start(self, stimulus: Stimulus, start: FloatArray, p: FloatArray) -> None:
        """Raise ValueError where a rate is not finite at the first sample."""
        u = self._nodes(stimulus, 1)[0, :1]
        rates = rates_at(self.system, places_of(start[:, :1].T, u, 1.0), p[:, 0])[0]
        for one, rate in zip(self.system.states, rates.tolist(), strict=True):
            if not np.isfinite(rate):
                raise ValueError(
                    f"the rate of the state {one.name} is {rate:g} at the start of the record; correct its equation, "
                    "the initial state or the parameters"
                )

    def _first_plan(
        self, stimulus: Stimulus, start: FloatArray, p: FloatArray, steps_per_period: float | None
    ) -> Plan:
        """Return a plan from the start alone, the inputs being what they are over the record."""
        u = self._nodes(stimulus, 1)[0]
        places = places_of(np.repeat(start[:, :1].T, len(u), axis=0), u, stimulus.period_s)
        largest = np.abs(np.nan_to_num(rates_at(self.system, places, p[:, 0]), posinf=0.0, neginf=0.0)).max(
            axis=0
        )
        swing = np.maximum(np.abs(start[:, 0]), 4.0 * stimulus.period_s * largest)
        swing = np.maximum(swing, 1e-12 * max(float(swing.max()), 1e-12))
        return self._planned(slopes(self.system, places, p[:, 0], swing), stimulus, steps_per_period)

    def _plan_along(
        self, stimulus: Stimulus, x: FloatArray, p: FloatArray, steps_per_period: float | None
    ) -> Plan:
        """Return a plan from motions (samples, states, lanes): of the first lane, and of others that differ."""
        inputs = self._nodes(stimulus, 1)[0]
        found = []
        for lane in _distinct(p):
            own = x[:-1, :, lane]
            places = places_of(own, inputs, stimulus.period_s)
            swing = np.maximum(np.ptp(places.x, axis=0), 1e-3 * np.abs(places.x).max(axis=0))
            swing = np.maximum(swing, 1e-12 * max(float(swing.max()), 1e-12))
            found.append(slopes(self.system, places, p[:, lane], swing))
        return self._planned(np.concatenate(found), stimulus, steps_per_period)

    def _planned(self, jacobians: FloatArray, stimulus: Stimulus, steps_per_period: float | None) -> Plan:
        how = plan(jacobians, stimulus.period_s, steps_per_period)
        holds = {stimulus.holds.get(one.name) for one in self.system.inputs}
        if "band-limited" in holds:
            how = how._replace(substeps=max(how.substeps, BAND_LIMITED_SUBSTEPS))
        return how

    def _run(self, stimulus: Stimulus, start: FloatArray, p: FloatArray, how: Plan) -> FloatArray:
        check_work(how.substeps, stimulus.samples)
        states, lanes = start.shape
        count_work(
            lanes * stimulus.samples * (1.0 + 0.5 * states * how.substeps * (20.0 if how.implicit else 1.0))
        )
        return march(self.system, start, self._nodes(stimulus, how.substeps), stimulus.period_s, how, p)

    def _converged(
        self, stimulus: Stimulus, start: FloatArray, p: FloatArray, how: Plan, x: FloatArray
    ) -> tuple[Plan, FloatArray]:
        """Return the implicit steps from which on twice as many change nothing, and the states with them.

        Raises:
            ValueError: There are no such steps.
        """
        for _ in range(MOST_DOUBLINGS):
            finer = how._replace(substeps=2 * how.substeps)
            y = self._run(stimulus, start, p, finer)
            swing = np.maximum(np.ptp(y[:, :, 0], axis=0), 1e-6 * np.abs(y[:, :, 0]).max(axis=0))
            change = np.abs(y[:, :, 0] - x[:, :, 0]).max(axis=0)
            if not np.isfinite(y[:, :, 0]).all() or (change <= CONVERGED * swing).all():
                return how, x
            how, x = finer, y
        raise ValueError(
            f"the model is stiff, and {how.substeps} implicit steps between two samples do not resolve what is left: "
            "something jumps or is far faster than the samples; smooth it, or leave it out"
        )

    def _read(self, stimulus: Stimulus, x: FloatArray, p: FloatArray, substeps: int) -> dict[str, FloatArray]:
        """Return outputs and states (lanes, samples); inputs are as they are just before each sample."""
        nodes = self._nodes(stimulus, substeps)
        values: dict[str, FloatArray] = {TIME: stimulus.period_s * np.arange(len(x), dtype=np.float64)}
        for k, state in enumerate(self.system.states):
            values[state.name] = x[:, k].T
        for k, source in enumerate(self.system.inputs):
            values[source.name] = np.concatenate((nodes[0, :1, k], nodes[2, substeps - 1 :: substeps, k]))
        for k, parameter in enumerate(self.system.parameters):
            values[parameter.name] = p[k][:, None]
        found: dict[str, FloatArray] = {}
        for name, tree in self.system.needed_terms(tuple(one.value for one in self.system.outputs)).items():
            values[name] = evaluate(tree, values)
        shape = (x.shape[2], len(x))
        for k, output in enumerate(self.system.outputs):
            made = np.broadcast_to(evaluate(output.value, values), shape) / self.output_factors[k]
            found[output.name] = np.ascontiguousarray(made)
        for state in self.system.states:
            if state.name not in found:
                found[state.name] = np.ascontiguousarray(values[state.name] / state.factor)
        return found


def _is_near(kept: FloatArray, p: FloatArray) -> bool:
    """Return whether the parameters (parameters, lanes) of all lanes are those of a plan, nearly."""
    first = kept[:, :1]
    return bool((np.abs(p - first) <= SAME_PLAN * np.abs(first)).all())


def _distinct(p: FloatArray) -> list[int]:
    """Return the first lane, and some others whose parameters differ from its own."""
    if _is_near(p, p):
        return [0]
    far = np.argsort(-np.abs(p - p[:, :1]).sum(axis=0), kind="stable")
    return [0, *(int(lane) for lane in far[: DISTINCT_LANES - 1] if lane != 0)]


def _diverged(x: FloatArray, outputs: Mapping[str, FloatArray]) -> IntArray:
    """Return the first sample (lanes,) at which a state or an output is not finite or absurd; -1: none."""
    with np.errstate(invalid="ignore"):
        bad = ~np.all(np.abs(x) < ABSURD, axis=1).T
        for made in outputs.values():
            bad |= ~np.isfinite(made)
    first = np.where(np.any(bad, axis=1), np.argmax(bad, axis=1), -1)
    return first.astype(np.int64)
