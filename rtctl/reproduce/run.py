"""Run a study step by step; a finished one is kept in DIR/sections, so that a stopped study can resume."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

from rtctl.evaluation.metrics import finite
from rtctl.output.atomic_write import replacing
from rtctl.output.own_files import mark_of
from rtctl.reproduce.study import Picture, Run, Section, Step, Study, as_json, from_json
from rtctl.version import __version__

Told = Callable[[str], None]


def run_study(study: Study, out: Path, *, short: bool, report: Told) -> list[tuple[Section, float]]:
    """Return the sections in order, each with the seconds that it took (in the session that ran it).

    `report` takes one line before each step. A section kept by another version, or by a run of the other length, is
    computed again; so is one whose picture is gone.
    """
    run = Run(out=out, pictures=out / "pictures", short=short)
    kept = out / "sections"
    for folder in (run.pictures, kept):
        folder.mkdir(parents=True, exist_ok=True)
    found = []
    for number, step in enumerate(study.steps, 1):
        place = kept / f"{step.name}.json"
        section = _kept(place, run)
        report(f"{number} of {len(study.steps)}: {step.name}" + (" (kept)" if section else ""))
        found.append(section or _computed(step, run, place))
    return found


def _computed(step: Step, run: Run, place: Path) -> tuple[Section, float]:
    start = time.perf_counter()
    section = step.compute(run)
    seconds = time.perf_counter() - start
    content = {
        "program": mark_of("reproduce"),
        "version": __version__,
        "short": run.short,
        "seconds": seconds,
        "section": as_json(section),
    }
    with replacing(place, "reproduce") as partial:
        partial.write_text(json.dumps(finite(content), indent=1), encoding="utf-8")
    return section, seconds


def _kept(place: Path, run: Run) -> tuple[Section, float] | None:
    try:
        content = json.loads(place.read_text(encoding="utf-8"))
        if content["version"] != __version__ or content["short"] != run.short:
            return None
        section = from_json(content["section"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    pictures = [run.pictures / part.file for part in section.parts if isinstance(part, Picture)]
    return (section, content["seconds"]) if all(picture.is_file() for picture in pictures) else None
