"""Four kinds of device and of bench that outside labs might have; all numbers come from a seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, sqrt

import numpy as np
from foreign_common import log_uniform
from foreign_device import Device
from foreign_loops import Array, DomainLoop, LimitingLoop, SmoothLoop

STYLES = ("few_domains", "many_domains", "smooth_loop", "thick_film")


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """A device with the lab around it: current range, instruments, units, and the kind of file."""

    style: str
    device: Device
    low_mA: float
    high_mA: float
    centre_mA: float  # in the middle of the transition
    hold_samples: int  # of a level of the staircase
    resistance_unit: str
    deflection_unit: str
    resistance_step_ohm: float  # of the converter, 0: none
    resistance_noise: float  # relative, white
    resistance_flicker: float  # relative, 1/f
    deflection_noise_um: float
    file: str  # "csv" | "csv with time" | "csv 5 digits" | "npz"


def stream(style: str, seed: int, what: str) -> np.random.Generator:
    """Random numbers of one purpose, so that an effect does not change the device or the records."""
    purposes = ("device", "records", "effect", "noise")
    return np.random.default_rng([STYLES.index(style), seed, purposes.index(what)])


def draw_bench(style: str, seed: int) -> Bench:
    """The bench of a style and seed."""
    if style not in STYLES:
        raise ValueError(f"style must be one of {', '.join(STYLES)}, got {style!r}")
    rng = stream(style, seed, "device")
    ambient, centre = float(rng.uniform(19.0, 26.0)), float(rng.uniform(58.0, 67.0))
    high_mA, hottest = log_uniform(rng, 2.0, 40.0), centre + float(rng.uniform(22.0, 30.0))
    coldest = max(centre - float(rng.uniform(24.0, 30.0)), ambient + 6.0)
    gain = (hottest - ambient) / high_mA**2
    metal, deflection = log_uniform(rng, 1e3, 2e4), log_uniform(rng, 30.0, 500.0)
    device = Device(
        ambient_C=ambient,
        gain_C_per_mA2=gain,
        tau_s=float(rng.uniform(1.0, 3.5)) * 1e-3,
        period_s=1e-3,
        convention="start",
        new_loop=_domains(ambient, *np.array([[centre], [6.0], [1.0], [1.0]])),  # each style has its own
        mixing="lichtenecker",
        mixing_number=3.0,
        semiconductor_ohm=metal * log_uniform(rng, 15.0, 300.0),
        activation_K=float(rng.uniform(2000.0, 4500.0)),
        metal_ohm=metal,
        deflection_um=deflection,
        bimorph_um_per_K=-deflection * float(rng.uniform(0.002, 0.008)),
    )
    bench = Bench(
        style=style,
        device=device,
        low_mA=sqrt((coldest - ambient) / gain),
        high_mA=high_mA,
        centre_mA=sqrt((centre - ambient) / gain),
        hold_samples=30,
        resistance_unit=str(rng.choice(["ohm", "kohm"])),
        deflection_unit=str(rng.choice(["um", "mm"])),
        resistance_step_ohm=0.0,
        resistance_noise=log_uniform(rng, 3e-4, 2e-3),
        resistance_flicker=0.0,
        deflection_noise_um=deflection * log_uniform(rng, 5e-4, 3e-3),
        file="npz",
    )
    special = {
        "few_domains": _few_domains,
        "many_domains": _many_domains,
        "smooth_loop": _smooth_loop,
        "thick_film": _thick_film,
    }
    return special[style](bench, centre, rng)


def _few_domains(bench: Bench, centre: float, rng: np.random.Generator) -> Bench:
    """30 to 80 equal domains, effective medium, read at the end by a converter with visible steps."""
    n = int(rng.integers(30, 81))
    middle = rng.normal(centre, rng.uniform(2.0, 4.5), n)
    width = np.maximum(rng.normal(rng.uniform(4.0, 8.0), 1.5, n), 1.0)
    device = replace(
        bench.device,
        convention="end",
        mixing="bruggeman",
        mixing_number=float(rng.choice([2.0, 3.0])),
        new_loop=_domains(bench.device.ambient_C, middle, width, np.ones(n), np.ones(n)),
    )
    full_scale = 1.3 * float(device.resistance(device.ambient_C, 0.0))
    return replace(
        bench,
        device=device,
        hold_samples=ceil(rng.uniform(7.0, 10.0) * device.tau_s / device.period_s),
        resistance_unit="ohm",
        resistance_step_ohm=full_scale / 2 ** int(rng.integers(14, 17)),
        resistance_noise=1e-4,
        file="csv",
    )


def _many_domains(bench: Bench, centre: float, rng: np.random.Generator) -> Bench:
    """Thousands of domains with log-normal widths; those that switch late bend the beam more (or less)."""
    n = int(rng.integers(3000, 5001))
    place = rng.normal(0.0, 1.0, n)
    middle = centre + rng.uniform(2.0, 4.5) * place
    width = rng.uniform(3.5, 7.0) * np.exp(rng.uniform(0.25, 0.5) * rng.normal(size=n))
    structural = rng.gamma(2.0, size=n) * np.maximum(1.0 + rng.uniform(-0.35, 0.35) * place, 0.05)
    loop = _domains(bench.device.ambient_C, middle, width, np.ones(n), structural)
    return replace(bench, device=replace(bench.device, new_loop=loop))


def _smooth_loop(bench: Bench, centre: float, rng: np.random.Generator) -> Bench:
    """No relays: two limiting loops, the structural one a little beside the electrical one."""
    period = float(rng.choice([0.5e-3, 2e-3]))
    start = bench.device.ambient_C
    width, beta, gamma = rng.uniform(4.0, 9.0), rng.uniform(0.2, 0.4), rng.uniform(0.9, 0.97)
    offset, wider, steeper = rng.uniform(-1.5, 1.5), rng.uniform(0.8, 1.2), rng.uniform(0.75, 1.3)

    def new_loop() -> SmoothLoop:
        electrical = LimitingLoop(centre, width, beta, gamma, start)
        structural = LimitingLoop(centre + offset, width * wider, beta * steeper, gamma, start)
        return SmoothLoop(electrical, structural, start)

    tau = log_uniform(rng, 1.0, 10.0) * period
    device = replace(bench.device, period_s=period, tau_s=tau, mixing="series", new_loop=new_loop)
    hold = ceil(rng.uniform(6.0, 8.0) * tau / period)
    return replace(bench, device=device, hold_samples=hold, file="csv with time")


def _thick_film(bench: Bench, centre: float, rng: np.random.Generator) -> Bench:
    """Slow; two populations of domains, percolation, read at the end, flicker noise, short numbers."""
    n = int(rng.integers(400, 801))
    second = rng.random(n) < rng.uniform(0.25, 0.5)
    middle = rng.normal(centre - 2.0, rng.uniform(1.8, 3.0), n) + np.where(second, rng.uniform(4.0, 7.0), 0.0)
    width = rng.uniform(4.0, 8.0) * rng.weibull(rng.uniform(2.5, 4.0), n) + 1.0
    deep = np.where(second, rng.uniform(0.6, 1.5), 1.0)
    tau = log_uniform(rng, 0.03, 0.25)
    device = replace(
        bench.device,
        convention="end",
        tau_s=tau,
        period_s=0.02 if tau > 0.1 else 0.01,
        mixing="percolation",
        mixing_number=float(rng.uniform(1.4, 2.2)),
        new_loop=_domains(bench.device.ambient_C, middle, width, np.ones(n), deep),
    )
    return replace(
        bench,
        device=device,
        hold_samples=ceil(rng.uniform(6.0, 8.0) * tau / device.period_s),
        resistance_noise=0.0,
        resistance_flicker=log_uniform(rng, 5e-4, 3e-3),
        file="csv 5 digits",
    )


def _domains(
    ambient: float, middle: Array, width: Array, electrical: Array, structural: Array
) -> Callable[[], DomainLoop]:
    """Maker of fresh loops with these centres and widths [°C]; no domain is metallic at rest."""
    down = np.maximum(middle - width / 2.0, ambient + 4.0)
    up = np.maximum(middle + width / 2.0, down + 0.5)
    return partial(DomainLoop, up, down, electrical, structural)
