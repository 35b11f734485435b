"""Two labs with films of grains: a nanoribbon read by an interferometer, a buckled bridge read by a transducer.

They run only where they are asked for (`--style`), not in turn with `foreign_styles.STYLES`; all numbers come from a
seed.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np
from foreign_common import Array, log_uniform
from foreign_grain_device import LAYER_MOST, GrainDevice, make_grains
from foreign_grain_motion import Film, Grains

STYLES = ("nanoribbon", "buckled_bridge")
KIND = 11  # of the streams, so that they are not those of other styles


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """A device with the lab around it: current range, instruments, units, and the kind of file."""

    style: str
    device: GrainDevice
    low_mA: float
    high_mA: float
    centre_mA: float  # in the middle of the transition
    hold_samples: int  # of a level of the staircase, the shortest
    current_unit: str
    resistance_unit: str
    deflection_unit: str
    ranges_ohm: tuple[float, ...]  # of the ohmmeter, which takes the smallest that fits
    counts: int  # of the ohmmeter in each of its ranges
    deflection_step_um: float  # of the converter
    resistance_noise: float  # relative, white
    resistance_flicker: float  # relative, 1/f
    deflection_noise_um: float
    deflection_flicker_um: float
    file: str  # "h5" | "h5 in one" | "csv with commas" | "mat"
    names: dict[str, str]  # of the columns: current, resistance, deflection


def stream(style: str, seed: int, what: str) -> np.random.Generator:
    """Random numbers of one purpose, so that an effect does not change the device or the records."""
    purposes = ("device", "records", "effect", "noise", "order", "staircase")
    return np.random.default_rng([KIND, STYLES.index(style), seed, purposes.index(what)])


def draw_bench(style: str, seed: int) -> Bench:
    """The bench of a style and seed."""
    if style not in STYLES:
        raise ValueError(f"style must be one of {', '.join(STYLES)}, got {style!r}")
    draw = {"nanoribbon": _nanoribbon, "buckled_bridge": _buckled_bridge}[style]
    return draw(stream(style, seed, "device"))


def _nanoribbon(rng: np.random.Generator) -> Bench:
    """100 to 400 crystals across a cantilevered ribbon: 5 to 20 kSa/s, uA in, nm out, HDF5 with raw counts.

    Heating starts sharply, cooling is supercooled by Gumbel's law; grains of a column are in parallel and the columns
    in series; the tip is warmer than the clamp, and a grain near the clamp bends the tip more.
    """
    columns, across = int(rng.integers(18, 41)), int(rng.integers(6, 11))
    n, ambient, high_mA = columns * across, float(rng.uniform(20.0, 25.0)), log_uniform(rng, 0.15, 2.5)
    place = (np.arange(columns) + 0.5) / columns
    warmth = 1.0 + float(rng.uniform(0.05, 0.18)) * (2.0 * place - 1.0)
    column = np.repeat(np.arange(columns), across)
    up = rng.logistic(float(rng.uniform(64.0, 70.0)), float(rng.uniform(0.5, 1.1)), n)
    width = np.maximum(rng.gumbel(float(rng.uniform(6.0, 11.0)), float(rng.uniform(1.0, 2.2)), n), 2.0)
    down = np.maximum(up - width, ambient + 12.0)
    arm = (1.0 - place[column]) ** float(rng.uniform(0.6, 1.2)) + 0.05
    area = rng.gamma(3.0, size=n)
    grains = make_grains(ambient, up, down, warmth, column, area, arm * area)
    metal, deflection = log_uniform(rng, 250.0, 4e3), log_uniform(rng, 0.4, 8.0)
    film = Film(
        semiconductor=metal * log_uniform(rng, 50.0, 250.0),
        activation=float(rng.uniform(2500.0, 4200.0)),
        metal=metal,
        critical=0.0,
        low_exponent=1.0,
        high_exponent=1.0,
    )
    period = float(rng.choice([1.25e-4, 2e-4, 5e-5]))
    tau = period * float(rng.uniform(3.0, 9.0))
    limits = _limits(ambient, high_mA, grains, rng)
    device = _device(rng, limits, ambient, tau, period, grains, warmth, 0.0, film, deflection, 0.0)
    noise = deflection * log_uniform(rng, 4e-4, 2e-3)
    return Bench(
        style="nanoribbon",
        device=device,
        **_levels(limits, ambient),
        hold_samples=ceil(float(rng.uniform(7.0, 9.0)) * tau / period),
        current_unit="uA",
        resistance_unit="ohm",
        deflection_unit="nm",
        ranges_ohm=(2e3, 2e4, 2e5, 2e6, 2e7),
        counts=2**15,
        deflection_step_um=_nice(2.6 * deflection / 2**14),
        resistance_noise=log_uniform(rng, 2e-4, 1e-3),
        resistance_flicker=log_uniform(rng, 2e-4, 1e-3),
        deflection_noise_um=noise,
        deflection_flicker_um=0.5 * noise,
        file=str(rng.choice(["h5", "h5 in one"])),
        names={"current": "I_heater", "resistance": "R_film", "deflection": "z_tip"},
    )


def _buckled_bridge(rng: np.random.Generator) -> Bench:
    """A thick film of coupled grains on a buckled bridge: 10 to 50 Sa/s, A in, mm out, commas for points or MATLAB.

    Thresholds have gamma's skew, widths beta's and grow with the threshold; a grain's neighbours pull it along; the
    resistance is a general effective medium's; the deflection grows as a root does.
    """
    n, ambient, high_mA = (
        int(rng.integers(260, 420)),
        float(rng.uniform(18.0, 27.0)),
        log_uniform(rng, 60.0, 900.0),
    )
    shape, spread = float(rng.uniform(2.0, 5.0)), float(rng.uniform(2.2, 4.2))
    skewed = (rng.gamma(shape, size=n) - shape) / sqrt(shape)
    middle = float(rng.uniform(60.0, 66.0)) + spread * skewed
    width = 2.0 + float(rng.uniform(6.0, 11.0)) * rng.beta(2.0, 3.0, n) + 0.4 * np.clip(skewed, -1.5, 3.0)
    coupling = float(rng.uniform(0.3, 1.1))
    volume = rng.lognormal(0.0, 0.6, n)
    bends = volume * np.maximum(1.0 + float(rng.uniform(-0.3, 0.3)) * skewed, 0.1)
    warmth, column = np.ones(1), np.zeros(n, dtype=np.int64)
    grains = make_grains(
        ambient,
        middle + 0.5 * width + 0.5 * coupling,
        middle - 0.5 * width + 0.5 * coupling,
        warmth,
        column,
        volume,
        bends,
    )
    metal, deflection = log_uniform(rng, 15.0, 400.0), log_uniform(rng, 80.0, 1500.0)
    film = Film(
        semiconductor=metal * log_uniform(rng, 25.0, 150.0),
        activation=float(rng.uniform(1800.0, 3600.0)),
        metal=metal,
        critical=float(rng.uniform(0.16, 0.45)),
        low_exponent=float(rng.uniform(0.7, 1.0)),
        high_exponent=float(rng.uniform(1.3, 2.0)),
    )
    period = float(rng.choice([0.02, 0.05, 0.1]))
    tau = period * float(rng.uniform(5.0, 16.0))
    limits = _limits(ambient, high_mA, grains, rng)
    buckling = float(rng.uniform(0.8, 2.0))
    device = _device(rng, limits, ambient, tau, period, grains, warmth, coupling, film, deflection, buckling)
    return Bench(
        style="buckled_bridge",
        device=device,
        **_levels(limits, ambient),
        hold_samples=ceil(float(rng.uniform(6.5, 8.5)) * tau / period),
        current_unit="A",
        resistance_unit="kohm",
        deflection_unit="mm",
        ranges_ohm=(500.0, 5e3, 5e4, 5e5, 5e6),
        counts=50_000,
        deflection_step_um=_nice(1.6 * deflection / 2**12),
        resistance_noise=log_uniform(rng, 1e-4, 5e-4),
        resistance_flicker=log_uniform(rng, 3e-4, 1.5e-3),
        deflection_noise_um=deflection * log_uniform(rng, 3e-4, 1.5e-3),
        deflection_flicker_um=0.0,
        file=str(rng.choice(["csv with commas", "csv with commas", "mat"])),
        names={"current": "Strom", "resistance": "Widerstand", "deflection": "Weg"},
    )


def _device(
    rng: np.random.Generator,
    limits: tuple[float, float, float, float],
    ambient: float,
    tau: float,
    period: float,
    grains: Grains,
    warmth: Array,
    coupling: float,
    film: Film,
    deflection: float,
    buckling: float,
) -> GrainDevice:
    return GrainDevice(
        ambient_C=ambient,
        gain_C_per_mA2=limits[3],
        tau_s=tau,
        layer_s=tau * LAYER_MOST * float(rng.uniform(0.2, 1.0)),
        period_s=period,
        convention=str(rng.choice(["start", "end"])),
        grains=grains,
        profile=warmth,
        coupling_K=coupling,
        film=film,
        deflection_um=deflection,
        bimorph_per_K=-float(rng.uniform(0.001, 0.005)),
        buckling=buckling,
    )


def _limits(
    ambient: float, high_mA: float, grains: Grains, rng: np.random.Generator
) -> tuple[float, float, float, float]:
    """Coldest, middle and hottest mean temperature [°C] of the records, and the gain [K/mA^2] that reaches it."""
    up = ambient + (grains.up - ambient) / grains.profile
    down = ambient + (grains.down - ambient) / grains.profile
    hottest = float(np.max(up)) + float(rng.uniform(2.0, 8.0))
    coldest = max(float(np.min(down)) - float(rng.uniform(2.0, 8.0)), ambient + 5.0)
    centre = 0.5 * float(np.median(up) + np.median(down))
    return coldest, centre, hottest, (hottest - ambient) / high_mA**2


def _levels(limits: tuple[float, float, float, float], ambient: float) -> dict[str, float]:
    coldest, centre, hottest, gain = limits
    levels = [sqrt((degrees - ambient) / gain) for degrees in (coldest, centre, hottest)]
    return dict(zip(("low_mA", "centre_mA", "high_mA"), levels, strict=True))


def _nice(step: float) -> float:
    """The step to three digits, so that a manifest can state it."""
    return float(f"{step:.3g}")
