"""Run a campaign from file to folder: missing parts are computed and kept one by one, then counted and drawn."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.dataset as ds

from rtctl.border.errors import RunError
from rtctl.campaign.cluster import on_cluster
from rtctl.campaign.local import on_this_machine
from rtctl.campaign.plan import Plan
from rtctl.campaign.store import Store, open_store
from rtctl.evaluation.metrics import write_json


def run_campaign(
    plan: Plan,
    folder: Path,
    *,
    workers: int,
    scheduler: str | None,
    stop: Callable[[], bool],
    advance: Callable[[int], None],
) -> dict[str, Any]:
    """Compute the parts that `folder` lacks, and return the summary.

    Args:
        plan: Campaign ready to run.
        folder: Folder of the results.
        workers: Processes on this machine.
        scheduler: Address of a cluster's scheduler, or None.
        stop: Whether to stop early, asked after each part.
        advance: Receives progress.

    Raises:
        InputError: The folder or the address does not fit.
        RunError: The campaign was stopped, or the workers are gone.
    """
    store = open_store(folder, plan)
    missing = store.missing(plan)
    begun, kept = time.monotonic(), plan.parts - len(missing)
    computed = 0
    for number, content in _computed(plan, missing, workers, scheduler):
        store.keep(number, content)
        kept, computed = kept + 1, computed + 1
        advance(min(kept * plan.part, plan.design.samples))
        if stop() and kept < plan.parts:
            raise RunError(
                f"stopped with {kept} of {plan.parts} parts done; the same command goes on from there"
            )
    summary = {
        "title": plan.campaign.campaign.title,
        "trajectories": plan.design.samples,
        "parts": {"all": plan.parts, "computed": computed, "found": plan.parts - computed},
        "wall_s": time.monotonic() - begun,
        **counted(store),
    }
    write_json(folder / "summary.json", summary, "sweep")
    return summary


def _computed(
    plan: Plan, missing: list[int], workers: int, scheduler: str | None
) -> Iterator[tuple[int, bytes]]:
    if not missing:
        return iter(())
    if scheduler is None:
        return on_this_machine(plan, missing, workers)
    return on_cluster(plan, missing, scheduler)


def counted(store: Store) -> dict[str, Any]:
    """Return the number of trajectories of each kind and period, where the campaign has these outputs."""
    found: dict[str, Any] = {}
    table = ds.dataset(store.folder / "parts", format="parquet")
    for name in ("kind", "kind_by_rule", "period"):
        if name in table.schema.names:
            counts: Counter[str] = Counter()
            for batch in table.to_batches(columns=[name]):
                counts.update(str(value) for value in batch.column(0).to_pylist())
            found[name] = dict(sorted(counts.items()))
    errors = [name for name in table.schema.names if name.startswith(("rms_error", "nrmse"))]
    if errors:
        found["least"] = _least(table, errors[0])
    return found


def _least(table: ds.Dataset, name: str) -> dict[str, Any]:
    """Return the row with the least error."""
    best: dict[str, Any] = {}
    for batch in table.to_batches():
        if batch.num_rows:
            at = int(np.argmin(batch.column(name).to_numpy()))
            row = batch.slice(at, 1).to_pylist()[0]
            if not best or row[name] < best[name]:
                best = row
    return best
