"""Which column is which signal: by the user's word, by names and units, then by what is left, then by what leads."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.measured.proposal.candidates import Candidate
from rtctl.measured.proposal.causality import leads
from rtctl.measured.proposal.given import NONE, Given
from rtctl.measured.proposal.naming.column_names import WEAK
from rtctl.measured.proposal.naming.column_units import MOTIONS, is_force, quantity_of
from rtctl.measured.proposal.proposal import Open
from rtctl.registry import PlantKind, SignalKind

OTHER_PLANT = "--model MODEL.toml"
"""Option for data of what is no oscillator, which name and unit of no column tell."""
CLEAR = 1.0
"""Difference of two scores from which one column is preferred."""

DECAYED = 0.5
"""Variation of a motion's last quarter over that of its first below which it decays as a release does."""


class Choice(NamedTuple):
    """The column of a signal."""

    column: str
    why: str
    certain: bool = False


@dataclass(slots=True, kw_only=True)
class Roles:
    """Columns by signal, as far as they are known."""

    chosen: dict[str, Choice] = field(default_factory=dict)
    opens: list[Open] = field(default_factory=list)
    unsure: list[str] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)
    undriven: dict[str, str] = field(default_factory=dict)
    """Inputs that are 0 and no column has, as in a release, each with the reason."""
    suggested: list[str] = field(default_factory=list)
    """Columns that an example has as the input; no example has one twice."""

    def is_free(self, column: str) -> bool:
        """Return whether no signal has the column."""
        return all(one.column != column for one in self.chosen.values())


def assign_roles(
    candidates: Mapping[str, Candidate],
    plant: PlantKind,
    given: Mapping[str, Given],
    silent: Mapping[str, Candidate],
    constant: Collection[str] = (),
) -> Roles:
    """Return the columns of a plant's signals, and what must be asked.

    Args:
        candidates: Columns that vary.
        plant: Kind of plant, with its signals.
        given: What the user says.
        silent: Columns that are 0 throughout; one of them is the drive of a release, if its name says so.
        constant: Columns that are constant; where there is none and nothing but motions, a release has no drive.
    """
    roles = Roles()
    for signal, one in given.items():
        if one.column != NONE:
            roles.chosen[signal] = Choice(one.column, "you said so", certain=True)
        elif plant.signals[signal].role == "input" and plant.may_be_released:
            roles.undriven[signal] = "you said so: nothing drives"
    kinds = {signal: kind for signal, kind in plant.signals.items() if signal not in given}
    groups: dict[str, list[Candidate]] = {signal: [] for signal in kinds}
    for candidate in candidates.values():
        if roles.is_free(candidate.name) and (best := candidate.best(plant.signals)) in groups:
            groups[best].append(candidate)
    inputs = [signal for signal, kind in plant.signals.items() if kind.role == "input"]
    required = [signal for signal in inputs if not plant.signals[signal].optional] or inputs[:1]
    for signal in required:
        if signal in kinds:
            _choose_input(roles, signal, kinds[signal], groups, candidates)
            _take_silent_input(roles, signal, plant, groups, silent)
            _release(roles, signal, plant, groups, () if constant else candidates.values())
    for signal, kind in kinds.items():
        if signal not in required and signal not in roles.chosen:
            _choose_output(roles, signal, kind, [one for one in groups[signal] if roles.is_free(one.name)])
    _require_responses(roles, plant, candidates, groups)
    return roles


