"""A functional mock-up unit bound to the units of a dataset, as `rtctl.border.simulation.Simulation`.

The unit is run from its start for each record and each set of parameters. Its states are not seen but for those whose
starts are parameters of the unit and stand in the model file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from plant_sim.equations.language.tree import Number
from plant_sim.equations.mechanisms.courses import Acting, Inputs, read, values_of
from plant_sim.equations.mechanisms.mechanism import EquationsMechanism
from plant_sim.equations.mechanisms.sizes import Sizes
from plant_sim.equations.model import free_parameter, signal_problems, with_mechanisms
from plant_sim.equations.reading import factor_of
from plant_sim.equations.simulation import ABSURD, EquationsSimulation
from plant_sim.equations.system import Constant, Input, Output, State, System
from plant_sim.fmu.mechanisms import unit_mechanisms
from plant_sim.fmu.reading import ratio
from plant_sim.fmu.running import Course, UnitRuns, runs_of
from plant_sim.fmu.unit import unit_text
from rtctl.border.arrays import FloatArray
from rtctl.border.equations.fmu_file import FmuFile
from rtctl.border.errors import InputError
from rtctl.border.model_file import MechanismTable, Value
from rtctl.border.simulation import Prediction, Stimulus

STEPS = 4
"""Communication steps of a sample period where inputs are curved between samples, and the unit takes their slopes."""
STEPS_OF_HOLDS = 8
"""The same of a unit whose inputs are constant within a step."""
WHOLE = 1e-6
"""Share of a step that is rounding, of units that take one communication step alone."""
CHANNEL = Number(0.0)
"""What stands for a law that the unit keeps to itself."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuSimulation(EquationsSimulation):
    """The simulation of a unit; `system` has its channels and parameters, and no laws."""

    runs: UnitRuns
    references: Mapping[str, int]
    """Reference in the unit of each parameter, and of the start of each state, by its name in the model file."""
    tunable: tuple[str, ...]
    """Parameters that may change while the unit runs."""
    seen: Mapping[str, int]
    """References of the variables that are states while the unit runs, by state."""
    seen_factors: Mapping[str, float]
    """The unit's units of one unit of the model file, by state."""
    parameter_factors: Mapping[str, float]
    """The unit's units of one unit of the model file, by the same names."""
    kind: str = "fmu"

    @property
    def outputs(self) -> tuple[str, ...]:
        """Outputs of the unit, then the states that are seen, in the model file's units, but those that are outputs."""
        shown = tuple(one.name for one in self.system.outputs)
        return (*shown, *(name for name in self.seen if name not in shown))

    def _catalogue(self) -> dict[str, EquationsMechanism]:
        return _catalogue(self.system, tuple(sorted(self.units.items())), self.sizes, self.tunable)

    def predict(
        self,
        stimulus: Stimulus,
        values: FloatArray,
        initial: FloatArray | None = None,
        steps_per_period: float | None = None,
        refine: int = 1,
    ) -> Prediction:
        """See `Simulation.predict`. Raises ValueError where the unit takes no step that fits the samples."""
        values, start = self.lanes_of(stimulus, values, initial)
        names = [one.name for one in self.parameters]
        made = {name: np.empty((len(values), stimulus.samples)) for name in self.outputs}
        diverged = np.full(len(values), -1, dtype=np.int64)
        for lane, row in enumerate(values):
            found = _Lane(self, stimulus, dict(zip(names, row.tolist(), strict=True)))
            for name, course in found.outputs(start[:, lane], refine).items():
                made[name][lane] = course
            diverged[lane] = _diverged([made[name][lane] for name in self.outputs])
        return Prediction(made, diverged)

    def pushed(
        self, stimulus: Stimulus, values: FloatArray, initial: FloatArray, pushes: FloatArray,
        steps_per_period: float | None = None,
    ) -> Prediction:  # fmt: skip
        """Refuse: the rates of a unit are not seen. Raises TypeError."""
        raise TypeError(f"{self.runs.unit.path}: nothing can be added to the rates of a unit")

    def written(self, content: FmuFile, tables: Mapping[str, Mapping[str, Value]]) -> FmuFile:  # type: ignore[override]
        """Return the file `content` with the mechanisms, at the values of `tables` by id."""
        own = tuple(
            MechanismTable(id=one.id, parameters=dict(tables[one.id]))
            for one in self.mechanisms
            if one.id in tables
        )
        return content.model_copy(update={"model": content.model.model_copy(update={"mechanisms": own})})


def fmu_simulation(model: FmuFile, units: Mapping[str, str], source: str) -> FmuSimulation:
    """Return the simulation of a unit with its signals in the data's `units`.

    Raises:
        InputError: The unit does not start, or its signals are not those of the data; it names `source`.
    """
    runs = runs_of(Path(model.model.file))
    try:
        system = _system_of(model, runs)
        problems = signal_problems(system, units)
        if problems:
            raise InputError("\n".join(f"{source}: {text}" for text in problems))
        plain = _bound(model, runs, system, units)
    except ValueError as error:
        raise InputError(f"{source}: {error}") from None
    found: FmuSimulation = with_mechanisms(plain, model.model.mechanisms, source)  # type: ignore[assignment]
    return found


