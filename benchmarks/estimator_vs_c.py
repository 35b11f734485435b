"""What a step costs: the composite estimator against C, every model a sample, the closed loop against real time.

Rounds are interleaved, medians given, so that what else the machine does meets both sides alike.

    python benchmarks/estimator_vs_c.py [--model MODEL.toml] [--rounds 15]
"""

from __future__ import annotations

import argparse
import ctypes
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from ratio import Ratio

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.estimators import ESTIMATORS
from rtctl.estimators.composite import SURROGATE_MARGIN, composite_step
from rtctl.estimators.observer import ObserverEstimator, packed_observer_step
from rtctl.hysteresis.egpi import EgpiParams, egpi_run
from rtctl.hysteresis.gap_free import gap_free_inverse_run
from rtctl.hysteresis.gpi import gpi_run
from rtctl.hysteresis.gpi_inverse import GpiInverse, GpiInverseParams, gpi_inverse_run
from rtctl.hysteresis.preisach.model import preisach_run
from rtctl.identification.vo2.identify import Vo2FitOptions, identify_vo2
from rtctl.measured.reading import read_dataset
from rtctl.models.vo2 import Vo2Model, read_model
from rtctl.scenario.schema import load_scenario
from rtctl.session.acquisition import acquire
from rtctl.session.closed_loop import track
from rtctl.wiring import build_driver

HERE = Path(__file__).resolve().parent
SCENARIOS = HERE.parent / "scenarios"
SAMPLES = 20_000
SAME = 1e-12  # of the deflection [um]
REACH_NS = 500.0
REACH_REAL_TIME = 100.0
CHUNK = 500


@kernel
def composite_run(
    state: FloatArray, plays: FloatArray, ohm: FloatArray, low: float, high: float, inverse: GpiInverseParams,
    egpi: EgpiParams,
) -> FloatArray:  # fmt: skip
    """Deflection [um] for each resistance: the estimator's kernel in a compiled loop."""
    deflection = np.empty_like(ohm)
    for k in range(ohm.size):
        deflection[k] = composite_step(state, plays, ohm[k], low, high, inverse, egpi)[0]
    return deflection


@kernel
def observer_run(memory: FloatArray, current: FloatArray, ohm: FloatArray) -> FloatArray:
    """Deflection [um] for each current [mA] and resistance, 1 ms apart."""
    deflection = np.empty_like(ohm)
    for k in range(ohm.size):
        deflection[k] = packed_observer_step(memory, current[k], ohm[k], 1e-3)[0]
    return deflection


class CComposite(ctypes.Structure):
    """`rtctl_composite` of composite.c."""

    _fields_ = (
        [("plays", ctypes.c_size_t), ("p_hat", ctypes.c_void_p), ("r_hat", ctypes.c_void_p)]
        + [(name, ctypes.c_double) for name in ("a_R", "b_R", "a_L", "b_L", "c")]
        + [(name, ctypes.c_double) for name in ("y_limit", "u_limit", "deadband", "low", "high")]
        + [("egpi_plays", ctypes.c_size_t)]
        + [(name, ctypes.c_void_p) for name in ("p", "r", "ea_R", "eb_R", "ea_L", "eb_L")]
        + [(name, ctypes.c_double) for name in ("c2", "c3", "c4")]
    )


class Composite(NamedTuple):
    """The two halves of an identified composite and the clip between them [mA]."""

    inverse: GpiInverse
    egpi: Any
    low: float
    high: float

    @classmethod
    def of(cls, model: Vo2Model) -> Composite:
        """As `CompositeEstimator` does it."""
        margin = SURROGATE_MARGIN * model.current.width
        inverse = GpiInverse.of(model.resistance_gpi)
        return cls(inverse, model.composite_egpi, model.current.low - margin, model.current.high + margin)

    def states(self) -> tuple[FloatArray, FloatArray]:
        """After a full cooling."""
        v = self.inverse.model.v_low
        return self.inverse.initial_state(v), self.egpi.initial_state(v)

    def for_c(self) -> CComposite:
        """The parameters as composite.c takes them; the arrays are the models' own, which live on."""
        first, second = self.inverse.params, self.egpi.params
        envelopes = [getattr(first, name) for name in ("a_R", "b_R", "a_L", "b_L", "c")]
        limits = [first.y_limit, first.u_limit, first.deadband, self.low, self.high]
        columns = [getattr(second, name) for name in ("p", "r", "a_R", "b_R", "a_L", "b_L")]
        return CComposite(
            first.p_hat.size, first.p_hat.ctypes.data, first.r_hat.ctypes.data, *envelopes, *limits,
            second.p.size, *(column.ctypes.data for column in columns), second.c2, second.c3, second.c4,
        )  # fmt: skip


