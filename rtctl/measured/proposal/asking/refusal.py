"""A proposal with open questions and nobody to ask: one message with what is taken, what is not, and what to say."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from rtctl.border.errors import InputError
from rtctl.measured.proposal.candidates import SINGLE
from rtctl.measured.proposal.naming.column_units import as_written
from rtctl.measured.proposal.proposal import NO_SIGNAL, Answers, Open, Proposal


def refuse_open(proposal: Proposal, files: Sequence[str], answers: Answers) -> None:
    """Raise InputError with everything that cannot be known and the options that settle it, if there is something."""
    if not proposal.opens:
        return
    lines = [f"{files[0] if len(files) == 1 else f'{files[0]} and {len(files) - 1} more'}: not everything can be known "
             "from the files:"]  # fmt: skip
    lines += [f"  {one.text}: say {one.option}" for one in proposal.opens]
    seen = [
        f"{one.name} = {one.column}{f' [{as_written(one.unit)}]' if one.unit else ''}"
        for one in proposal.signals
    ]
    if proposal.time.column:
        seen.append(f"time = {proposal.time.column}")
    if seen:
        lines.append(f"  taken so far: {', '.join(seen)}")
    asked = " ".join(one.text for one in proposal.opens)
    others = [
        f"{name} ({why})"
        for name, why in proposal.unused.items()
        if why not in (NO_SIGNAL, SINGLE) and f'"{name}"' not in asked
    ]
    if others:
        lines.append("  not used: " + "; ".join(others[:8]))
    words_among = [
        name
        for name, why in proposal.unused.items()
        if "holds text" in why and " more (" not in why and f'"{name}"' not in asked
    ]
    if words_among:
        names = ", ".join(f'"{name}"' for name in words_among)
        lines.append(
            f"  if {names} is a signal: empty its cells that are no numbers (rtctl init leaves these rows out), and "
            "run it again"
        )
    words = [word for one in proposal.opens for word in _as_words(one)]
    said = [pair for pair in answers.as_options() if not _is_asked(pair, proposal.opens, words)]
    lines.append(
        f"  for example: rtctl init {shlex.join([*files, *(one for pair in said for one in pair), *words])}"
    )
    raise InputError("\n".join(lines))


def _is_asked(said: tuple[str, str], opens: Sequence[Open], words: Sequence[str]) -> bool:
    """Return whether an option that was given is asked for again: the same one, or of the same signal."""
    option, text = said
    if option in ("--input", "--output", "--scale"):
        name = text.partition("=")[0].strip() if "=" in text else None
        places = [one.option.removeprefix(f"{option} ") for one in opens if one.option.startswith(option)]
        asked = [place.partition("=")[0] for place in places]
        return bool(asked) if name is None else name in asked
    return option in words


def _as_words(one: Open) -> list[str]:
    """Return the first option of a question as words of a command line, its place holders as they are."""
    return shlex.split(one.example or one.option.partition(" or ")[0])