def _bound(model: FmuFile, runs: UnitRuns, system: System, units: Mapping[str, str]) -> FmuSimulation:
    """Return the simulation without mechanisms. Raises ValueError for units that cannot be converted."""
    unit, table = runs.unit, model.model
    variables = {one.name: one for one in unit.description.modelVariables}
    asked = {name: (variables[name], one.unit) for name, one in table.parameters.items()}
    asked |= {name: (variables[one.start], one.unit) for name, one in table.states.items()}
    seen = {name: variables[one.variable] for name, one in table.states.items() if one.variable}

    def there(variable: Any) -> str:
        return unit_text(variable, unit.description) or "dimensionless"

    return FmuSimulation(
        system=system,
        parameters=tuple(free_parameter(one) for one in system.parameters),
        input_factors=np.array([ratio(units[one.name], one.unit) for one in system.inputs]),
        output_factors=np.array([ratio(units.get(one.name, one.unit), one.unit) for one in system.outputs]),
        units=dict(units),
        runs=runs,
        seen={name: one.valueReference for name, one in seen.items()},
        seen_factors={name: ratio(table.states[name].unit, there(one)) for name, one in seen.items()},
        references={name: one.valueReference for name, (one, _) in asked.items()},
        tunable=tuple(name for name in table.parameters if variables[name].variability == "tunable"),
        parameter_factors={name: ratio(text, there(one)) for name, (one, text) in asked.items()},
    )


