"""What simulate, identify, diagnose and sweep cost against samples, records, lanes, workers: one picture with slopes.

    python benchmarks/cost_slopes.py [--out docs/pictures/cost.png] [--short]

A hardening oscillator under random drive with 1 % of noise; what is diagnosed has quadratic damping that its model
lacks. Processor seconds of one thread (workers: wall seconds), medians of three where a call is shorter than half a
second. The slope is that of log cost over log size in the last decade; 1 is proportional. Run it twice on a new
machine: the first time kernels are compiled within the diagnoses.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from oscillator_vs_c import PERIOD_S, nominal, random_drive, values_of
from sweep_scaling import compute_part, plan_of, timed
from threadpoolctl import threadpool_limits

import rtctl
from rtctl.border.simulation import Stimulus

ROOT = Path(__file__).resolve().parents[1]
UNITS = {"drive": "V", "displacement": "V"}
NOISE = 0.01
SHORT_S = 0.5
"""Processor time [s] of a call below which it is repeated."""
HIDDEN = 0.05
"""Quadratic damping [1/V]: at the peak speed of 130 V/s a sixth of the linear damping of 42 1/s."""


class Curve(NamedTuple):
    """Cost against size."""

    name: str
    sizes: Sequence[float]
    seconds: Sequence[float]

    @property
    def slope(self) -> float:
        """Return the slope of log cost over log size in the last decade."""
        last = [k for k, size in enumerate(self.sizes) if size >= 0.099 * self.sizes[-1]]
        last = last if len(last) > 1 else [len(self.sizes) - 2, len(self.sizes) - 1]
        x, y = (np.log(np.asarray(values)[last]) for values in (self.sizes, self.seconds))
        return float(np.polyfit(x, y, 1)[0])


def main() -> None:
    """Measure, print, draw."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "cost.png")
    parser.add_argument("--short", action="store_true", help="small sizes only")
    asked = parser.parse_args()
    most = 1 if asked.short else 2
    print(f"load {os.getloadavg()[0]:.1f} before")
    with tempfile.TemporaryDirectory() as name, threadpool_limits(1, "blas"):
        folder = Path(name)
        panels = {
            "samples of one record": list(of_samples(folder, most)),
            "records of 1,000 samples": list(of_records(folder, most)),
            "lanes of one simulation, 20,000 samples": [of_lanes(most)],
            "worker processes": [of_workers(folder, most)],
        }
    for title, curves in panels.items():
        for curve in curves:
            costs = ", ".join(
                f"{size:g}: {spent:.3g} s" for size, spent in zip(curve.sizes, curve.seconds, strict=True)
            )
            print(f"{curve.name}, against {title}: slope {curve.slope:.2f} ({costs})")
    print(f"load {os.getloadavg()[0]:.1f} after")
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    draw(panels, asked.out)


def written(folder: Path, samples: int, records: int) -> Path:
    """A dataset whose records have quadratic damping that the nominal model lacks; its manifest."""
    where = folder / f"{samples}x{records}"
    where.mkdir(exist_ok=True)
    lacking = nominal().extended(("damping.quadratic",))
    values = values_of(lacking)
    values[-1] = HIDDEN
    made = []
    for number in range(records):
        drive = np.roll(random_drive(samples + records), number)[:samples]
        stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
        clean = lacking.predict(stimulus, values).outputs["displacement"][0]
        noise = NOISE * float(np.std(clean)) * np.random.default_rng(number).standard_normal(samples)
        signals = {"drive": drive, "displacement": clean + noise}
        made.append(rtctl.Record(name=f"r{number}", period_s=PERIOD_S, use="fit", signals=signals))
    return Path(
        rtctl.write_dataset(
            where, made, name="cost", plant="oscillator", units=UNITS, holds={"drive": "linear"}
        ).path
    )


def of_samples(folder: Path, most: int) -> Iterator[Curve]:
    """Read, simulate, identify and diagnose one record."""
    sizes = [1000, 3000, 10_000, 30_000, 100_000, 300_000][: 3 if most == 1 else None]
    yield from verbs(
        sizes, [written(folder, size, 1) for size in sizes], diagnosed_up_to=3000 if most == 1 else 10_000
    )


def of_records(folder: Path, most: int) -> Iterator[Curve]:
    """The same of many short records; a diagnosis of up to 30."""
    sizes = [1, 3, 10, 30, 100, 300][: 2 if most == 1 else None]
    yield from verbs(
        sizes, [written(folder, 1000, size) for size in sizes], diagnosed_up_to=3 if most == 1 else 10
    )


