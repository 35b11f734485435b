"""One hidden effect: its data as files, the program's answer, and what that answer is worth."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, NamedTuple

import rtctl
from rtctl import Record
from rtctl.border.errors import RunError

from .effects import effects
from .systems import SYSTEMS
from .truth import SAMPLES, hidden

STOPPED = "stopped by the user"


class Judged(NamedTuple):
    """An answer beside the truth."""

    system: str
    effect: str
    """Id of what was hidden; "" for nothing."""
    verdict: str
    named: str
    outcome: str
    seconds: float
    gain: float


def write_case(folder: Path, system: str, effect: str, seed: int, samples: int = SAMPLES) -> Path:
    """Write the records of a hidden effect, and return their manifest."""
    one = SYSTEMS[system]
    u, y, _ = hidden(one, effects(one)[effect] if effect else None, seed, samples)
    source, output = one.input[0], one.reading[0]
    last = u.shape[1] - 1
    records = [
        Record(
            name=f"r{k}", period_s=one.period_s, use="test" if k == last else "fit",
            signals={source: u[:, k], output: y[:, k]},
        )
        for k in range(last + 1)
    ]  # fmt: skip
    rtctl.write_dataset(
        folder, records, name=f"{system} {effect}", plant="equations",
        units={source: one.input[1], output: one.reading[1]}, holds={source: "zero"},
    )  # fmt: skip
    return folder / "dataset.toml"


def judge(system: str, effect: str, answer: dict[str, Any], seconds: float) -> Judged:
    """Compare `diagnosis.json` with what was hidden."""
    causes = answer["causes"]
    sets = [(one["id"], *one["indistinguishable_from"]) for one in causes]
    named = "; ".join(" | ".join(one) for one in sets)
    if not effect:
        outcome = "right" if answer["verdict"] == "adequate" else "false claim" if causes else "no claim"
    elif not causes:
        outcome = "missed"
    elif effect not in {name for one in sets for name in one}:
        outcome = "wrong"
    elif len(sets) == 1 and len(sets[0]) <= 2:
        outcome = "right" if sets[0][0] == effect else "right of two"
    elif len(sets) == 1:
        outcome = f"right of {len(sets[0])}"
    else:
        outcome = "right beside others"
    gain = answer["gain"] or {}
    return Judged(system, effect, answer["verdict"], named, outcome, seconds, gain.get("ratio") or 1.0)


def run_case(folder: Path, system: str, effect: str, seed: int) -> Judged:
    """Hide an effect, ask the program, and judge its answer; raises RunError with `STOPPED` where it was stopped."""
    manifest = write_case(folder, system, effect, seed)
    started = time.process_time()
    answer = rtctl.diagnose(manifest, SYSTEMS[system].path).to_dict()
    if answer["stopped"]:
        raise RunError(STOPPED)
    return judge(system, effect, answer, time.process_time() - started)
