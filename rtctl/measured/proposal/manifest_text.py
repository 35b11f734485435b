"""A proposal as the text of a manifest, with comments that say what was guessed and from what."""

from __future__ import annotations

import json
import os
from pathlib import Path

from rtctl.measured.proposal.proposal import Proposal, RecordGuess, SignalGuess, TimeGuess
from rtctl.measured.units import absolute_unit
from rtctl.version import __version__

HEAD = """# Written by rtctl init {version}. Comments say what was guessed and from what: correct what is wrong.
# Look at it with `rtctl preview {name}`; all keys: docs/datasets.md. The data files stay where and as they are.
"""


def manifest_text(proposal: Proposal, folder: Path, name: str = "dataset.toml") -> str:
    """Return the text of a manifest in `folder`."""
    lines = [HEAD.format(version=__version__, name=name)]
    lines += [f"# Unsure: {_comment(one)}" for one in proposal.unsure]
    lines += [
        f'# Not used: column "{_comment(column)}": {_comment(why)}' for column, why in proposal.unused.items()
    ]
    lines += ["", "[dataset]", f"name = {quoted(proposal.name)}"]
    lines.append(f"plant = {quoted(proposal.plant)}{_because(proposal.plant_why)}")
    for signal in proposal.signals:
        lines += _signal(signal)
    for record in proposal.records:
        lines += _record(record, proposal.time, folder)
    return "\n".join(lines) + "\n"


def quoted(text: str) -> str:
    """Return a text as a basic string of TOML."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _signal(signal: SignalGuess) -> list[str]:
    lines = ["", f"[signals.{signal.name}]", f"role = {quoted(signal.role)}"]
    for key, value in signal.keys:
        lines.append(f"{key} = {quoted(value) if isinstance(value, str) else 'true'}")
    if signal.constant is not None:
        lines.append(f"constant = {signal.constant!r}{_because(signal.why)}")
    elif not signal.keys:
        lines.append(f"column = {quoted(signal.column)}{_because(signal.why)}")
    held = absolute_unit(signal.unit)
    lines.append(f"unit = {quoted(held.unit)}{_because(signal.unit_source)}")
    if signal.amplitude_unit:
        lines.append(f"amplitude_unit = {quoted(signal.amplitude_unit)}")
    scale = held.scale if signal.scale is None else signal.scale * (held.scale or 1.0)
    if scale is not None:
        lines.append(f"scale = {scale!r}")
    if held.offset is not None:
        lines.append(f"offset = {held.offset!r}  # {held.unit} from {signal.unit}")
    if signal.hold:
        lines.append(f"hold = {quoted(signal.hold)}{_because(signal.hold_why)}")
    return lines


def _record(record: RecordGuess, time: TimeGuess, folder: Path) -> list[str]:
    lines = ["", "[[records]]", f"file = {quoted(relative(record.file, folder))}"]
    if record.group:
        lines.append(f"group = {quoted(record.group)}{_because(record.title)}")
    if record.name:
        lines.append(f"name = {quoted(record.name)}")
    lines += _time(record, time)
    if record.drive_amplitude is not None:
        lines.append(f"drive_amplitude = {record.drive_amplitude:.9g}{_because(record.drive_why)}")
    if record.rows:
        lines.append(f"rows = [{record.rows[0]}, {record.rows[1]}]")
    if record.ignore_first:
        lines.append(f"ignore_first = {record.ignore_first}")
    lines.append(f"use = {quoted(record.use)}{_because(record.why)}")
    return lines


def _time(record: RecordGuess, time: TimeGuess) -> list[str]:
    if time.column is not None and time.is_frequency:
        lines = [f"frequency = {quoted(time.column)}{_because(time.why)}"]
        return [*lines, *([f"frequency_unit = {quoted(time.unit)}"] if time.unit else [])]
    if time.column is not None and not time.rounded:
        lines = [f"time = {quoted(time.column)}{_because(time.why)}"]
        lines += [f"time_unit = {quoted(time.unit)}"] if time.unit else []
        return lines + (["resample = true  # its steps are uneven"] if time.resample else [])
    rate_hz = time.rate_hz or (record.rate_hz if time.stated_hz is None else None)
    if rate_hz is not None:
        return [f"sample_rate_hz = {rate_hz!r}{_because(time.rounded or time.why)}"]
    return [f"# sample rate: {_comment(time.why)}"]


def relative(file: Path, folder: Path) -> str:
    """Return the path of a file as seen from a folder; links to folders are followed, a link to the file is not."""
    return os.path.relpath(file.parent.resolve() / file.name, folder.resolve())


def _because(why: str) -> str:
    return f"  # {_comment(why)}" if why else ""


def _comment(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text)
