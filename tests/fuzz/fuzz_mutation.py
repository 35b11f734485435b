"""Random changes of bytes, texts and tables: what a disk, a wire, an editor or a person may do to a valid file."""

from __future__ import annotations

import datetime
import random
import re
import struct
from typing import Any

_INTERESTING = (0, 1, 0x7F, 0x80, 0xFF, 0x0A, 0x22, 0x2C)
_WIDE = (0, 1, -1, 0x7FFF_FFFF, -0x8000_0000, 0xFFFF, 1 << 20, 1 << 31, 1 << 40, (1 << 63) - 1, -(1 << 63))
WORDS = (
    "nan", "inf", "-inf", "1e999", "-1e-999", "1e200", "9.9e37", "9" * 30, "0x1F", "1_000", "1.234.567,8", "1,5", "--",
    "", " ", "NULL", "#N/A", "TRUE", "\0", "\ufeff", "é", "µm", "\u202e", '"', "'", ";", "\t", "\r", "\n", "[", "]",
    "(", "=", "2026-03-29T02:30:00+01:00", "23:59:60", "9**9**9 s", "dB", "m/s2", "../../x", "/dev/zero", "%s%n", "{}",
)  # fmt: skip
"""Cells and words that people, instruments and programs write."""
_NUMBER = re.compile(r"[+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")


def damaged(rng: random.Random, seed: bytes, other: bytes) -> bytes:
    """Return `seed` with a few bytes changed, removed, repeated, moved or taken from `other`."""
    data = bytearray(seed)
    for _ in range(_few(rng)):
        if not data:
            break
        at = rng.randrange(len(data))
        size = min(1 << rng.randrange(9), len(data) - at)
        kind = rng.randrange(9)
        if kind == 0:
            data[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            data[at] = rng.choice(_INTERESTING)
        elif kind == 2:
            _put_number(rng, data, at)
        elif kind == 3:
            del data[at : at + size]
        elif kind == 4:
            data[at:at] = data[at : at + size] * rng.choice((1, 1, 3, 50))
        elif kind == 5:
            del data[at:]
        elif kind == 6 and other:
            start = rng.randrange(len(other))
            data[at : at + size] = other[start : start + size]
        elif kind == 7:
            data[at : at + size] = bytes(size)
        else:
            data[at : at + size] = rng.randbytes(size)
    return bytes(data)


def rewritten(rng: random.Random, text: str) -> str:
    """Return a text with a few of its lines, words and numbers changed."""
    for _ in range(_few(rng)):
        lines = text.splitlines(keepends=True) or [""]
        k, other = rng.randrange(len(lines)), rng.randrange(len(lines))
        kind = rng.randrange(9)
        if kind == 0:
            del lines[k]
        elif kind == 1:
            lines.insert(other, lines[k])
        elif kind == 2:
            lines[k], lines[other] = lines[other], lines[k]
        elif kind == 3:
            lines[k] = _with_word(rng, lines[k])
        elif kind == 4:
            lines = [line.replace(*rng.choice(_SWAPS)) for line in lines]
        elif kind == 5:
            lines[k] = lines[k][: rng.randrange(len(lines[k]) + 1)]
        elif kind == 6:
            lines[k:k] = ["\n"] * rng.randrange(4)
        elif kind == 7:
            lines[k] = rng.choice(WORDS) + lines[k]
        else:
            numbers = list(_NUMBER.finditer(lines[k]))
            if numbers:
                found = rng.choice(numbers)
                lines[k] = lines[k][: found.start()] + rng.choice(WORDS) + lines[k][found.end() :]
        text = "".join(lines)
    return text


_SWAPS = (
    (",", ";"),
    (".", ","),
    (",", "\t"),
    ("\n", "\r\n"),
    ("\n", "\r"),
    (",", " "),
    ("-", "\u2212"),
    ("0", ""),
)


def retabled(rng: random.Random, tables: Any) -> Any:
    """Return tables of TOML with a few values or keys changed, removed, or put elsewhere."""
    tables = _copied(tables)
    for _ in range(_few(rng)):
        places = _places(tables)
        if not places:
            break
        holder, key = rng.choice(places)
        kind = rng.randrange(6)
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, dict):
            holder[_misspelt(rng, key)] = holder.pop(key)
        elif kind == 2:
            source, place = rng.choice(places)
            holder[key] = _copied(source[place])
        else:
            holder[key] = a_value(rng)
    return tables


def a_value(rng: random.Random, depth: int = 0) -> Any:
    """Return any value that TOML has."""
    kind = rng.randrange(12)
    if kind < 4:
        return f"{rng.choice(WORDS)}{rng.choice(('', ' mm', ' s', ' 1/s^2', ' V'))}".replace("\0", "")
    if kind < 6:
        return rng.choice((0, -1, 1, 2, 1 << 40, -(1 << 62), (1 << 62)))
    if kind < 8:
        return rng.choice((0.0, -0.0, 1e308, 5e-324, float("inf"), float("nan"), -1e-3, 1e200))
    if kind == 8:
        return rng.choice((True, False))
    if kind == 9:
        return datetime.datetime(2026, 3, 29, 2, 30)
    if depth > 3:
        return []
    if kind == 10:
        return [a_value(rng, depth + 1) for _ in range(rng.randrange(4))]
    return {rng.choice(("value", "unit", "kind", "x", "")): a_value(rng, depth + 1) for _ in range(2)}


def any_text(rng: random.Random, parts: tuple[str, ...]) -> str:
    """Return a text of up to ten parts, words or any characters."""
    found = []
    for _ in range(rng.randrange(1, 10)):
        kind = rng.randrange(8)
        found.append(
            chr(rng.choice((rng.randrange(128), rng.randrange(0x3000), rng.randrange(0xE000, 0x110000))))
            if kind == 0
            else rng.choice(WORDS if kind == 1 else parts)
        )
    return "".join(found)


def _few(rng: random.Random) -> int:
    return rng.choice((1, 1, 1, 2, 3, 6))


def _put_number(rng: random.Random, data: bytearray, at: int) -> None:
    size = rng.choice((2, 4, 8))
    raw = struct.pack("<q", rng.choice(_WIDE))[:size]
    data[at : at + size] = raw if rng.random() < 0.7 else raw[::-1]


def _with_word(rng: random.Random, line: str) -> str:
    at = rng.randrange(len(line) + 1)
    return line[:at] + rng.choice(WORDS) + line[at:]


def _misspelt(rng: random.Random, key: str) -> str:
    at = rng.randrange(len(key) + 1)
    return key[:at] + rng.choice(("x", "", "_", ".", " ", "é")) + key[at + 1 :]


def _copied(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _copied(one) for key, one in value.items()}
    return [_copied(one) for one in value] if isinstance(value, list) else value


def _places(tables: Any) -> list[tuple[Any, Any]]:
    """Return every (table or list, key or index) of nested tables."""
    keys = list(tables) if isinstance(tables, dict) else list(range(len(tables)))
    found = [(tables, key) for key in keys]
    for key in keys:
        if isinstance(tables[key], dict | list):
            found += _places(tables[key])
    return found
