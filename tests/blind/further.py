"""The next experiment, done: what is proposed is measured on the same device, and as many random inputs of its menu."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from generator import more
from judge import single_and_right

from rtctl.diagnosis.experiment_design.design import ScoredInput
from rtctl.diagnosis.result import Diagnosis

Line = dict[str, Any]
RANDOM = 5
"""Sets the baseline's choice apart from all else that is drawn from the seed."""


def further(
    found: Diagnosis, folder: Path, seed: int, plant: str, overrides: Line, again: Callable[[Path], Line]
) -> Line | None:
    """`proposed` and `random`: what `again` answers on old and new data; None where nothing is ambiguous.

    Ambiguous: explained, by a cause that others of the catalogue could stand for. Random: for each proposed record any
    entry of the menu that the device could be sent, the proposed ones included, all as likely. `decides`: whether what
    is proposed is said to.
    """
    proposal = found.next_experiment
    if found.verdict != "explained" or not any(one.indistinguishable_from for one in found.causes):
        return None
    if proposal is None:
        return {"names": _names(found), "why_not": "nothing was proposed"}
    rng = np.random.default_rng([seed, RANDOM])
    drawn = [(proposal.menu[k], 1) for k in rng.integers(len(proposal.menu), size=proposal.times)]
    line: Line = {"names": _names(found), "separation": float(proposal.separation)}
    line["decides"] = proposal.decides
    for name, records in (("proposed", proposal.plan.records), ("random", drawn)):
        line[name] = _measured(records, folder, name, seed, plant, overrides, again)
    return line


def _names(found: Diagnosis) -> list[str]:
    """All that are still possible."""
    return sorted({name for one in found.causes for name in (one.id, *one.indistinguishable_from)})


def _measured(
    records: Sequence[tuple[ScoredInput, int]], folder: Path, name: str, seed: int, plant: str, overrides: Line,
    again: Callable[[Path], Line],
) -> Line:  # fmt: skip
    line: Line = {"input": "; ".join(f"{times} x {scored.input.statement}" for scored, times in records)}
    new = folder.with_name(f"{folder.name}-{name}")
    shutil.copytree(folder, new)
    try:
        for scored, times in records:
            levels, period_s = scored.input.levels, scored.input.period_s
            more(seed, new, levels, period_s, plant=plant, times=times, **overrides)
        line |= again(new)
    except Exception as error:  # a crash is a result of the campaign, not its end
        line |= {"verdict": "crash", "causes": [], "judgement": "crash", "error": repr(error)[-400:]}
    finally:
        shutil.rmtree(new)
    return line


def resolved(line: Line, which: str) -> bool:
    """Whether with the `proposed` or the `random` record the truth is named alone."""
    after = line["next"].get(which)
    return after is not None and after["judgement"] != "crash" and single_and_right(line | after)


def resolved_but_for_equivalents(line: Line, which: str) -> bool:
    """Whether the truth is left, and beside it nothing but the same law by construction: no experiment separates that,
    and the proposal says so.
    """
    after = line["next"].get(which)
    if after is None or after["judgement"] == "crash" or len(after["causes"]) != 1:
        return False
    left = {after["causes"][0]["id"], *after["causes"][0]["or"]}
    return resolved(line, which) or set(line["truth"]) <= left <= {*line["truth"], *line["equivalent"]}