def _choose_input(
    roles: Roles,
    signal: str,
    kind: SignalKind,
    groups: Mapping[str, list[Candidate]],
    candidates: Mapping[str, Candidate],
) -> None:
    group = sorted(groups[signal], key=lambda one: -one.score(signal, kind))
    if group and (len(group) == 1 or _is_clear(signal, kind, group)):
        roles.chosen[signal] = Choice(group[0].name, _because(group[0]))
        return
    free = [one for one in candidates.values() if roles.is_free(one.name) and not one.is_no_signal]
    contenders = group or [one for one in free if not _is_output(one, groups)]
    leader = None if any(_is_named(one, signal) for one in contenders) else _leader(contenders, free)
    if leader is not None:
        roles.chosen[signal] = Choice(leader.name, "it leads the other signal in the data")
        roles.unsure.append(
            f'{signal}: neither name nor unit tells which column drives; "{leader.name}" leads in the data, the other '
            "follows it"
        )
        return
    if len(contenders) == 1 and len(free) > 1:
        roles.chosen[signal] = Choice(contenders[0].name, "it is the only column that is left")
        roles.unsure.append(
            f'{signal}: column "{contenders[0].name}", because it is the only one that is left'
        )
        return
    names = ", ".join(f'"{one.name}"' for one in contenders)
    text = f"no column looks like the {signal}"
    if contenders:
        text = f"several columns may be the {signal}: {names}"
        roles.suggested.append(contenders[0].name)
    if len(contenders) == 1:
        text = f"only column {names} may be the {signal}, and neither its name nor its unit says so"
    roles.opens.append(Open(signal, text, "--input COLUMN[:UNIT]", _example("--input", "", contenders)))


def _take_silent_input(
    roles: Roles,
    signal: str,
    plant: PlantKind,
    groups: Mapping[str, list[Candidate]],
    silent: Mapping[str, Candidate],
) -> None:
    """Take the one column of zeros whose name says that it drives, where no column that varies does.

    That is of a motion that decays: where it goes on, a drive acted that was not recorded, and that is asked.
    """
    motions = [one for name, group in groups.items() if plant.signals[name].role == "output" for one in group]
    named = [
        one
        for one in silent.values()
        if roles.is_free(one.name) and one.best(plant.signals) == signal and _is_named(one, signal)
    ]
    if groups[signal] or len(named) != 1 or not any(_decays(one.values) for one in motions):
        return
    roles.chosen[signal] = Choice(named[0].name, "by its name; it is 0 throughout, as in a release")
    roles.opens[:] = [one for one in roles.opens if one.key != signal]
    roles.unsure[:] = [one for one in roles.unsure if not one.startswith(f"{signal}:")]


def _release(
    roles: Roles,
    signal: str,
    plant: PlantKind,
    groups: Mapping[str, list[Candidate]],
    columns: Collection[Candidate],
) -> None:
    """Take the input as 0 where `columns`, all of a file but its time, are motions that decay."""
    motions = [one for name, group in groups.items() if plant.signals[name].role == "output" for one in group]
    if not columns or any(one not in motions or not _decays(one.values) for one in columns):
        return
    roles.undriven[signal] = "no column drives, and the motion decays, as in a release"
    roles.opens[:] = [one for one in roles.opens if one.key != signal]
    roles.unsure[:] = [one for one in roles.unsure if not one.startswith(f"{signal}:")]
    roles.unsure.append(f"{signal}: {roles.undriven[signal]}: it is 0; if something drove, record it beside")


def _is_clear(signal: str, kind: SignalKind, group: list[Candidate]) -> bool:
    """Return whether the first column is clearly the signal: no other one has a name that says so."""
    first, second = (one.score(signal, kind) for one in group[:2])
    return first - second >= CLEAR and not any(_is_named(one, signal) for one in group[1:])