def _system_of(model: FmuFile, runs: UnitRuns) -> System:
    """Return the channels and parameters of a unit, in their own units; a state whose zero means something raises."""
    unit = runs.unit
    return System(
        inputs=tuple(Input(name=one.name, unit=one.unit, factor=1.0) for one in unit.inputs),
        states=tuple(
            State(
                name=name, unit=one.unit, factor=factor_of(one.unit), rate=CHANNEL,
                initial=one.initial * factor_of(one.unit), known=one.fixed,
            )
            for name, one in model.model.states.items()
        ),
        outputs=tuple(
            Output(name=one.name, unit=one.unit, factor=1.0, value=CHANNEL) for one in unit.outputs
        ),
        parameters=tuple(
            Constant(
                name=name, unit=one.unit, factor=1.0, value=one.value, fixed=one.fixed,
                low=-np.inf if one.low is None else one.low, high=np.inf if one.high is None else one.high,
            )
            for name, one in model.model.parameters.items()
        ),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Lane:
    """One record with one set of parameters."""

    simulation: FmuSimulation
    stimulus: Stimulus
    values: Mapping[str, float]

    def outputs(self, start: FloatArray, refine: int) -> dict[str, FloatArray]:
        """Return the outputs (samples,) in the data's units, as instruments read them, from states `start` [SI]."""
        own, stimulus = self.simulation, self.stimulus
        acting = [
            one for one in own.mechanisms if any(self.values[f"{one.id}.{a.name}"] for a in one.amplitudes)
        ]
        sensing = [one for one in acting if one.law is not None and not one.acts_on_input]
        driving = [values_of(one, self.values) for one in acting if one.acts_on_input]
        late = {one.signal: self.values[f"{one.id}.late"] for one in acting if one.id.endswith(".skew")}
        between = any(one.law and one.law.looks_between for one in sensing)
        moving = [one for one in acting if not one.signal]
        found: dict[str, FloatArray] = {}
        for late_s in dict.fromkeys((0.0, *late.values())):
            inputs = Inputs(stimulus, own.system, own.input_factors, driving, late_s=late_s)
            steps = self._steps(inputs, refine, curved=bool(driving) or late_s != 0.0 or between)
            course = self._course(inputs, steps, moving)
            ran = own.runs.run(self._begin(start), course)
            for k, (name, factor) in enumerate(self._read_factors()):
                if late.get(name, 0.0) != late_s or name in found:
                    continue
                made = ran.after if name in stimulus.after_jumps and inputs.jump else ran.before
                reading = [one for one in sensing if one.signal == name]
                found[name] = self._read(made[:, k] / factor, steps, reading, between)
        return found

    def _read_factors(self) -> list[tuple[str, float]]:
        """Return name of each variable that is read, and the unit's units of one of the unit in which it is given."""
        own = self.simulation
        outputs = zip(own.system.outputs, own.output_factors.tolist(), strict=True)
        return [(one.name, factor) for one, factor in outputs] + [
            (name, own.seen_factors[name]) for name in own.seen
        ]

    def _steps(self, inputs: Inputs, refine: int, *, curved: bool) -> int:
        """Return the communication steps of a sample period; a unit with one step alone has no finer ones.

        Raises:
            ValueError: No whole number of its steps fits the sample period.
        """
        runs, period_s = self.simulation.runs, self.stimulus.period_s
        fixed_s = runs.unit.fixed_step_s
        if fixed_s is not None:
            whole = round(period_s / fixed_s)
            if whole < 1 or abs(whole * fixed_s - period_s) > WHOLE * period_s:
                raise ValueError(
                    f"the unit takes communication steps of {fixed_s:g} s alone, and the samples are {period_s:g} s "
                    "apart: take data whose sample period is a whole number of these steps"
                )
            return whole
        holds = {self.stimulus.holds.get(one.name, "linear") for one in inputs.system.inputs}
        if curved or not holds <= ({"zero", "linear"} if runs.takes_slopes else {"zero"}):
            return refine * (STEPS if runs.takes_slopes else STEPS_OF_HOLDS)
        return refine

    def _course(self, inputs: Inputs, steps: int, moving: list[EquationsMechanism]) -> Course:
        nodes, step_s = inputs.nodes(steps), self.stimulus.period_s / steps
        first, middle, last = nodes
        slopes = np.zeros_like(first)
        held = (first + 4.0 * middle + last) / 6.0
        if self.simulation.runs.takes_slopes:
            slopes = (last - first) / step_s
            held = held - 0.5 * step_s * slopes
        after = inputs.after_the_last(steps) if len(first) else np.array(
            [self.stimulus.inputs[one.name][0] for one in inputs.system.inputs]
        ) * self.simulation.input_factors  # fmt: skip
        plain = Course(
            step_s,
            held,
            slopes,
            after,
            seen=tuple(self.simulation.seen.values()),
            looks_after=bool(self.stimulus.after_jumps),
        )
        return self._with_moving(plain, moving, nodes) if moving else plain

    def _with_moving(self, plain: Course, moving: list[EquationsMechanism], nodes: FloatArray) -> Course:
        """Return a course with parameters that drift, or depend on inputs and outputs."""
        own, names = self.simulation, list(dict.fromkeys(one.target for one in moving))
        time_s = plain.step_s * (np.arange(len(plain.inputs)) + 0.5)
        nominal = np.array([self.values[name] * own.parameter_factors[name] for name in names])
        share = np.ones((len(time_s), len(names)))
        by_outputs = np.zeros((len(names), len(own.system.outputs)))
        for one in moving:
            k = names.index(one.target)
            mine = {a.name: self.values[f"{one.id}.{a.name}"] for a in one.parameters}
            if one.id.endswith(".drift"):
                share[:, k] += mine["rate"] * time_s
                continue
            for j, source in enumerate(own.system.inputs):
                share[:, k] += mine[source.name] * nodes[1][:, j] / own.input_factors[j]
            for j, output in enumerate(own.system.outputs):
                by_outputs[k, j] += mine[output.name] / own.output_factors[j]
        return plain._replace(
            moving=tuple(own.references[name] for name in names),
            values=nominal * share,
            by_outputs=nominal[:, None] * by_outputs if by_outputs.any() else np.empty((0, 0)),
        )

    def _begin(self, start: FloatArray) -> dict[int, float]:
        """Return the values of the unit's parameters by reference, with the starts of states `start` [SI]."""
        own = self.simulation
        begin = {
            own.references[one.name]: self.values[one.name] * own.parameter_factors[one.name]
            for one in own.system.parameters
        }
        begin |= {
            own.references[one.name]: float(value) / one.factor * own.parameter_factors[one.name]
            for one, value in zip(own.system.states, start, strict=True)
        }
        return begin

    def _read(
        self, signal: FloatArray, steps: int, sensing: list[EquationsMechanism], between: bool
    ) -> FloatArray:
        """Return an output (samples,) as its instrument reads it, from one (points,) at all communication points."""
        every = 1 if between else steps
        step_s = self.stimulus.period_s * every / steps
        course = np.ascontiguousarray(signal[::every])
        acting: list[Acting] = [values_of(one, self.values) for one in sensing]
        if acting:
            course = read(course, step_s, acting, 0.0, np.zeros((max(len(course) - 1, 1), 3)))
        return np.ascontiguousarray(course[:: steps // every])


@lru_cache(maxsize=32)
def _catalogue(
    system: System, units: tuple[tuple[str, str], ...], sizes: Sizes, tunable: tuple[str, ...]
) -> dict[str, EquationsMechanism]:
    return unit_mechanisms(system, dict(units), sizes, tunable)


def _diverged(outputs: list[FloatArray]) -> int:
    """Return the first sample at which an output is not finite or absurd; -1: none."""
    with np.errstate(invalid="ignore"):
        bad = np.flatnonzero(~np.all([np.abs(one) < ABSURD for one in outputs], axis=0))
    return int(bad[0]) if len(bad) else -1
