"""The grammar of SCPI-99 messages: long and short headers with optional parts, units separated by semicolons."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import NamedTuple

_MNEMONIC = re.compile(r"[A-Z]+[a-z]*")
_OUTSIDE_QUOTES = r"""(?=(?:[^"']|"[^"]*"|'[^']*')*$)"""
_UNIT_END = re.compile(";" + _OUTSIDE_QUOTES)
_COMMA = re.compile("," + _OUTSIDE_QUOTES)


class Unit(NamedTuple):
    """One command or question of a message."""

    header: str
    """With the path of the unit before it, where it has none of its own."""
    is_query: bool
    parameters: tuple[str, ...]


@lru_cache(maxsize=1024)
def header_pattern(text: str) -> re.Pattern[str]:
    """Return what matches a header of the manuals: `:SOURce[1]:CURRent[:LEVel]`; capitals are the short form."""
    pattern, at = "", 0
    while at < len(text):
        found = _MNEMONIC.match(text, at)
        if found is not None:
            word = found[0]
            short = re.match("[A-Z]+", word)
            assert short is not None
            pattern += f"(?:{short[0]}|{word.upper()})"
            at = found.end()
            continue
        pattern += {"[": "(?:", "]": ")?"}.get(text[at], re.escape(text[at]))
        at += 1
    return re.compile(pattern.replace(":", ":?", 1) if text.startswith(":") else pattern, re.IGNORECASE)


def units_of(message: str) -> list[Unit]:
    """Return the units of a message; a header without a leading colon continues the path of the one before."""
    units: list[Unit] = []
    path = ""
    for text in _UNIT_END.split(message):
        head, _, rest = text.strip().partition(" ")
        if not head:
            continue
        if units and not head.startswith((":", "*")):
            head = f"{path}:{head}"
        is_query = head.endswith("?")
        head = head.removesuffix("?")
        if not head.startswith("*"):
            path = head.rpartition(":")[0]
        units.append(Unit(head, is_query, tuple(part.strip() for part in _COMMA.split(rest) if part.strip())))
    return units


def plain(parameter: str) -> str:
    """Return a parameter without its quotes, in capitals."""
    return parameter.strip("\"'").upper()
