"""What the user says of columns, `[NAME=]COLUMN[:UNIT]`, held against the columns that there are."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from typing import NamedTuple

from rtctl.border.errors import InputError, nearest
from rtctl.measured.manifest.signal_kinds import measured_kinds
from rtctl.measured.proposal.naming.column_names import bare_name
from rtctl.measured.proposal.proposal import Answers
from rtctl.registry import SignalKind

NONE = "-"


class Given(NamedTuple):
    """A column that the user named."""

    column: str
    """The column; NONE: there is none."""
    unit: str
    """Unit in the user's words; "": none was said."""


def check_plant(plant: str) -> None:
    """Raise InputError for a kind of plant that has no datasets."""
    known = measured_kinds()
    if plant not in known:
        raise InputError(f'--plant {plant}: there are no datasets of a "{plant}"{nearest(plant, known)}')


def column_and_unit(text: str, columns: Collection[str], option: str) -> Given:
    """Return column and unit of `COLUMN[:UNIT]`; a name may hold colons, and may be told without its unit in brackets.

    Raises:
        InputError: There is no such column; the message has the nearest one.
    """
    if text == NONE:
        return Given(NONE, "")
    if (column := find_column(text, columns)) is not None:
        return Given(column, "")
    name, _, unit = text.rpartition(":")
    if (column := find_column(name, columns)) is not None:
        return Given(column, unit.strip())
    raise InputError(f'{option} {text}: no column "{name or text}"{nearest(name or text, columns)}')


def find_column(name: str, columns: Collection[str]) -> str | None:
    """Return the column of that name, or the only one of that name without its unit or its group.

    `Drive` is `Drive [V]`, `force` is `shaker run/force`.
    """
    if (whole := find_whole(name, columns)) is not None:
        return whole
    said = name.strip().lower()
    meant = [one for one in columns if _without_group(bare_name(one)).lower() == said]
    return meant[0] if len(meant) == 1 and any(letter.isalpha() for letter in said) else None


def find_whole(name: str, columns: Collection[str]) -> str | None:
    """Return the column of that name, or the only one of that name before its unit."""
    if name in columns:
        return name
    meant = [one for one in columns if bare_name(one).lower() == name.strip().lower() != ""]
    return meant[0] if len(meant) == 1 else None


def _without_group(name: str) -> str:
    return re.split(r"[./]", name)[-1]


def given_signals(
    answers: Answers, kinds: Mapping[str, SignalKind], columns: Collection[str]
) -> dict[str, Given]:
    """Return the columns that the user named, by signal. Raises InputError in words."""
    found: dict[str, Given] = {}
    for role, option, texts in (
        ("input", "--input", answers.inputs),
        ("output", "--output", answers.outputs),
    ):
        names = [name for name, kind in kinds.items() if kind.role == role]
        for text in texts:
            signal, given = _signal_and_column(text, names, columns, option)
            if signal in found:
                raise InputError(f"{option} {text}: {signal} is named twice; keep one")
            found[signal] = given
    used = [given.column for given in found.values() if given.column != NONE]
    twice = next((name for name in used if used.count(name) > 1), None)
    if twice is not None:
        raise InputError(f'column "{twice}" is named for two signals; correct one of --input and --output')
    return found


def _signal_and_column(
    text: str, names: list[str], columns: Collection[str], option: str
) -> tuple[str, Given]:
    signal, equals, rest = text.partition("=")
    if equals and signal.strip() in names:
        return signal.strip(), column_and_unit(rest.strip(), columns, option)
    if len(names) == 1:
        return names[0], column_and_unit(text, columns, option)
    if equals and text not in columns:
        raise InputError(f'{option} {text}: no signal "{signal.strip()}"{nearest(signal.strip(), names)}')
    raise InputError(
        f"{option} {text}: say which signal it is: {option} {names[0]}={text} ({', '.join(names)})"
    )
