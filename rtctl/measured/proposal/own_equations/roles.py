"""Which column is which signal of a model: by the user's word, by the signal's name and unit, then by what is left."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence

from rtctl.measured.proposal.candidates import Candidate
from rtctl.measured.proposal.given import NONE, Given
from rtctl.measured.proposal.own_equations.signals import signal_name
from rtctl.measured.proposal.proposal import Answers, Open
from rtctl.measured.proposal.roles import Choice, Roles
from rtctl.measured.units import check_unit
from rtctl.registry import PlantKind, SignalKind


def assign_named_roles(
    candidates: Mapping[str, Candidate], plant: PlantKind, given: Mapping[str, Given], answers: Answers
) -> Roles:
    """Return the columns of the signals that a model names, and what must be asked."""
    roles = Roles()
    for signal, one in given.items():
        if one.column != NONE:
            roles.chosen[signal] = Choice(one.column, "you said so", certain=True)
    if answers.model is None:
        roles.opens += _without_names(candidates, answers)
        roles.unsure.append(
            "model: write the equations with inputs and outputs of these names (docs/equations.md), then go on with "
            "rtctl identify and --model"
        )
        return roles
    missing = {name: kind for name, kind in plant.signals.items() if name not in given}
    for called, why in ((True, "by its name"), (False, "by its unit")):
        for name, kind in missing.items():
            if name not in roles.chosen:
                found = _matching(name, kind, roles, candidates, called=called)
                if len(found) == 1 and (called or _only_one(found[0], missing, roles)):
                    roles.chosen[name] = Choice(found[0].name, why)
    for name, kind in missing.items():
        if name not in roles.chosen:
            free = [one for one in candidates.values() if roles.is_free(one.name)]
            roles.opens.append(_question(name, kind, free, roles.suggested))
    return roles


def _matching(
    name: str, kind: SignalKind, roles: Roles, candidates: Mapping[str, Candidate], *, called: bool
) -> list[Candidate]:
    """Return the free columns that may be a signal by their units; of these, if asked, those that are called so."""
    free = [one for one in candidates.values() if roles.is_free(one.name) and _may_be(one, kind)]
    if not called:
        return [one for one in free if one.unit.text]
    same = [one for one in free if signal_name(one.name) == name]
    return same or [one for one in free if name in re.split(r"[\W_]+", one.name)]


def _may_be(candidate: Candidate, kind: SignalKind) -> bool:
    """Return whether the unit of a column, where one is stated, measures what the signal's does."""
    if not candidate.unit.text:
        return True
    try:
        check_unit(candidate.unit.text, kind.like)
    except ValueError:
        return False
    return True


def _only_one(candidate: Candidate, missing: Mapping[str, SignalKind], roles: Roles) -> bool:
    """Return whether no other signal without a column is measured in the unit of this one."""
    return sum(name not in roles.chosen and _may_be(candidate, kind) for name, kind in missing.items()) == 1


def _question(name: str, kind: SignalKind, free: Sequence[Candidate], suggested: list[str]) -> Open:
    """Ask for the column of a signal; the example has one that no question before has `suggested`, and adds it."""
    fitting = [one for one in free if _may_be(one, kind)] or list(free)
    names = ", ".join(f'"{one.name}"' for one in fitting) or "no column is left"
    option = f"--{kind.role} {name}=COLUMN[:UNIT]"
    example = ""
    if fitting:
        one = next((one for one in fitting if one.name not in suggested), fitting[0])
        suggested.append(one.name)
        unit = "" if one.unit.text else ":UNIT"
        example = f"--{kind.role} {shlex.quote(f'{name}={one.name}{unit}')}"
    text = f'which column is the {kind.role} "{name}" [{kind.like}] of the model does not show: {names}'
    return Open(name, text, option, example)


def _without_names(candidates: Mapping[str, Candidate], answers: Answers) -> list[Open]:
    """Return the question for the signals themselves, where neither a model nor options name an output."""
    if answers.outputs:
        return []
    named = [text.partition("=")[2].partition(":")[0] for text in answers.inputs]
    free = [one for one in candidates.values() if one.name not in named]
    driving = [one for one in free if {"drive", "current"} & one.reading.votes.keys()] or free[:1]
    inputs = [] if answers.inputs else driving[:1]
    words = [("input", one) for one in inputs] + [("output", one) for one in free if one not in inputs]
    example = " ".join(
        f"--{role} {shlex.quote(signal_name(one.name) + '=' + one.name + ('' if one.unit.text else ':UNIT'))}"
        for role, one in words
    )
    text = "the signals of a model of equations have the names that the model gives them, which no data file tells"
    return [Open("signals", text, "--model MODEL.toml, or --input NAME=COLUMN[:UNIT] and --output NAME=COLUMN[:UNIT]",
                 example or "--model MODEL.toml")]  # fmt: skip
