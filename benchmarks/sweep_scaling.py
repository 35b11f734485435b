"""How a campaign scales: two workers against one, four Dask workers killed one at a time, 10^9 trajectories on paper.

Rounds are interleaved and medians given, so that what else the machine does meets both sides alike; a machine that has
not two cores to spare shows less than it could. The four workers are processes of `dask worker` on this machine; each
is killed (SIGKILL) while it computes, another one joins before the fourth goes, and the result must be the local one to
the bit.

    python benchmarks/sweep_scaling.py [--rounds 3] [--no-cluster]
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from statistics import median

from ratio import Ratio

from rtctl.campaign.local import on_this_machine
from rtctl.campaign.part import compute_part
from rtctl.campaign.plan import Plan, read_plan

CAMPAIGN = """
[campaign]
title = "scaling"
model = "beam_hm"
outputs = ["kind", "attractor", "period", "settled_s"]
part = {part}

[drive]
frequency = "9 Hz"
amplitude = "3.81 m/s^2"

[follow]
look = "100 s"
most = "600 s"

[design]
kind = "random"
samples = {samples}
seed = 5

[factors.displacement]
low = "-13 mm"
high = "13 mm"

[factors.velocity]
low = "-860 mm/s"
high = "860 mm/s"
"""
DASK = [sys.executable, "-W", "ignore", "-m", "dask"]
TRAJECTORIES, CORES = 1e9, 1000
TRIVIAL_TASKS = 2000
REACH = 1.8
"""Two workers over one, where two cores are free."""


def main() -> None:
    """Print every row."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--no-cluster", action="store_true")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        small = plan_of(Path(folder), part=256, samples=4096)
        compute_part(small, 0)  # compiles
        cost_s, bytes_each = cost_of_one(small, args.rounds)
        two_against_one(small, args.rounds)
        overhead_s = None if args.no_cluster else killed_one_at_a_time(Path(folder))
    on_paper(cost_s, bytes_each, overhead_s)


def plan_of(folder: Path, part: int, samples: int) -> Plan:
    """A campaign of random starts of the bistable beam."""
    path = folder / f"scaling-{samples}.toml"
    path.write_text(CAMPAIGN.format(part=part, samples=samples), encoding="utf-8")
    return read_plan(path)


def cost_of_one(plan: Plan, rounds: int) -> tuple[float, float]:
    """Processor seconds and bytes of a trajectory, the median over parts."""
    costs, sizes = [], []
    for number in range(2 * rounds):
        begun = time.process_time()
        content = compute_part(plan, number)
        costs.append((time.process_time() - begun) / plan.part)
        sizes.append(len(content) / plan.part)
    print(
        f"a trajectory of the beam at 9 Hz until it repeats: {1e6 * median(costs):.0f} us of one core "
        f"(least {1e6 * min(costs):.0f}), {median(sizes):.1f} bytes of Parquet"
    )
    return median(costs), median(sizes)


