"""Files that hold several records in groups of the same columns: each group is taken as a file of its own.

Labs save so: an array of structs `rec(1..5)`, HDF5 groups `run_001`, `run_002`, groups of TDMS. Groups are records
where they stand beside each other and have two columns or more in common that may be signals; groups of one signal each
are the channels of an instrument.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from rtctl.measured.proposal.given import find_whole
from rtctl.measured.proposal.naming.column_names import STRONG
from rtctl.measured.proposal.naming.column_units import read_column
from rtctl.measured.proposal.naming.labels import with_labels
from rtctl.measured.proposal.proposal import Answers
from rtctl.measured.proposal.survey import Column, Survey
from rtctl.measured.readers.groups import Place, names_within

FEWEST_SIGNALS = 2
"""Columns that may be signals, from which groups are records: a drive and a response."""
_NO_SIGNALS = ("time", "index", "rate", "period")


def by_groups(surveys: Sequence[Survey], answers: Answers) -> tuple[Survey, ...]:
    """Return the surveys with one for each record in the place of a file that holds several.

    A file of which the options name columns by their whole path (`rec(2).x`) stays one: the user means these columns.
    Columns have their labels then.
    """
    found: list[Survey] = []
    for survey in surveys:
        groups = record_groups(survey)
        if not groups or _are_named(survey, groups, answers):
            found.append(replace(survey, columns=with_labels(survey.columns)))
        else:
            found += [
                _part(survey, group, groups, survey.remarks if k == 0 else ())
                for k, group in enumerate(groups)
            ]
    return tuple(found)


def record_groups(survey: Survey) -> list[str]:
    """Return the groups of a file that are its records, in its order; []: there are none."""
    best: list[str] = []
    for siblings in _siblings(survey).values():
        columns = {group: _signals(survey, group) for group in siblings}
        counts = Counter(frozenset(names) for names in columns.values() if len(names) >= FEWEST_SIGNALS)
        having = {core: [group for group, names in columns.items() if core <= names] for core in counts}
        for groups in having.values():
            if len(groups) > max(len(best), 1):
                best = groups
    return best


def _siblings(survey: Survey) -> dict[tuple[str, ...], list[str]]:
    """Return the groups that stand beside each other, by what is around them, in the file's order."""
    found: dict[tuple[str, ...], list[str]] = {}
    for column in survey.columns.values():
        groups = column.place.groups
        for k, group in enumerate(groups):
            beside = found.setdefault(groups[:k], [])
            if group not in beside:
                beside.append(group)
    return found


def _signals(survey: Survey, group: str) -> set[str]:
    """Return the columns within a group that may be signals, by their names in it."""
    inside = [one for one in survey.columns.values() if group in one.place.groups]
    rows = max((one.rows for one in inside if one.values is not None), default=0)
    return {
        one.place.within(group)
        for one in inside
        if one.values is not None and 1 < one.rows == rows and not _tells_time(one, group)
    }


def _tells_time(column: Column, group: str) -> bool:
    """Return whether a column increases throughout, or is called as a time is."""
    assert column.values is not None
    votes = read_column(replace(column, label=column.place.within(group))).votes
    return bool(np.all(np.diff(column.values) > 0.0)) or any(
        votes.get(one, 0.0) >= STRONG for one in _NO_SIGNALS
    )


def _are_named(survey: Survey, groups: Sequence[str], answers: Answers) -> bool:
    """Return whether an option names a column of one of the groups by its whole path."""
    inside = [
        name
        for name, one in survey.columns.items()
        if any(group in one.place.groups and name != one.place.within(group) for group in groups)
    ]
    said = [*answers.inputs, *answers.outputs, *([answers.time] if answers.time else [])]
    return any(_names_one(text, inside) for text in said)


def _names_one(text: str, columns: Collection[str]) -> bool:
    """Return whether a text `[NAME=]COLUMN[:UNIT]` names one of the columns."""
    words = [text, text.partition("=")[2]]
    return any(
        find_whole(one.strip(), columns) is not None
        for word in words
        for one in (word, word.rpartition(":")[0])
        if one
    )


def _part(survey: Survey, group: str, groups: Collection[str], remarks: tuple[str, ...]) -> Survey:
    """Return one group of a file, with what stands above it."""
    places: Mapping[str, Place] = {name: one.place for name, one in survey.columns.items()}
    rows = max(
        one.rows for one in survey.columns.values() if group in one.place.groups and one.values is not None
    )
    seen = {
        short: survey.columns[name]
        for short, name in names_within(places, group).items()
        if (
            group in places[name].groups or survey.columns[name].rows <= rows
        )  # longer ones are of something else
        and not any(other.startswith((f"{name}(", f"{name}{{")) for other in groups)  # what holds the groups
    }
    columns = with_labels(
        {short: replace(one, name=short, place=_below(one.place, group)) for short, one in seen.items()}
    )
    return Survey(path=survey.path, columns=columns, remarks=remarks, texts=survey.texts, group=group)


def _below(place: Place, group: str) -> Place:
    """Return a place as seen from a group: what is above it is at its top."""
    if group not in place.groups:
        return Place(place.path)
    inner = place.groups[place.groups.index(group) + 1 :]
    return Place(place.within(group), tuple(one[len(group) + 1 :] for one in inner))
