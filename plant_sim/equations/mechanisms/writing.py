"""Mechanisms written into a user's file: as terms of its equations where these can say it, else by their ids."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from plant_sim.equations.language.parser import parse
from plant_sim.equations.language.simplifying import simplified
from plant_sim.equations.language.tree import Name, Tree, names_in, substituted, written
from plant_sim.equations.mechanisms.mechanism import PARAMETERS, RATES, EquationsMechanism
from plant_sim.equations.mechanisms.signals import INPUTS, OUTPUTS
from plant_sim.equations.mechanisms.words import Names, output_reference
from plant_sim.equations.reading import factor_of
from plant_sim.equations.system import System
from rtctl.border.equations.file import EquationsFile, TermTable
from rtctl.border.model_file import MechanismTable, Value

Given = Mapping[str, Value]


def with_written_terms(
    content: EquationsFile, system: System, mechanisms: Sequence[EquationsMechanism], tables: Mapping[str, Given]
) -> EquationsFile:  # fmt: skip
    """Return a file with mechanisms at given values.

    Args:
        content: The file of `system`.
        system: Its equations.
        mechanisms: What acts besides.
        tables: Values of the parameters of each, by id.
    """
    writer = _Writer(content, system)
    ordered = sorted(mechanisms, key=lambda one: one.law.stage if one.law else 0)
    for one in ordered:
        if one.family == RATES:
            writer.add_to_rate(one, tables[one.id])
        elif one.family == PARAMETERS:
            writer.change_parameter(one, tables[one.id])
        elif (text := inline_text(one)) and one.acts_on_input:
            writer.change_input(one, text, tables[one.id])
        elif text:
            writer.change_output(one, text, tables[one.id])
        else:
            writer.keep(one, tables[one.id])
    return writer.content()


def inline_text(mechanism: EquationsMechanism) -> str:
    """Return what a mechanism of a signal does as a text, {x} being the signal; "" where equations cannot say it."""
    laws = INPUTS if mechanism.acts_on_input else OUTPUTS
    law = laws.get(mechanism.id.rpartition(".")[2])
    return law.inline if law is not None and mechanism.law is not None else ""


class _Writer:
    """The tables of a file, on the way."""

    def __init__(self, content: EquationsFile, system: System) -> None:
        self._content, self._system, self._names = content, system, Names(system)
        model = content.model
        self._rates = {name: one.rate for name, one in model.states.items()}
        self._values = {name: one.value for name, one in model.outputs.items()}
        self._terms = {name: one.value for name, one in model.terms.items()}
        self._when = {name: one.when for name, one in model.events.items()}
        self._sets = {name: dict(one.set) for name, one in model.events.items()}
        self._added_terms: dict[str, str] = {}
        self._parameters = dict(model.parameters)
        self._kept: list[MechanismTable] = []

    def content(self) -> EquationsFile:
        model = self._content.model
        terms = {
            name: one.model_copy(update={"value": self._terms[name]}) for name, one in model.terms.items()
        }
        terms |= {name: TermTable(value=text) for name, text in self._added_terms.items()}
        update: dict[str, Any] = {
            "states": {
                name: one.model_copy(update={"rate": self._rates[name]}) for name, one in model.states.items()
            },
            "outputs": {
                name: one.model_copy(update={"value": self._values[name]})
                for name, one in model.outputs.items()
            },
            "terms": terms,
            "events": {
                name: one.model_copy(update={"when": self._when[name], "set": self._sets[name]})
                for name, one in model.events.items()
            },
            "parameters": self._parameters,
            "mechanisms": tuple(self._kept),
        }
        return self._content.model_copy(update={"model": model.model_copy(update=update)})

    def keep(self, one: EquationsMechanism, given: Given) -> None:
        self._kept.append(MechanismTable(id=one.id, parameters=dict(given)))

    def add_to_rate(self, one: EquationsMechanism, given: Given) -> None:
        added = self._filled(parse(one.text), one, given)
        if added is not None:
            self._rates[one.target] = _joined(self._rates[one.target], added)

    def change_parameter(self, one: EquationsMechanism, given: Given) -> None:
        added = self._filled(parse(one.text), one, given)
        if added is not None:
            text = f"{one.target}*({_joined('1', added)})"
            self._replace(one.target, self._names.new(f"{one.target}_now"), text)

    def change_input(self, one: EquationsMechanism, text: str, given: Given) -> None:
        changed = self._filled(self._of_signal(one, text, one.signal), one, given)
        if changed is not None:
            acting = self._names.new(f"{one.signal}_acting")
            self._replace(one.signal, acting, written(changed))

    def change_output(self, one: EquationsMechanism, text: str, given: Given) -> None:
        value = self._values[one.signal]
        reference = output_reference(self._system, one.signal)
        inside, zero = f"({value})", ""
        if reference and text != OUTPUTS["offset"].inline:
            zero = self._names.new(f"{one.signal}_reference")
            unit = next(o.unit for o in self._system.outputs if o.name == one.signal)
            self._parameters[zero] = Value(value=reference / factor_of(unit), unit=unit, fixed=True)
            inside = f"({value} - {zero})"
        changed = self._filled(self._of_signal(one, text, inside), one, given)
        if changed is not None:
            self._values[one.signal] = f"{zero} + {written(changed)}" if zero else written(changed)

    def _of_signal(self, one: EquationsMechanism, text: str, inside: str) -> Tree:
        names = {own.name: f"{one.signal}_{one.id.rpartition('.')[2]}_{own.name}" for own in one.parameters}
        return parse(text.format(x=inside, **names))

    def _filled(self, tree: Tree, one: EquationsMechanism, given: Given) -> Tree | None:
        """Return a tree without what is zero, its parameters being in the file; None where nothing is left."""
        own = dict(one.names) or {
            p.name: f"{one.signal}_{one.id.rpartition('.')[2]}_{p.name}" for p in one.parameters
        }
        values = {own[name]: value for name, value in given.items()}
        zero = {name for name in own.values() if name not in values or values[name].value == 0.0}
        found = simplified(tree, zero)
        if found is None:
            return None
        for name in dict.fromkeys(names_in(found)):
            if name in values:
                self._parameters[name] = values[name]
            elif name in one.references:
                unit, value = one.references[name]
                self._parameters[name] = Value(value=value, unit=unit, fixed=True)
        return found

    def _replace(self, name: str, by: str, text: str) -> None:
        """Put `by` in the place of `name` everywhere, and define it as `text`."""
        tables = (self._rates, self._values, self._terms, self._added_terms, self._when, *self._sets.values())
        for table in tables:
            for key, old in table.items():
                tree = parse(old)
                if name in names_in(tree):
                    table[key] = written(substituted(tree, {name: Name(by)}))
        self._added_terms[by] = text


def _joined(text: str, added: Tree) -> str:
    """Return a sum as a person writes it."""
    term = written(added)
    return f"{text} - {term[1:]}" if term.startswith("-") else f"{text} + {term}"
