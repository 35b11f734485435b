"""A sentence that says that the drive is held between its samples: `D/A output is a zero-order hold`, `Halteglied`.

Only what is said of the drive or its converter counts. A sentence about a sensor, about a model or a filter, with a
negation, or of another meaning of "hold" (a hold time, a level that is held) says nothing.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

_CONVERTER = (
    r"d/a\b|\bdac\b|\bda-?(?:wandler|converter|umsetzer)|d/?a-?(?:wandler|umsetzer)|analog(?:ue)?[ -]output"
)
_OF_ORDER_ZERO = re.compile(
    r"\b(?:zero|0|0th|zeroth)[ -]*order[ -]*hold|\bzoh\b|nullter ordnung|\b0\.? ?(?:ter )?ordnung|"
    r"\bhold\b[ :=\"]*(?:is |of )?(?:zero|order (?:zero|0))\b|(?:bloqueur|maintien).*ordre (?:z[ée]ro|0)"
)
_HOLDS = re.compile(
    r"sample[ -/]*(?:and|&|n)?[ -]*hold|\bs[&/]h\b|abtast-?(?:und-?|-)?halte|\bhalteglied|"
    r"\b(?:holds?|held|hält|haelt|halten|gehalten)\b"
)
_DRIVES = re.compile(rf"{_CONVERTER}|\bdrive signal\b|\bcommand\b|\bstellgr(?:ö|oe)(?:ß|ss)e")
_MEASURED = re.compile(
    r"a/d|\badc\b|ad-?(?:wandler|umsetzer|converter)|analog(?:ue)?[ -]in|sensor|encoder|gauge|vibromet|measur|mess|"
    r"position|displac|deflect|veloc|accel|respons|\bchannels?\b|kan(?:al|äle)|eingang|weg\b|geschw|beschl"
)
_OTHERWISE = re.compile(
    r"\b(?:no|not|non|without|never|instead|unlike|nor|off|nicht|ohne|statt|kein\w*|if|falls|wenn|whether|or|oder|not)\b|"
    r"n't\b|non-|\?|model|discreti|diskret|c2d|simul|filter|resampl|interpol|estimat|observ|beobacht|assum|"
    r"compens|kompens|correct|korrig|remov|deconv|smooth|reconstr|first[ -]order|erster ordnung|\bfoh\b"
)
_A_LEVEL = re.compile(
    r"\b(?:held|holds?|gehalten|hält|halten)\b.{0,30}\b(?:constant|at|in|by|for|before|after|auf|bei|vor|konstant)\b|"
    r"\bto hold\b|\bhold(?:ing)?[ -](?:on|time|off|current|torque)|haltezeit"
)
_CLAUSES = re.compile(
    r"[,;|\t\n()]|\.\s(?!ordnung)|\b(?:and|und|but|aber|while|whereas|während)\b(?![ -]*hold|-?halte)"
)
_LONGEST, _SHOWN = 500, 60
"""Characters of a text that are looked at, and that are shown."""


def told_hold(texts: Mapping[str, str]) -> str:
    """Return which text of a file says that the drive is held between its samples; "": none does.

    Args:
        texts: Texts by where they stand, such as `line 2 "D/A output is a zero-order hold"`.
    """
    return next((_cited(where, text) for where, text in texts.items() if says_held(text)), "")


def says_held(text: str) -> bool:
    """Return whether a clause of a text says that the drive is held between its samples."""
    return any(_clause_says(one) for one in _CLAUSES.split(text[:_LONGEST].lower()))


def _cited(where: str, text: str) -> str:
    """Return a text with its place; the place of a line cites it already."""
    words = " ".join(text.split())
    short = f"{words[:_SHOWN]}..." if len(words) > _SHOWN else words
    return where if where.startswith("line ") else f'{where}, "{short}"'


def _clause_says(clause: str) -> bool:
    if _OTHERWISE.search(clause) or _MEASURED.search(clause):
        return False
    if _OF_ORDER_ZERO.search(clause):
        return True
    return bool(_HOLDS.search(clause) and _DRIVES.search(clause) and not _A_LEVEL.search(clause))