def main() -> None:
    """Identify, or read a model; then print what everything costs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", type=Path, help="a model file of device vo2_a (else one is identified)")
    parser.add_argument("--rounds", type=int, default=15)
    args = parser.parse_args()
    model = identified() if args.model is None else read_model(args.model)
    current, ohm = staircase(SAMPLES)
    against_c(Composite.of(model), ohm, args.rounds)
    print("a sample in a compiled loop")
    for name, cost in medians(models(model, current, ohm), args.rounds, ohm.size).items():
        print(f"  {name:24s}{cost:6.0f} ns")
    closed_loops(model, min(args.rounds, 7))


def ratios(rounds: int) -> list[Ratio]:
    """The composite beside the same in C; the other models beside that C, too, which is a yardstick for them."""
    model = identified()
    current, ohm = staircase(SAMPLES)
    with beside_c(Composite.of(model), ohm) as (calls, _):
        cost = medians(calls | models(model, current, ohm), rounds, ohm.size)
    return [
        Ratio("composite step", "the same, gcc -O3", cost["numba"], cost["C"], "ns"),
        *(
            Ratio(f"{name}, a sample", "composite step, gcc -O3", cost[name], cost["C"], "ns")
            for name in cost
            if name not in calls
        ),
    ]


@cache
def identified() -> Vo2Model:
    """A model of the bundled device A."""
    scenario, _ = load_scenario(SCENARIOS / "acquire_vo2.toml", [])
    with tempfile.TemporaryDirectory() as folder:
        manifest = acquire(
            scenario, build_driver(scenario, SCENARIOS), Path(folder), lambda: False, lambda text: None
        )
        return identify_vo2(read_dataset(manifest), Vo2FitOptions(), lambda text: None)


def staircase(samples: int) -> tuple[FloatArray, FloatArray]:
    """Currents [mA] and measured resistances [ohm] of device A on a random staircase, noise and all."""
    driver = build_driver(load_scenario(SCENARIOS / "random_staircase.toml", [])[0], SCENARIOS)
    driver.open(lockstep_period_us=1000, watchdog_ms=0, timeout_s=1.0)
    current = np.repeat(np.random.default_rng(5).uniform(5.8, 8.4, samples // 20), 20)
    ohm = np.array([driver.exchange((level,)).sensed[0] for level in current.tolist()])
    driver.close((0.0,))
    return current, ohm


@contextmanager
def beside_c(composite: Composite, ohm: FloatArray) -> Iterator[tuple[dict[str, Callable[[], Any]], float]]:
    """The composite in a compiled loop, numba and C, on the same readings; and by how much they differ [um]."""
    deflection = np.empty_like(ohm)
    with tempfile.TemporaryDirectory() as folder:
        library = compiled_c(Path(folder))
        parameters = composite.for_c()

        def in_c() -> NDArray[np.float64]:
            state, plays = composite.states()
            arrays = (ctypes.c_void_p(array.ctypes.data) for array in (state, plays, ohm, deflection))
            library.rtctl_composite_run(ctypes.byref(parameters), *arrays, ctypes.c_size_t(ohm.size))
            return deflection

        def ours() -> NDArray[np.float64]:
            last = (composite.low, composite.high, composite.inverse.params, composite.egpi.params)
            return composite_run(*composite.states(), ohm, *last)

        def libm() -> float:
            v = ctypes.c_void_p(inside.ctypes.data)
            return float(library.rtctl_libm_run(ctypes.byref(parameters), v, ctypes.c_size_t(ohm.size)))

        inside = np.linspace(composite.low, composite.high, ohm.size)
        worst = float(np.abs(ours() - in_c()).max())
        if not worst <= SAME:
            raise SystemExit(
                f"numba and C differ by {worst:.3g} um, more than {SAME:g}: one of them is wrong"
            )
        yield {"numba": ours, "C": in_c, "libm": libm}, worst


def against_c(composite: Composite, ohm: FloatArray, rounds: int) -> None:
    """Print what the composite costs, numba and C."""
    with beside_c(composite, ohm) as (calls, worst):
        found = medians(calls, rounds, ohm.size)
    print(f"composite step in a compiled loop (reach <= {REACH_NS:.0f} ns; differ by {worst:.1e} um at most)")
    print(f"  numba {found['numba']:6.0f} ns   gcc -O3 {found['C']:6.0f} ns   "
          f"ratio {found['numba'] / found['C']:.2f}   of which tanh and atanh {found['libm']:.0f} ns")  # fmt: skip


def compiled_c(folder: Path) -> ctypes.CDLL:
    """composite.c as a shared library; no fused multiplications, as numba makes none."""
    target = folder / "composite.so"
    options = ["-O3", "-std=c11", "-Wall", "-Werror", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run(["gcc", *options, str(HERE / "composite.c"), "-o", str(target), "-lm"], check=True)
    library = ctypes.CDLL(str(target))
    library.rtctl_libm_run.restype = ctypes.c_double
    return library


def models(model: Vo2Model, current: FloatArray, ohm: FloatArray) -> dict[str, Callable[[], Any]]:
    """Each model in its compiled loop."""
    gpi, inverse, free = model.resistance_gpi, GpiInverse.of(model.resistance_gpi), model.resistance_gap_free
    egpi, fine = model.composite_egpi, model.deflection_preisach
    v0, kohm, u = float(current[0]), -1e-3 * ohm, -np.log(ohm)
    observer = ObserverEstimator(model)
    memory = observer._packed(v0)
    return {
        "GPI": lambda: gpi_run(gpi.initial_state(v0), current, gpi.params),
        "inverse GPI": lambda: gpi_inverse_run(inverse.initial_state(v0), kohm, inverse.params),
        "EGPI, own envelopes": lambda: egpi_run(egpi.initial_state(v0), current, egpi.params),
        "gap-free inverse": lambda: gap_free_inverse_run(free.initial_state(v0), u, free.params),
        f"Preisach, {fine.grid.size - 1} levels": lambda: preisach_run(
            fine.initial_state(v0), current, fine.params
        ),
        "observer": lambda: observer_run(memory.copy(), current, ohm),
    }


def medians(calls: dict[str, Callable[[], Any]], rounds: int, samples: int) -> dict[str, float]:
    """Processor ns a sample, the median of interleaved rounds; a round before them compiles."""
    costs: dict[str, list[float]] = {name: [] for name in calls}
    for turn in range(rounds + 1):
        for name, call in calls.items():
            begun = time.thread_time_ns()
            call()
            if turn:
                costs[name].append((time.thread_time_ns() - begun) / samples)
    return {name: median(values) for name, values in costs.items()}


class Stopwatch:
    """Asked by the loop whether to stop, once a step, it says no and notes the time of every `CHUNK`th step."""

    def __init__(self) -> None:
        self._asked = 0
        self._noted: list[tuple[int, int]] = []

    def __call__(self) -> bool:
        if self._asked % CHUNK == 0:
            self._noted.append((time.thread_time_ns(), time.perf_counter_ns()))
        self._asked += 1
        return False

    def steps_us(self) -> NDArray[np.float64]:
        """Processor time and wall time of a step, a row a chunk; the first, where the loop settles, left out."""
        return 1e-3 * np.diff(np.array(self._noted, dtype=np.float64), axis=0)[1:] / CHUNK


def closed_loops(model: Vo2Model, rounds: int) -> None:
    """steps.toml in-process on the simulated clock, everything recorded, with each estimator."""
    costs: dict[str, list[NDArray[np.float64]]] = {kind: [] for kind in ESTIMATORS}
    for turn in range(rounds + 1):
        for kind in ESTIMATORS:
            overrides = [f"estimator.kind={kind}", "scenario.any_device=true"]
            scenario, _ = load_scenario(SCENARIOS / "steps.toml", overrides)
            watch = Stopwatch()
            track(scenario, model, build_driver(scenario, SCENARIOS), watch)
            if turn:
                costs[kind].append(watch.steps_us())
    print(
        f"closed loop in-process at 1 ms, everything recorded (reach >= {REACH_REAL_TIME:.0f} x real time); wall "
        "time is longer where others use the machine"
    )
    for kind, chunks in costs.items():
        own, wall = np.median(np.concatenate(chunks), axis=0)
        print(f"  {kind:16s}{own:6.2f} us of processor a step, {1e3 / own:4.0f} x real time; "
              f"{wall:6.2f} us of wall, {1e3 / wall:4.0f} x")  # fmt: skip


if __name__ == "__main__":
    main()
