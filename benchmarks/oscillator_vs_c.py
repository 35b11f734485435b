"""What an oscillator costs: a step against C, every mechanism against none, a sweep, a fit.

Rounds are interleaved, medians given, so that what else the machine does meets both sides alike. Both sides may fuse a
multiplication with an addition; C is compiled with gcc -O3 -march=native.

    python benchmarks/oscillator_vs_c.py [--rounds 15] [--silverbox FOLDER]
"""

from __future__ import annotations

import argparse
import ctypes
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from ratio import Ratio

from plant_sim.oscillator.equation.terms import CUBIC, DAMPING, GAIN, STIFFNESS
from plant_sim.oscillator.mechanism import Driven
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.model import oscillator_simulation
from plant_sim.oscillator.motion import Equation
from plant_sim.oscillator.simulation import OscillatorSimulation
from plant_sim.oscillator.sweep import sweep
from rtctl.border.mechanisms import Scales
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Stimulus
from rtctl.identification.oscillator.identify import identify_oscillator
from rtctl.measured.reading import read_dataset
from rtctl.wiring_models import build_simulation

FloatArray = NDArray[np.float64]
Name = TypeVar("Name")
HERE = Path(__file__).resolve().parent
LANES = 32
SAMPLES, SUBSTEPS = 20_000, 8
PERIOD_S = 1.0 / 610.0
SCALES = Scales(
    displacement=0.3, velocity=130.0, acceleration=6e4, drive=0.05, rate=440.0, duration=33.0, period=PERIOD_S,
    excursion=0.3,
)  # fmt: skip
"""Of the Silverbox at its peaks, as the step is chosen for them."""
SAME = 1e-9
REACH = {"one": 1.3, "lanes": 1.5, "gain": 8.0, "mechanism": 2.0, "sweep_s": 3.0, "fit_s": 2.0}