def _decays(values: FloatArray) -> bool:
    """Return whether a motion (n,) varies much less in its last quarter than in its first."""
    quarter = max(len(values) // 4, 1)
    return bool(np.std(values[-quarter:]) < DECAYED * np.std(values[:quarter]))


def _is_named(candidate: Candidate, signal: str) -> bool:
    return (
        max(
            candidate.named.get("drive", 0.0),
            candidate.named.get(signal, 0.0),
            candidate.named.get("current", 0.0),
        )
        >= WEAK
    )


def _is_output(candidate: Candidate, groups: Mapping[str, list[Candidate]]) -> bool:
    return any(candidate in group for group in groups.values()) or "response" in candidate.reading.votes


def _leader(contenders: list[Candidate], free: list[Candidate]) -> Candidate | None:
    """Return which of two columns leads the other, where that shows; a third one would make it a guess."""
    pair = contenders if len(contenders) == 2 else free
    if len(pair) != 2 or len(contenders) > 2:
        return None
    first, second = pair
    way = leads(first.values, second.values)
    return None if way == 0 else first if way > 0 else second


def _choose_output(roles: Roles, signal: str, kind: SignalKind, group: list[Candidate]) -> None:
    if len(group) == 1:
        roles.chosen[signal] = Choice(group[0].name, _because(group[0]))
    elif group:
        names = ", ".join(f'"{one.name}"' for one in group)
        text = f"several columns may be the {signal}: {names}"
        option = f"--output {signal}=COLUMN[:UNIT]"
        roles.opens.append(Open(signal, text, option, _example("--output", f"{signal}=", group)))


def _require_responses(
    roles: Roles, plant: PlantKind, candidates: Mapping[str, Candidate], groups: Mapping[str, list[Candidate]]
) -> None:
    """Keep questions only about signals that the plant needs; add one where no response is known."""
    responses = plant.responses
    has_response = any(signal in roles.chosen for signal in responses)
    kept = []
    for one in roles.opens:
        optional = plant.signals[one.key].optional and (has_response or one.key not in responses)
        if optional:
            for candidate in groups[one.key]:
                roles.left_out[candidate.name] = f"one of several columns that may be the {one.key}"
        else:
            kept.append(one)
    roles.opens[:] = kept
    for signal, kind in plant.signals.items():
        if not kind.optional and kind.role == "output" and signal not in roles.chosen and not kept:
            roles.opens.append(
                Open(signal, f"no column looks like the {signal}", f"--output {signal}=COLUMN[:UNIT]")
            )
    if responses and not has_response and not any(one.key in responses for one in kept):
        free = [one for one in candidates.values() if roles.is_free(one.name) and not one.is_no_signal]
        others = [one for one in free if one.name not in roles.suggested]
        free = free if len(free) > 1 else others
        likely = _likely_responses(others)
        names = (
            ", ".join(f'"{one.name}"' for one in free) or "no column of numbers is left that may be a motion"
        )
        text = (
            f"which motion was measured ({', '.join(responses)}), and in which column, does not show: {names}"
        )
        motion = (_motion_of(likely[0]) if likely else "") or responses[0]
        option = f"--output {motion}=COLUMN[:UNIT]; where no motion was measured: {OTHER_PLANT}"
        example = _example("--output", f"{motion}=", likely) or OTHER_PLANT
        roles.opens.append(Open("response", text, option, example))


def _motion_of(candidate: Candidate) -> str:
    """Return the motion that a column's unit measures; "": none."""
    measured = quantity_of(candidate.unit.text) if candidate.unit.text else ""
    return measured if measured in MOTIONS else ""


def _likely_responses(candidates: list[Candidate]) -> list[Candidate]:
    """Return columns that may be a response, those in a unit of a motion first; a force is none."""
    motions = [one for one in candidates if not (one.unit.text and is_force(one.unit.text))]
    return sorted(motions, key=lambda one: not _motion_of(one))


def _example(option: str, name: str, candidates: list[Candidate]) -> str:
    """Return an option with the first candidate's column; "" without one."""
    if not candidates:
        return ""
    unit = "" if candidates[0].unit.text else ":UNIT"
    return f"{option} {shlex.quote(name + candidates[0].name + unit)}"


def _because(candidate: Candidate) -> str:
    """Return why a column is a signal: its name, its unit, or both."""
    by_name = any(vote >= WEAK for vote in candidate.named.values())
    if by_name and candidate.unit.text:
        return "by its name and its unit"
    return "by its name" if by_name else "by its unit"
