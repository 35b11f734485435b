"""A recorded run as inputs of the exported loop, and what it must give."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.export.c.laws.law import Law, aligned_dtype, nth
from rtctl.loop.events import START
from rtctl.loop.live_parameters import MODEL, SETPOINT
from rtctl.loop.step import upcoming_setpoints
from rtctl.scenario.schema import Scenario
from rtctl.session.replay import Recorded

Rows = NDArray[Any]
"""(n,) of the input or output record."""
UINT32 = 0xFFFFFFFF


def inputs_of(
    law: Law, run: Recorded, setpoints: FloatArray, preview_s: float, real: Any
) -> tuple[Rows, NDArray[np.int64]]:
    """Return the inputs of a run, a start before the first sample and after each fault; and which are samples.

    Args:
        law: the exported law.
        run: the recording.
        setpoints: the plan's setpoint of each sample (n,) [um].
        preview_s: how far beyond the next sample the controller looks [s].
        real: precision of the exported arithmetic.

    Raises:
        InputError: a gain was changed while the run lasted.
    """
    period_s, signals = run.scenario.scenario.period_s, run.signals
    upcoming = upcoming_setpoints(setpoints, period_s, preview_s)
    sensed = np.stack([signals[one.name] for one in run.scenario.profile.sensed], axis=1)
    index = signals["index"].astype(np.int64)
    counter, time_us = signals["counter"].astype(np.int64), signals["device_time"].astype(np.int64)
    status = signals["device_status"].astype(np.int32)
    rows: list[tuple[Any, ...]] = []
    samples: list[int] = []
    events, chosen, previous = list(run.events), float("nan"), -1
    period_us = round(1e6 * period_s)
    for k, at in enumerate(index.tolist()):
        while events and events[0].step <= at:
            event = events.pop(0)
            if event.kind == START:
                first = setpoints[event.step] if chosen != chosen else chosen
                before_us = (int(time_us[k]) - period_us) & UINT32
                rows.append((*event.values["sensed"], first, first, 0, int(status[k]),
                             (int(counter[k]) - 1) & UINT32, before_us, *_host_ns(at - 1, period_us)))  # fmt: skip
                previous = event.step - 1
            elif event.kind == "change" and event.values["name"] == SETPOINT:
                chosen = event.values["value"]
            elif event.kind in ("change", MODEL):
                changed = event.values.get("name", "the model")
                raise InputError(
                    f"sample {event.step}: {changed} was changed while the run lasted; the exported loop "
                    "has the gains of its scenario"
                )
        setpoint, aimed = (setpoints[at], upcoming[at]) if chosen != chosen else (chosen, chosen)
        samples.append(len(rows))
        rows.append((*sensed[k], setpoint, aimed, at - previous, int(status[k]), int(counter[k]), int(time_us[k]),
                     *_host_ns(at, period_us)))  # fmt: skip
        previous = at
    return np.array(rows, dtype=aligned_dtype(law.input, real)), np.array(samples, dtype=np.int64)


def _host_ns(index: int, period_us: int) -> tuple[int, int]:
    """Return when a request and its answer would have been on a clock that keeps time; the host's is not recorded."""
    return 1000 * index * period_us, 1000 * index * period_us


def outputs_of(signals: Any, scenario: Scenario) -> dict[str, FloatArray]:
    """Return the recorded columns by the names of the output record; of levels those commanded before the sample."""
    names = list(signals)
    found = dict(zip(("estimate", "surrogate", "standard_error", "estimate_status"), names[2:6], strict=True))
    profile = scenario.profile
    found |= {nth("level", k): one.name for k, one in enumerate(profile.commands)}
    terms = names[7 + len(profile.sensed) + len(profile.commands) : -3]
    found |= dict(zip(terms, terms, strict=True))
    return {name: np.asarray(signals[column]) for name, column in found.items()}