def main() -> None:
    """Print every row of the table of speeds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--silverbox", type=Path, default=HERE.parents[1] / "shared" / "data" / "silverbox")
    args = parser.parse_args()
    against_c(args.rounds)
    every_mechanism(max(3, args.rounds // 2))
    paper_sweep()
    silverbox_fit(args.silverbox, max(3, args.rounds // 5))


def nominal() -> OscillatorSimulation:
    """A hardening Duffing oscillator, 70 Hz, in volts."""
    numbers = {
        "damping": (42.0, "1/s"), "stiffness": (1.91e5, "1/s^2"), "stiffness_cubic": (7e5, "1/(V^2*s^2)"),
        "drive_gain": (1.92e5, "1/s^2"),
    }  # fmt: skip
    parameters = {name: {"value": value, "unit": unit} for name, (value, unit) in numbers.items()}
    model = ModelFile.model_validate({"model": {"kind": "oscillator", "parameters": parameters}})
    return oscillator_simulation(model, {"drive": "V", "displacement": "V"}, "benchmark")


def random_drive(samples: int) -> FloatArray:
    """0.05 V RMS up to 200 Hz."""
    spectrum = np.fft.rfft(np.random.default_rng(1).standard_normal(samples))
    spectrum[np.fft.rfftfreq(samples, PERIOD_S) > 200.0] = 0.0
    drive = np.fft.irfft(spectrum, samples)
    return np.asarray(0.05 * drive / drive.std())


def values_of(simulation: OscillatorSimulation) -> FloatArray:
    return np.array([parameter.value for parameter in simulation.parameters])


def medians(calls: dict[Name, Callable[[], Any]], rounds: int, steps: dict[Name, int]) -> dict[Name, float]:
    """Processor ns a step and lane, the median of interleaved rounds; a round before them compiles."""
    costs: dict[Name, list[float]] = {name: [] for name in calls}
    for turn in range(rounds + 1):
        for name, call in calls.items():
            begun = time.thread_time_ns()
            call()
            if turn:
                costs[name].append((time.thread_time_ns() - begun) / steps[name])
    return {name: median(values) for name, values in costs.items()}


def verdict(value: float, reach: float, *, at_least: bool = False) -> str:
    """`1.02 (reach <= 1.3)`, or with MISSED."""
    met = value >= reach if at_least else value <= reach
    return f"{value:5.2f} (reach {'>=' if at_least else '<='} {reach:g}){'' if met else '  MISSED'}"


class Case:
    """The nominal oscillator in `lanes` lanes, ready to march in numba and in C."""

    def __init__(self, lanes: int) -> None:
        rng = np.random.default_rng(2)
        simulation = nominal()
        values = values_of(simulation) * (1.0 + 0.01 * rng.standard_normal((lanes, 4)))
        self.equation = Equation.of(simulation.parameters, [], values)
        self.nodes = np.repeat(random_drive(SAMPLES * SUBSTEPS)[:, None], 3, axis=1)
        self.nodes[:-1, 2] = self.nodes[1:, 0]
        self.nodes[:-1, 1] = 0.5 * (self.nodes[:-1, 0] + self.nodes[1:, 0])
        self.h, self.lanes = PERIOD_S / SUBSTEPS, lanes
        self.for_c = np.ascontiguousarray(self.equation.rows[[GAIN, DAMPING, STIFFNESS, CUBIC]])
        self.out = np.empty((SAMPLES + 1, lanes)), np.empty((SAMPLES + 1, lanes))
        self.out_c = np.empty((SAMPLES + 1, lanes)), np.empty((SAMPLES + 1, lanes))

    def ours(self) -> None:
        z, v = np.zeros(self.lanes), np.zeros(self.lanes)
        self.equation.march(z, v, Driven(self.nodes, self.h), SUBSTEPS, self.out)

    def in_c(self, library: ctypes.CDLL) -> None:
        z, v = np.zeros(self.lanes), np.zeros(self.lanes)
        many = self.lanes > 1
        pointers = [
            ctypes.c_void_p(array.ctypes.data) for array in (z, v, self.nodes, self.for_c, *self.out_c)
        ]
        sizes = ctypes.c_size_t(len(self.nodes)), ctypes.c_double(self.h), ctypes.c_size_t(SUBSTEPS)
        arguments = (*pointers[:3], *sizes, *pointers[3:], *([ctypes.c_size_t(self.lanes)] if many else []))
        (library.many_lanes if many else library.one_trajectory)(*arguments)

    def check(self, library: ctypes.CDLL) -> float:
        """Largest difference in parts of the largest displacement."""
        self.ours()
        self.in_c(library)
        worst = float(np.abs(self.out[0] - self.out_c[0]).max() / np.abs(self.out_c[0]).max())
        if not worst <= SAME:
            raise SystemExit(f"numba and C differ by {worst:.3g} of the motion, more than {SAME:g}")
        return worst


def ratios(rounds: int) -> list[Ratio]:
    """Marching beside C, whole predictions with each mechanism beside the nominal model's."""
    march, _ = costs_beside_c(rounds)
    found = [
        Ratio("driven Duffing, one trajectory, a step", "gcc -O3 -march=native", march["one"], march["one C"], "ns"),
        Ratio(
            f"driven Duffing, {LANES} lanes, a step and lane", "gcc -O3 -march=native", march["many"],
            march["many C"], "ns",
        ),
    ]  # fmt: skip
    cost, _ = costs_of_mechanisms(max(3, rounds // 2))
    for lanes, text in ((1, "one trajectory"), (LANES, f"{LANES} lanes")):
        found += [
            Ratio(f"{identity}, {text}", "nominal model", cost[identity, lanes], cost["", lanes], "ns")
            for identity in MECHANISMS
        ]
    return found


def costs_beside_c(rounds: int) -> tuple[dict[str, float], float]:
    """ns a step and lane of one trajectory and many lanes, numba and C on the same drive; and how far they differ."""
    one, many = Case(1), Case(LANES)
    steps = SAMPLES * SUBSTEPS
    with tempfile.TemporaryDirectory() as folder:
        library = compiled_c(Path(folder))
        worst = max(one.check(library), many.check(library))
        calls: dict[str, Callable[[], Any]] = {
            "one": one.ours, "one C": lambda: one.in_c(library),
            "many": many.ours, "many C": lambda: many.in_c(library),
        }  # fmt: skip
        cost = medians(calls, rounds, {name: steps * (LANES if "many" in name else 1) for name in calls})
    return cost, worst


def against_c(rounds: int) -> None:
    """Print one trajectory and many lanes beside C."""
    cost, worst = costs_beside_c(rounds)
    steps = SAMPLES * SUBSTEPS
    print(
        f"driven Duffing, nominal, a step and lane ({steps} steps; numba and C differ by {worst:.0e} at most)"
    )
    print(f"  one trajectory  numba {cost['one']:6.2f} ns   C {cost['one C']:6.2f} ns   ratio "
          f"{verdict(cost['one'] / cost['one C'], REACH['one'])}")  # fmt: skip
    print(f"  {LANES} lanes        numba {cost['many']:6.2f} ns   C {cost['many C']:6.2f} ns   ratio "
          f"{verdict(cost['many'] / cost['many C'], REACH['lanes'])}")  # fmt: skip
    print(
        f"  lanes against one trajectory: {verdict(cost['one'] / cost['many'], REACH['gain'], at_least=True)}"
    )


def compiled_c(folder: Path) -> ctypes.CDLL:
    """oscillator.c as a shared library."""
    target = folder / "oscillator.so"
    options = ["-O3", "-march=native", "-std=c11", "-Wall", "-Werror", "-shared", "-fPIC"]
    subprocess.run(["gcc", *options, str(HERE / "oscillator.c"), "-o", str(target)], check=True)
    return ctypes.CDLL(str(target))


class Extended:
    """The nominal model with one mechanism on, or none, predicting one record again and again."""

    def __init__(self, identity: str, lanes: int, stimulus: Stimulus) -> None:
        rng = np.random.default_rng(3)
        simulation = nominal().extended((identity,)) if identity else nominal()
        acting = [values_of(simulation)]
        for k, parameter in enumerate(simulation.parameters):
            if parameter.mechanism:
                declared = parameter.declared
                size = declared.scale(SCALES) * (1.0 if declared.is_shape else 0.05)
                if declared.is_shape and declared.default is not None:
                    size = declared.default
                acting[0][k] = np.clip((declared.neutral or 0.0) + size, declared.low, declared.high)
        self.values = np.tile(acting[0], (lanes, 1))
        self.values[:, :4] *= 1.0 + 0.01 * rng.standard_normal((lanes, 4))
        self.simulation, self.lanes, self.turn = simulation, lanes, 0
        self.stimulus = stimulus
        active = list(simulation.mechanisms)
        equation = Equation.of(simulation.parameters, active, self.values)
        hold = "" if any(one.acts_before_the_equation for one in active) else "linear"
        self.steps = (SAMPLES - 1) * equation.plan(PERIOD_S, 0.3, hold).substeps

    def predict(self) -> None:
        """As a fit does: the same record, each time other values."""
        self.turn += 1
        moved = self.values * (1.0 + 1e-4 * self.turn)
        found = self.simulation.predict(self.stimulus, moved)
        if (found.diverged_at >= 0).any():
            raise SystemExit(f"{self.simulation.mechanisms}: diverged")


def costs_of_mechanisms(rounds: int) -> tuple[dict[tuple[str, int], float], dict[tuple[str, int], int]]:
    """ns a step and lane of whole predictions, and steps, by mechanism ("": none) and lanes."""
    stimulus = Stimulus(
        inputs={"drive": random_drive(SAMPLES)}, holds={"drive": "linear"}, period_s=PERIOD_S,
        peak={"displacement": 0.3},
    )  # fmt: skip
    cases = {
        (identity, lanes): Extended(identity, lanes, stimulus)
        for identity in ("", *MECHANISMS)
        for lanes in (1, LANES)
    }
    calls = {key: case.predict for key, case in cases.items()}
    cost = medians(calls, rounds, {key: case.steps * key[1] for key, case in cases.items()})
    return cost, {key: case.steps for key, case in cases.items()}


def every_mechanism(rounds: int) -> None:
    """Print whole predictions against the nominal model's, a step and lane."""
    print(
        f"whole predictions of {SAMPLES} samples with one mechanism on, a step and lane, values new each time"
    )
    print(f"  {'':28s}{'one trajectory':>24s}{f'{LANES} lanes':>24s}   steps of nominal's")
    cost, steps = costs_of_mechanisms(rounds)
    for identity in ("", *MECHANISMS):
        row = [cost[identity, lanes] for lanes in (1, LANES)]
        base = [cost["", lanes] for lanes in (1, LANES)]
        cells = [
            f"{found:7.2f} ns {found / nominal_cost:5.2f}{' ' if found <= REACH['mechanism'] * nominal_cost else '!'}"
            for found, nominal_cost in zip(row, base, strict=True)
        ]
        more = steps[identity, 1] / steps["", 1]
        print(f"  {identity or 'nominal':28s}{cells[0]:>24s}{cells[1]:>24s}   {more:.2f}")
    print(f"  !: more than {REACH['mechanism']:g} x nominal")


def paper_sweep() -> None:
    """45 frequencies x 100 starts x 100 s at 128 steps a period, the HM beam."""
    numbers = {
        "damping": (0.3, "1/s"), "stiffness": (-4275.6, "1/s^2"), "stiffness_cubic": (88.2, "1/(mm^2*s^2)"),
        "drive_gain": (1000.0, "mm/m"),
    }  # fmt: skip
    parameters = {name: {"value": value, "unit": unit} for name, (value, unit) in numbers.items()}
    model = ModelFile.model_validate({"model": {"kind": "oscillator", "parameters": parameters}})
    simulation = oscillator_simulation(model, {"drive": "m/s^2", "displacement": "mm"}, "benchmark")
    z, v = np.meshgrid(np.linspace(-12.98, 12.94, 10), np.linspace(-857.89, 862.38, 10))
    starts = np.column_stack([z.ravel(), v.ravel()])
    equation = Equation.of(simulation.parameters, [], np.tile(values_of(simulation), (100, 1)))
    next(sweep(equation, starts, 3.81, [7.0], 1.0))  # compiles
    begun = time.process_time()
    maps = list(sweep(equation, starts, 3.81, np.arange(7.0, 18.01, 0.25), 100.0))
    spent = time.process_time() - begun
    print(f"sweep, {len(maps)} frequencies x 100 starts x 100 s at 128 steps a period, processor seconds "
          f"{verdict(spent, REACH['sweep_s'])}")  # fmt: skip


def silverbox_fit(folder: Path, rounds: int) -> None:
    """The nominal four parameters to the training record of 65,062 samples: starts, fit and intervals."""
    if not (folder / "dataset.toml").is_file():
        print(f"output-error fit: {folder} is absent")
        return
    dataset = read_dataset(folder / "dataset.toml")
    walls, fits = [], []
    for turn in range(rounds + 1):
        begun = time.perf_counter()
        fits.append(identify_oscillator(dataset, None, build_simulation))
        if turn:
            walls.append(time.perf_counter() - begun)
    fit = fits[-1].fit
    rms = ", ".join(f"{1e3 * value:.3g} m{dataset.units[name]}" for name, value in fit.rms.items())
    print(f"output-error fit of {len(fit.free)} parameters to the Silverbox's training record, wall seconds "
          f"{verdict(median(walls), REACH['fit_s'])}; error RMS {rms}")  # fmt: skip


if __name__ == "__main__":
    main()
