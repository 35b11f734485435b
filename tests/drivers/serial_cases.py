"""The transcripts of docs/serial-protocol.md."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

DOCS = Path(__file__).resolve().parents[2] / "docs"


class Exchange(NamedTuple):
    """One request and its answer on the page."""

    what: str
    request: bytes
    reply: bytes


def sessions() -> list[list[Exchange]]:
    """Those of the page, in its order."""
    page = (DOCS / "serial-protocol.md").read_text(encoding="utf-8")
    found = []
    for block in re.findall(r"```transcript\n(.*?)```", page, flags=re.DOTALL):
        lines = block.splitlines()
        found.append(
            [
                Exchange(what, bytes.fromhex(there[2:]), bytes.fromhex(back[2:]))
                for what, there, back in zip(lines[::3], lines[1::3], lines[2::3], strict=True)
                if there[0] == ">" and back[0] == "<"
            ]
        )
    return found