def verbs(sizes: Sequence[int], manifests: Sequence[Path], diagnosed_up_to: int) -> Iterator[Curve]:
    """What each verb costs for each dataset."""
    model = rtctl.identify(rtctl.read_dataset(manifests[0])).model
    calls: dict[str, Callable[[Any], Any]] = {
        "simulate": lambda data: rtctl.simulate(model, data),
        "identify": rtctl.identify,
    }
    for call in calls.values():
        call(rtctl.read_dataset(manifests[0]))  # compiles
    yield Curve("read (Parquet)", sizes, [spent_by(rtctl.read_dataset, one) for one in manifests])
    for name, call in calls.items():
        yield Curve(name, sizes, [spent_by(call, rtctl.read_dataset(one)) for one in manifests])
    few = [(size, one) for size, one in zip(sizes, manifests, strict=True) if size <= diagnosed_up_to]
    rtctl.diagnose(rtctl.read_dataset(manifests[0]), model)  # compiles
    spent = [spent_by(lambda data: rtctl.diagnose(data, model), rtctl.read_dataset(one)) for _, one in few]
    yield Curve("diagnose", [size for size, _ in few], spent)


def of_lanes(most: int) -> Curve:
    """One compiled simulation of many parameter sets."""
    simulation = nominal()
    stimulus = Stimulus(
        inputs={"drive": random_drive(20_000)}, holds={"drive": "linear"}, period_s=PERIOD_S,
        peak={"displacement": 0.3},
    )  # fmt: skip
    sizes = [1, 2, 4, 8, 16, 32, 64, 128, 256][: 5 if most == 1 else None]
    rng = np.random.default_rng(0)
    lanes = [values_of(simulation) * (1.0 + 0.01 * rng.standard_normal((size, 4))) for size in sizes]
    return Curve(
        "simulate", sizes, [spent_by(lambda one: simulation.predict(stimulus, one), one) for one in lanes]
    )


def of_workers(folder: Path, most: int) -> Curve:
    """Wall seconds of one campaign."""
    sizes = [1, 2] if most == 1 else [1, 2, 4]
    plan = plan_of(folder, part=256, samples=4096)
    compute_part(plan, 0)
    return Curve("sweep, wall", sizes, [median(timed(plan, size) for _ in range(most)) for size in sizes])


def spent_by(call: Callable[[Any], Any], given: Any) -> float:
    """Processor seconds: the median of three, where they are short."""
    costs: list[float] = []
    while len(costs) < 3 and (not costs or costs[0] < SHORT_S):
        begun = time.process_time()
        call(given)
        costs.append(time.process_time() - begun)
    return median(costs)


def draw(panels: dict[str, list[Curve]], path: Path) -> None:
    """Log-log, decades of equal length in a panel, a thin line of slope 1 through each curve's end."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    colours = {"read (Parquet)": "C7", "simulate": "C0", "identify": "C2", "diagnose": "C3"}
    figure, axes = plt.subplots(2, 2, figsize=(9.0, 9.0), constrained_layout=True)
    for axis, (title, curves) in zip(axes.flat, panels.items(), strict=True):
        workers = "worker" in title
        for curve in curves:
            colour = colours.get(curve.name, "C4")
            label = f"{curve.name}, slope {curve.slope:.2f}"
            axis.loglog(curve.sizes, curve.seconds, "o-", color=colour, ms=4, lw=1.4, label=label)
            x = np.array([curve.sizes[0], curve.sizes[-1]], dtype=float)
            k = 0 if workers else -1
            y = curve.seconds[k] * (x / x[k]) ** (-1.0 if workers else 1.0)
            axis.loglog(x, y, color=colour, lw=0.7, ls=":")
        axis.set(xlabel=f"{title} [1]", ylabel=f"{'wall' if workers else 'processor'} time [s]")
        axis.set_aspect("equal", adjustable="datalim")  # slope 1 is a diagonal in each panel
        axis.grid(which="major", lw=0.5, alpha=0.5)
        axis.legend(fontsize=8, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    figure.suptitle("Cost against size; dotted: proportional (workers: inversely)", fontsize=11)
    figure.savefig(path, dpi=120)
    plt.close(figure)


if __name__ == "__main__":
    main()
