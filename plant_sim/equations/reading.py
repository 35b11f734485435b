"""A model file to a checked system: names, grammar, units, loops and the start; all findings at once."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from plant_sim.equations.language.block import Block
from plant_sim.equations.language.evaluation import evaluate
from plant_sim.equations.language.functions import CONSTANTS, FUNCTIONS, RESERVED, TIME
from plant_sim.equations.language.parser import NAME, parse
from plant_sim.equations.language.tree import Number, Tree, names_in
from plant_sim.equations.language.units import Unit, check_terms, fits, named, stated, unit_of
from plant_sim.equations.own_class.binding import blocks_of, bound
from plant_sim.equations.own_class.declaration import content_of, with_class
from plant_sim.equations.system import Constant, Event, Input, Output, State, System, ordered
from rtctl.border.equations.file import KIND, EquationsFile
from rtctl.border.errors import InputError, nearest
from rtctl.border.units.quantities import check, read_toml, unit_registry
from rtctl.border.units.unit_text import parsed_unit

ZERO: Tree = Number(0.0)

DIRECTIONS = {"rising": 1, "falling": -1, "either": 0}
TABLES = ("inputs", "states", "parameters", "terms")
"""Tables whose names stand in expressions."""


def read_equations(path: Path) -> EquationsFile:
    """Return the checked file. Raises InputError with every finding: of the tables, or else of the equations."""
    tables = read_toml(path)
    table = tables.get("model")
    found = table.get("kind") if isinstance(table, dict) else None
    if found != KIND:
        raise InputError(f'{path}: key "model.kind" is {found!r}, an "{KIND}" model is needed here')
    content = check(EquationsFile, with_class(tables, path), str(path))
    system_of(content, str(path))
    return content


def read_class(owner: type) -> EquationsFile:
    """Return the checked content of a class that declares a device. Raises InputError with every finding."""
    content = content_of(owner)
    system_of(content, content.model.python)
    return content


def system_of(content: EquationsFile, source: str) -> System:
    """Return the checked equations of a file. Raises InputError with every finding, each with `source` and key."""
    reading = _Reading(content, source)
    reading.check_names()
    terms = reading.terms()
    rates = {
        name: reading.tree(f"states.{name}.rate", one.rate) for name, one in content.model.states.items()
    }
    values = {
        name: reading.tree(f"outputs.{name}.value", one.value) for name, one in content.model.outputs.items()
    }
    events = reading.events()
    reading.raise_all()
    scope = reading.scope(terms)
    reading.raise_all()
    reading.check_units(scope, rates, values)
    reading.check_events(scope, events)
    reading.raise_all()
    system = reading.system(terms, rates, values, events)
    reading.check_start(system)
    reading.raise_all()
    return system


def factor_of(unit: str) -> float:
    """Return how many SI base units one `unit` is. Raises ValueError for one whose zero means something."""
    quantity = unit_registry().Quantity(1.0, parsed_unit(unit))
    if not quantity._is_multiplicative:
        raise ValueError(f'"{unit}" is a logarithm or has its zero elsewhere; take K, V or a plain number')
    return float(quantity.to_base_units().magnitude)


class _Reading:
    """A file, and the findings so far."""

    def __init__(self, content: EquationsFile, source: str) -> None:
        self._model, self._source, self._lines = content.model, source, list[str]()
        tables = {word: getattr(self._model, word) for word in TABLES}
        self._places = [(name, f"{word}.{name}") for word, table in tables.items() for name in table]
        self._known = {name for name, _ in self._places}
        self._asked: set[str] = set()
        self._blocks: dict[str, Block] = {}
        with self._under("python"):
            self._blocks = blocks_of(self._model, source)
        self.raise_all()  # without its functions every expression would be wrong

    def problem(self, where: str, text: str) -> None:
        self._lines.append(f"{self._source}: model.{where}: {text}")

    @contextmanager
    def _under(self, where: str) -> Iterator[None]:
        try:
            yield
        except ValueError as error:
            self.problem(where, str(error))

    def raise_all(self) -> None:
        if self._lines:
            raise InputError("\n".join(dict.fromkeys(self._lines)))

    def check_names(self) -> None:
        """Check that names are names, that none is taken, and that the tables that are needed are there."""
        seen: dict[str, str] = {}
        for name, where in [*self._places, *((name, f"outputs.{name}") for name in self._model.outputs)]:
            if not NAME.match(name):
                self.problem(where, f'"{name}" is no name: letters, digits and _, a letter first')
            if name in RESERVED:
                what = "a function" if name in FUNCTIONS else "the time" if name == TIME else "a word"
                self.problem(where, f'"{name}" is {what} of the language; choose another name')
            if name in seen and not where.startswith("outputs."):
                self.problem(where, f'"{name}" is the name of model.{seen[name]} too; choose another one')
            seen.setdefault(name, where)
        for name, event in self._model.events.items():
            if not NAME.match(name):
                self.problem(f"events.{name}", f'"{name}" is no name: letters, digits and _, a letter first')
            for state in event.set.keys() - self._model.states.keys():
                hint = nearest(state, self._model.states)
                self.problem(f"events.{name}.set.{state}", f'the model has no state "{state}"{hint}')
        for word in ("states", "outputs"):
            if not getattr(self._model, word):
                self.problem(word, "is empty; at least one is needed")

    def tree(self, where: str, text: str) -> Tree:
        """Return the tree of an expression; what is wrong becomes a finding."""
        quoted = f'{where} = "{text if len(text) <= 100 else text[:97] + "..."}"'
        tree = ZERO
        with self._under(quoted):
            tree = bound(parse(text), self._blocks)
        for name in dict.fromkeys(names_in(tree)):
            if name not in self._known and name != TIME and name not in CONSTANTS:
                self.problem(quoted, f'"{name}" is unknown{self._hint(name)}')
        self._asked |= set(names_in(tree))
        return tree

    def _hint(self, name: str) -> str:
        if name in FUNCTIONS:
            return f"; the function {name} needs its arguments in brackets"
        if name in self._model.outputs:
            return "; an output stands in no equation, give its expression under model.terms"
        return nearest(name, self._known | {TIME} | CONSTANTS.keys())

    def terms(self) -> dict[str, Tree]:
        """Return the helper terms, each after those that it needs."""
        trees = {name: self.tree(f"terms.{name}", one.value) for name, one in self._model.terms.items()}
        with self._under("terms"):
            return ordered(trees)
        return {}

    def events(self) -> tuple[Event, ...]:
        """Return the events; what is wrong becomes a finding."""
        return tuple(
            Event(
                name=name,
                when=self.tree(f"events.{name}.when", one.when),
                direction=DIRECTIONS[one.direction],
                sets={
                    state: self.tree(f"events.{name}.set.{state}", text) for state, text in one.set.items()
                },
            )
            for name, one in self._model.events.items()
        )

    def scope(self, terms: Mapping[str, Tree]) -> dict[str, Unit]:
        """Return the unit of each name. Raises InputError where one is no unit."""
        scope = {TIME: unit_registry().second, **dict.fromkeys(CONSTANTS, unit_registry().dimensionless)}
        for name, where in self._places:
            unit = getattr(getattr(self._model, where.partition(".")[0])[name], "unit", None)
            if unit is not None:
                with self._under(f"{where}.unit"):
                    factor_of(unit)
                    scope[name] = parsed_unit(unit)
        self.raise_all()  # a name without a unit would say nothing of the terms that it stands in
        for name, tree in terms.items():
            declared = scope.get(name)
            with self._under(f'terms.{name} = "{self._model.terms[name].value}"'):
                if declared is not None:
                    check_terms(tree, scope, declared)
                else:
                    scope[name] = unit_of(tree, scope) or unit_registry().dimensionless
            scope.setdefault(name, unit_registry().dimensionless)
        return scope

    def check_units(
        self, scope: Mapping[str, Unit], rates: Mapping[str, Tree], values: Mapping[str, Tree]
    ) -> None:
        """Check each term of each equation."""
        for name, tree in rates.items():
            with self._under(f'states.{name}.rate = "{self._model.states[name].rate}"'):
                check_terms(tree, scope, scope[name] / unit_registry().second)
        for name, tree in values.items():
            table = self._model.outputs[name]
            with self._under(f'outputs.{name}.value = "{table.value}"'):
                factor_of(table.unit)
                expected, found = parsed_unit(table.unit), unit_of(tree, scope)
                if not fits(found, expected):
                    raise ValueError(f"it {stated(found)}, the output's unit is {named(expected)}")

    def check_events(self, scope: Mapping[str, Unit], events: Sequence[Event]) -> None:
        """Check each term of each event, and that what is to pass zero can change."""
        moving = {TIME, *self._model.inputs, *self._model.states}
        for one in events:
            table, named_by = self._model.events[one.name], set(names_in(one.when))
            with self._under(f'events.{one.name}.when = "{table.when}"'):
                unit_of(one.when, scope)
                if not named_by & (moving | self._model.terms.keys()):
                    raise ValueError("it never changes: no state, input, term or time stands in it")
            for state, tree in one.sets.items():
                with self._under(f'events.{one.name}.set.{state} = "{table.set[state]}"'):
                    check_terms(tree, scope, scope[state])

    def system(
        self,
        terms: Mapping[str, Tree],
        rates: Mapping[str, Tree],
        values: Mapping[str, Tree],
        events: tuple[Event, ...],
    ) -> System:
        """Return the system of equations whose units are right."""
        model = self._model
        return System(
            inputs=tuple(
                Input(name=name, unit=one.unit, factor=factor_of(one.unit)) for name, one in model.inputs.items()
            ),
            states=tuple(
                State(
                    name=name, unit=one.unit, factor=factor_of(one.unit), rate=rates[name],
                    initial=one.initial * factor_of(one.unit), known=one.fixed,
                    low=-math.inf if one.low is None else one.low * factor_of(one.unit),
                    high=math.inf if one.high is None else one.high * factor_of(one.unit),
                )
                for name, one in model.states.items()
            ),
            outputs=tuple(
                Output(name=name, unit=one.unit, factor=factor_of(one.unit), value=values[name])
                for name, one in model.outputs.items()
            ),
            parameters=tuple(
                Constant(
                    name=name, unit=one.unit, factor=factor_of(one.unit), value=one.value, fixed=one.fixed,
                    low=-math.inf if one.low is None else one.low,
                    high=math.inf if one.high is None else one.high,
                )
                for name, one in model.parameters.items()
            ),
            terms=dict(terms),
            events=events,
        )  # fmt: skip

    def check_start(self, system: System) -> None:
        """Check the parameters' bounds, and that rates and outputs are finite at the start, inputs being 0 or 1."""
        for one in system.parameters:
            if not one.low <= one.value <= one.high:
                self.problem(
                    f"parameters.{one.name}",
                    f"value = {one.value:g} {one.unit} must lie between low = {one.low:g} and high = {one.high:g}",
                )
        keys = [f'states.{name}.rate = "{one.rate}"' for name, one in self._model.states.items()]
        keys += [f'outputs.{name}.value = "{one.value}"' for name, one in self._model.outputs.items()]
        keys += [f'events.{name}.when = "{one.when}"' for name, one in self._model.events.items()]
        with np.errstate(all="ignore"):
            trials = [
                start_values(system, {one.name: level for one in system.inputs}) for level in (0.0, 1.0)
            ]
        trees = (*system.trees, *(one.when for one in system.events))
        for key, tree in zip(keys, trees, strict=True):
            found = [float(evaluate(tree, values)) for values in trials]
            if not any(math.isfinite(value) for value in found):
                self.problem(key, f"it is {found[0]:g} at the start; correct it, or initial and parameters")


def start_values(system: System, inputs: Mapping[str, float]) -> dict[str, float]:
    """Return the number [SI] of each name at the start of a record with these `inputs` [SI]."""
    values = dict(inputs) | {TIME: 0.0}
    values |= {one.name: one.initial for one in system.states}
    values |= {one.name: one.value * one.factor for one in system.parameters}
    for name, tree in system.terms.items():
        values[name] = float(evaluate(tree, values))
    return values
