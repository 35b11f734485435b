"""A user's equations bound to the units of a dataset, as `rtctl.border.simulation.Simulation`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from plant_sim.equations.marching import Marching, Motion
from plant_sim.equations.mechanisms.catalogue import catalogue
from plant_sim.equations.mechanisms.courses import Inputs, read, values_of
from plant_sim.equations.mechanisms.mechanism import EquationsMechanism
from plant_sim.equations.mechanisms.sizes import NO_SIZES, Sizes, sizes_along
from plant_sim.equations.mechanisms.words import output_reference
from plant_sim.equations.mechanisms.workbench import Workbench, workbench
from plant_sim.equations.mechanisms.writing import with_written_terms
from plant_sim.equations.readout import read_outputs
from plant_sim.equations.system import System, directly_driven
from plant_sim.oscillator.kinks import LEAST, kinks_of
from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.equations.file import EquationsFile
from rtctl.border.errors import nearest
from rtctl.border.mechanisms import Scales
from rtctl.border.model_file import Value
from rtctl.border.simulation import FreeParameter, Prediction, Stimulus, with_parameter_values

ABSURD = 1e100
"""Value [SI] that only a model without bound reaches."""
SAME_SIZE = 1e-5
"""Change of a parameter below which a record's plan holds on, as a share of the parameter's size."""
SAME_MECHANISM = 0.05
"""The same of a mechanism's parameter, whose value may be zero."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EquationsSimulation:
    """The simulation of a user's equations; its states are those whose start is not known."""

    system: System
    parameters: tuple[FreeParameter, ...]
    """Those of the system, then each mechanism's."""
    output_factors: FloatArray
    """SI units (outputs,) of the unit in which each output of the system is given."""
    input_factors: FloatArray
    """SI units (inputs,) of the unit in which each input is given."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Units of the data's signals."""
    mechanisms: tuple[EquationsMechanism, ...] = ()
    sizes: Sizes = NO_SIZES
    """Sizes of the courses, with which mechanisms are compared."""
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

    @property
    def catalogue(self) -> tuple[str, ...]:
        """Ids of the mechanisms that may act in these equations; without those of outputs that were not measured."""
        unread = [one.name for one in self.system.outputs if one.name not in self.units]
        return tuple(
            identity
            for identity, one in self._catalogue().items()
            if not (one.id.startswith("output.") and one.signal in unread)
        )

    def has(self, identity: str) -> bool:
        """Return whether there is such a mechanism, also of an output that was not measured."""
        return identity in self._catalogue()

    def _catalogue(self) -> dict[str, EquationsMechanism]:
        return _catalogue(self.system, tuple(sorted(self.units.items())), self.sizes)

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
        values, start = self.lanes_of(stimulus, values, initial)
        run = _Run(self, stimulus, steps_per_period, refine)
        outputs: dict[str, FloatArray] = {}
        diverged = np.full(len(values), -1, dtype=np.int64)
        for lanes in self._sharing_inputs(values):
            found, gone = run.lanes(values[lanes], start[:, lanes])
            diverged[lanes] = gone
            for name, course in found.items():
                outputs.setdefault(name, np.empty((len(values), stimulus.samples)))[lanes] = course
        return Prediction(outputs, diverged)

    def lanes_of(
        self, stimulus: Stimulus, values: FloatArray, initial: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """Return parameters (lanes, parameters) and starts (states, lanes) [SI] of what `predict` is asked for.

        Raises:
            ValueError: The record lacks an input, or states a start of no state.
        """
        missing = [one.name for one in self.system.inputs if one.name not in stimulus.inputs]
        if missing:
            raise ValueError(f"the input {', '.join(missing)} of the model is no input of the data")
        values = np.atleast_2d(np.asarray(values, dtype=np.float64))
        start = np.repeat(self._start(stimulus)[:, None], len(values), axis=1)
        if initial is not None and self.state:
            free = [k for k, one in enumerate(self.system.states) if not one.known]
            own = np.array([self.system.states[k].factor for k in free])
            start[free] = (np.asarray(initial, dtype=np.float64) * own).reshape(-1, len(free)).T
        return values, start

    def pushed(
        self, stimulus: Stimulus, values: FloatArray, initial: FloatArray, pushes: FloatArray,
        steps_per_period: float | None = None,
    ) -> Prediction:  # fmt: skip
        """Return the prediction of one lane with `pushes` (states, samples), per second in the states' units, added.

        They are added to the rates, and go on in straight lines between samples.
        """
        values = np.atleast_2d(values)
        start = np.repeat(self._start(stimulus)[:, None], len(values), axis=1)
        free = [k for k, one in enumerate(self.system.states) if not one.known]
        start[free, 0] = initial * np.array([self.system.states[k].factor for k in free])
        factors = np.array([one.factor for one in self.system.states])
        run = _Run(self, stimulus, steps_per_period, 1, pushes * factors[:, None])
        return Prediction(*run.lanes(values, start))

    def sized(
        self, stimuli: Sequence[Stimulus], measured: Sequence[Mapping[str, FloatArray]], scales: Scales
    ) -> EquationsSimulation:
        """Return the same with the sizes of its courses along its own runs of some records."""
        return replace(self, sizes=sizes_along(self, stimuli, measured, scales))

    def written(self, content: EquationsFile, tables: Mapping[str, Mapping[str, Value]]) -> EquationsFile:
        """Return the file `content` of these equations with the mechanisms, at the values of `tables` by id."""
        own = [one for one in self.mechanisms if one.id in tables]
        return with_written_terms(content, self.system, own, tables)

    def holding(self, names: tuple[str, ...]) -> EquationsSimulation:
        """Return the same with these parameters fixed at their values."""
        kept = tuple(one._replace(fixed=one.fixed or one.name in names) for one in self.parameters)
        return replace(self, parameters=kept)

    def with_values(self, values: FloatArray) -> EquationsSimulation:
        """Return the same model with `values` (parameters,) as its own."""
        return replace(self, parameters=with_parameter_values(self.parameters, values))

    def extended(self, mechanisms: tuple[str, ...]) -> EquationsSimulation:
        """Return the same with these mechanisms at neutral; raises ValueError for one that the system has not."""
        known = self._catalogue()
        for name in mechanisms:
            if name not in known:
                raise ValueError(f'the model has no mechanism "{name}"{nearest(name, known)}')
        added = [known[name] for name in mechanisms]
        more = [
            FreeParameter(
                name=f"{one.id}.{declared.name}", unit=declared.unit,
                value=declared.neutral if declared.neutral is not None else _shape(declared.default),
                low=declared.searched_low, high=declared.high, fixed=False, declared=declared, mechanism=one.id,
            )
            for one in added for declared in one.parameters
        ]  # fmt: skip
        return replace(self, parameters=(*self.parameters, *more), mechanisms=(*self.mechanisms, *added))

    def _sharing_inputs(self, values: FloatArray) -> list[NDArray[np.intp]]:
        """Return groups of lanes whose inputs are the same before they reach the equations."""
        changing = {one.id for one in self.mechanisms if one.acts_on_input}
        columns = [k for k, parameter in enumerate(self.parameters) if parameter.mechanism in changing]
        if not columns or len(values) == 1:
            return [np.arange(len(values))]
        group = np.unique(values[:, columns], axis=0, return_inverse=True)[1].reshape(-1)
        return [np.flatnonzero(group == k) for k in range(group.max() + 1)]


@dataclass(frozen=True, slots=True)
class _Run:
    """Lanes of one record that share their inputs."""

    simulation: EquationsSimulation
    stimulus: Stimulus
    steps_per_period: float | None
    refine: int
    pushes: FloatArray | None = None

    def lanes(self, values: FloatArray, start: FloatArray) -> tuple[dict[str, FloatArray], IntArray]:
        """Return the outputs (lanes, samples) by name, and where lanes diverge (lanes,)."""
        one, acting = self.simulation, self._acting(values)
        families = frozenset(mechanism.family for mechanism in acting if mechanism.family)
        pushed = self.pushes is not None
        bench = workbench(one.system, families) if families or pushed else Workbench(one.system, ())
        system = bench.system
        p, sizes = self._parameters(system, values, acting)
        start = np.concatenate((start, start[list(bench.companions)]))
        by_lane = self._by_lane(values)
        on_signals = [mechanism for mechanism in acting if mechanism.law is not None]
        inputs = Inputs(
            self.stimulus, one.system, one.input_factors,
            [values_of(mechanism, by_lane[0]) for mechanism in on_signals if mechanism.acts_on_input],
            pushes=self.pushes, idle=len(system.inputs) - len(one.system.inputs),
        )  # fmt: skip
        late = {
            mechanism.signal: by_lane[0][f"{mechanism.id}.late"]
            for mechanism in on_signals if mechanism.id.endswith(".skew")
        }  # fmt: skip
        sensing = [mechanism for mechanism in on_signals if not mechanism.acts_on_input]
        found: dict[str, FloatArray] = {}
        gone = np.full(len(values), -1, dtype=np.int64)
        for late_s in dict.fromkeys((0.0, *late.values())):
            nodes = cache(inputs._replace(late_s=late_s).nodes)
            marching = Marching(system, self.stimulus, nodes, start, p, sizes, self.steps_per_period)
            looking = {one.signal for one in sensing if one.law and one.law.looks_between}
            least = LEAST if looking & self._bending(system) else 1
            motion = marching.move(self.refine, between=bool(looking), least=least)
            last = dict[str, FloatArray]()
            if self.stimulus.after_jumps and inputs.jump:
                after = inputs._replace(late_s=late_s).after_the_last(motion.substeps)
                last = dict.fromkeys(self.stimulus.after_jumps, after)
            outputs = self._read(system, motion, nodes(motion.substeps), p, sensing, by_lane, last)
            gone = np.where(gone < 0, _diverged(motion, outputs), gone)
            found |= {name: course for name, course in outputs.items() if late.get(name, 0.0) == late_s}
        return found, gone

    def _read(
        self, system: System, motion: Motion, nodes: FloatArray, p: FloatArray, sensing: list[EquationsMechanism],
        by_lane: list[dict[str, float]], after_jumps: dict[str, FloatArray],
    ) -> dict[str, FloatArray]:  # fmt: skip
        """Return outputs and states (lanes, samples) as instruments read them."""
        own, step_s = self.simulation, self.stimulus.period_s / motion.between
        driving = nodes[:, :, 0].T if nodes.shape[2] else np.zeros(nodes.shape[1::-1])
        found = read_outputs(
            system, motion, nodes, p, step_s, own.output_factors, len(own.system.states), after_jumps
        )
        for name in {mechanism.signal for mechanism in sensing}:
            kinks = None
            if name in self._bending(system) and motion.between >= LEAST:
                kinks = kinks_of(
                    nodes[0], nodes[2], motion.substeps, motion.between, after=name in after_jumps
                )
                kinks = kinks._replace(jumps=kinks.jumps and name in directly_driven(system))
            for lane, values in enumerate(by_lane):
                acting = [values_of(one, values) for one in sensing if one.signal == name]
                found[name][lane] = read(
                    found[name][lane], step_s, acting, self._reference(name), driving, kinks
                )
        return {name: np.ascontiguousarray(course[:, :: motion.between]) for name, course in found.items()}

    def _bending(self, system: System) -> frozenset[str]:
        """Return the outputs that may bend where an input jumps or bends: all, where one is held and jumps."""
        held = {self.stimulus.holds.get(one.name) for one in self.simulation.system.inputs}
        if "zero" in held:
            return frozenset(one.name for one in system.outputs)
        return directly_driven(system)

    def _reference(self, name: str) -> float:
        system = self.simulation.system
        place = [one.name for one in system.outputs].index(name)
        return output_reference(system, name) / float(self.simulation.output_factors[place])

    def _acting(self, values: FloatArray) -> list[EquationsMechanism]:
        """Return the mechanisms that any lane has away from neutral."""
        found = []
        for mechanism in self.simulation.mechanisms:
            columns = [
                k
                for k, one in enumerate(self.simulation.parameters)
                if one.mechanism == mechanism.id and one.declared.neutral is not None
            ]
            if (values[:, columns] != 0.0).any():
                found.append(mechanism)
        return found

    def _parameters(
        self, system: System, values: FloatArray, acting: list[EquationsMechanism]
    ) -> tuple[FloatArray, FloatArray]:
        """Return the parameters (parameters, lanes) [SI] of `system`, and the changes [SI] that no plan notices."""
        own, count = self.simulation, len(self.simulation.system.parameters)
        p = np.repeat(np.array([[one.value * one.factor] for one in system.parameters]), len(values), axis=1)
        p = p.reshape(len(system.parameters), len(values))
        factors = np.array([one.factor for one in system.parameters])
        p[:count] = values[:, :count].T * factors[:count, None]
        at = {one.name: k for k, one in enumerate(system.parameters)}
        sizes = np.zeros(len(system.parameters))
        sizes[:count] = [
            SAME_SIZE * abs(one.declared.scale(own.sizes.scales)) for one in own.parameters[:count]
        ]
        sizes[:count] *= factors[:count]
        names = {one.id: one.names for one in acting if one.family}
        for k, parameter in enumerate(own.parameters):
            if parameter.mechanism in names:
                row = at[names[parameter.mechanism][parameter.declared.name]]
                p[row] = values[:, k] * factors[row]
                sizes[row] = SAME_MECHANISM * abs(parameter.declared.scale(own.sizes.scales)) * factors[row]
        return np.ascontiguousarray(p), sizes

    def _by_lane(self, values: FloatArray) -> list[dict[str, float]]:
        """Return the mechanisms' values by name, of each lane."""
        own = [(k, one.name) for k, one in enumerate(self.simulation.parameters) if one.mechanism]
        return [{name: float(lane[k]) for k, name in own} for lane in values]


@lru_cache(maxsize=32)
def _catalogue(
    system: System, units: tuple[tuple[str, str], ...], sizes: Sizes
) -> dict[str, EquationsMechanism]:
    return catalogue(system, dict(units), sizes)


def _shape(default: float | None) -> float:
    return 1.0 if default is None else default


def _diverged(motion: Motion, outputs: Mapping[str, FloatArray]) -> IntArray:
    """Return the first sample (lanes,) at which a state or an output is not finite or absurd; -1: none."""
    with np.errstate(invalid="ignore"):
        bad = ~np.all(np.abs(motion.x[:: motion.between]) < ABSURD, axis=1).T
        for made in outputs.values():
            bad |= ~np.isfinite(made)
    first = np.where(np.any(bad, axis=1), np.argmax(bad, axis=1), -1)
    return first.astype(np.int64)