def ratios(rounds: int) -> list[Ratio]:
    """Two workers beside one: 0.5 where two cores are free."""
    with tempfile.TemporaryDirectory() as folder:
        plan = plan_of(Path(folder), part=256, samples=4096)
        compute_part(plan, 0)  # compiles
        one, two = walls_of_one_and_two(plan, max(1, rounds // 5))
    return [Ratio("campaign, two workers", "one worker (0.5 where two cores are free)", two, one, "s")]


def walls_of_one_and_two(plan: Plan, rounds: int) -> tuple[float, float]:
    """Wall time [s] of the same parts on one worker process and on two, their start left out."""
    walls: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(rounds):
        for workers in walls:
            walls[workers].append(timed(plan, workers))
    return median(walls[1]), median(walls[2])


def two_against_one(plan: Plan, rounds: int) -> None:
    """Print what a second worker is worth."""
    one, two = walls_of_one_and_two(plan, rounds)
    met = "" if one / two >= REACH else "  MISSED (or the machine was busy)"
    print(
        f"{plan.design.samples} trajectories in {plan.parts} parts: one worker {one:.2f} s, two {two:.2f} s; "
        f"{one / two:.2f} times as fast (reach {REACH:g}){met}"
    )


def timed(plan: Plan, workers: int) -> float:
    """From the first result on, that is without the start of the processes, for all parts but the first."""
    results = on_this_machine(plan, range(plan.parts), workers)
    next(results)
    begun = time.perf_counter()
    for _ in results:
        pass
    return (time.perf_counter() - begun) * plan.parts / (plan.parts - 1)


def killed_one_at_a_time(folder: Path) -> float:
    """The cluster; returns its seconds a trivial task."""
    plan = plan_of(folder, part=64, samples=6400)
    local = dict(on_this_machine(plan, range(plan.parts), 2))
    path, out = folder / "scaling-6400.toml", folder / "cluster"
    with ExitStack() as stack:
        address = scheduler(stack, folder)
        worker = [*DASK, "worker", address, "--no-nanny", "--no-dashboard", "--nthreads", "1"]

        def join(name: str) -> subprocess.Popen[bytes]:
            return started(stack, [*worker, "--local-directory", str(folder / name)], folder / f"{name}.log")

        workers = [join(f"w{k}") for k in range(4)]
        overhead_s = trivial_tasks(address)
        sweep = [sys.executable, "-m", "rtctl", "sweep", str(path), "--out", str(out), "--quiet"]
        running = started(stack, [*sweep, "--scheduler", address], folder / "sweep.log")
        begun = time.perf_counter()
        for k, victim in enumerate(workers):
            wait_for(lambda k=k: count(out) >= (k + 1) * plan.parts // 6 or running.poll() is not None)
            if k == 3:
                join("w4")
            print(f"  {count(out):3d} of {plan.parts} parts: worker {k + 1} of 4 killed")
            victim.kill()
        code = running.wait()
        wall = time.perf_counter() - begun
    kept = {int(one.stem[5:]): one.read_bytes() for one in (out / "parts").glob("*.parquet")}
    if code != 0 or kept != local:
        raise SystemExit(f"the cluster's result is not the local one (exit {code}, {len(kept)} parts)")
    print(f"  all {plan.parts} parts there after {wall:.1f} s, the bytes of the local run: nothing lost")
    return overhead_s


def trivial_tasks(address: str) -> float:
    """Seconds of the scheduler for a task that does nothing."""
    import distributed

    with distributed.Client(address) as client:
        client.wait_for_workers(4)
        begun = time.perf_counter()
        client.gather(client.map(_nothing, range(TRIVIAL_TASKS)))
        each = (time.perf_counter() - begun) / TRIVIAL_TASKS
    print(f"a Dask task that does nothing: {1e3 * each:.2f} ms on four workers of this machine")
    return each


def _nothing(number: int) -> int:
    return number


def on_paper(cost_s: float, bytes_each: float, overhead_s: float | None) -> None:
    """10^9 of them on 1,000 cores, from the above."""
    part = 64 * max(1, min(1024, round(4.0 / cost_s / 64.0)))
    parts = TRAJECTORIES / part
    core_hours = TRAJECTORIES * cost_s / 3600.0
    print(f"{TRAJECTORIES:.0e} trajectories in {parts:,.0f} parts of {part} ({part * cost_s:.1f} s each): "
          f"{core_hours:.0f} core hours, {3600.0 * core_hours / CORES:.0f} s on {CORES} cores, "
          f"{1e-9 * TRAJECTORIES * bytes_each:.0f} GB of Parquet")  # fmt: skip
    if overhead_s is not None:
        busy = parts * overhead_s / (TRAJECTORIES * cost_s / CORES)
        print(
            f"  the scheduler, one process, is busy for {parts * overhead_s:.0f} s of it: {100.0 * busy:.0f} %"
        )


def scheduler(stack: ExitStack, folder: Path) -> str:
    """Its address."""
    log = folder / "scheduler.log"
    started(stack, [*DASK, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"], log)
    pattern = re.compile(r"tcp://127\.0\.0\.1:\d+")
    wait_for(lambda: pattern.search(log.read_text(errors="replace")) is not None)
    return pattern.findall(log.read_text(errors="replace"))[0]


def started(stack: ExitStack, command: list[str], log: Path) -> subprocess.Popen[bytes]:
    """A process that is ended with the stack."""
    with log.open("wb") as file:
        process = subprocess.Popen(command, stdout=file, stderr=file)
    stack.callback(process.wait)
    stack.callback(process.kill)
    return process


def count(out: Path) -> int:
    """Parts that are kept."""
    return len(list(out.glob("parts/*.parquet")))


def wait_for(met: Callable[[], bool], seconds: float = 180.0) -> None:
    """Until it is so."""
    deadline = time.monotonic() + seconds
    while not met():
        if time.monotonic() > deadline:
            raise SystemExit("the cluster does not get on")
        time.sleep(0.01)


if __name__ == "__main__":
    main()
