"""Cost of the regression of the whole campaign: processor seconds and memory, without making the records."""

from __future__ import annotations

import resource
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from rtctl.identification.regression.streaming_gram import compute_filtered_gram, compute_weak_gram
from rtctl.reproduce.bistable.collected import HALF_WIDTH_S, collected
from rtctl.reproduce.bistable.protocol import RATE_HZ, record, shaker
from rtctl.reproduce.study import Comparison, Row, Run, Section

BUDGET_S, BUDGET_MB = 10.0, 1000.0


def cost(run: Run) -> Section:
    """Return the section on the cost, measured in the pass on which every other section rests."""
    found = collected(run)
    samples = len(found.kinds) * found.campaign.samples
    share = 450 * 600_000 / samples
    with ProcessPoolExecutor(
        1, mp_context=get_context("spawn")
    ) as pool:  # a process that has done nothing else
        regressing = pool.submit(_memory, run.short, False).result()
        making = pool.submit(_memory, run.short, True).result()
    rows = (
        Row(quantity="samples", unit="", paper=450 * 600_000, ours=samples),
        Row(quantity="regression by the paper's filter", unit="CPU s", paper=None, ours=found.gram_s[0]),
        Row(quantity="regression by the weak form", unit="CPU s", paper=None, ours=found.gram_s[1]),
        Row(quantity="the first, for 450 records", unit="CPU s", paper=None, ours=share * found.gram_s[0],
            note=f"at most {BUDGET_S:g} were asked for"),
        Row(quantity="the second, for 450 records", unit="CPU s", paper=None, ours=share * found.gram_s[1],
            note=f"at most {BUDGET_S:g} were asked for"),
        Row(quantity="making the records", unit="CPU s", paper=None, ours=found.made_s, note="not in the above"),
        Row(quantity="memory of a process that regresses records, at its peak", unit="MB", paper=None,
            ours=regressing, note=f"at most {BUDGET_MB:g} were asked for; a record takes the place of the last"),
        Row(quantity="of one that makes them, too", unit="MB", paper=None, ours=making),
    )  # fmt: skip
    return Section(
        title="Cost",
        text="Eleven columns (four are the quintic's, the others are for the model choice), every sample "
        "used, one record "
        "in memory. Held as matrices, the library of the paper's regression alone takes 8.6 GB.",
        parts=(Comparison(title="Processor time and memory", rows=rows),),
    )


def _memory(short: bool, make: bool) -> float:
    """Return the peak memory [MB] of this process after it has regressed three records both ways; of noise, or made."""
    campaign = shaker(short=short)
    for setting in campaign.settings[:3]:
        if make:
            one = record(campaign, setting)
            displacement, frame_velocity = one.displacement, one.frame_velocity
        else:
            displacement, frame_velocity = np.random.default_rng(1).standard_normal((2, campaign.samples))
        compute_filtered_gram(displacement, frame_velocity, 1.0 / RATE_HZ)
        compute_weak_gram(displacement, frame_velocity, 1.0 / RATE_HZ, HALF_WIDTH_S)
    status = Path("/proc/self/status")  # its own: what getrusage tells on Linux includes who started it
    if status.is_file():
        line = next(
            line for line in status.read_text(encoding="utf-8").splitlines() if line.startswith("VmHWM:")
        )
        return float(line.split()[1]) / 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0**2
