"""Four labs with oscillators of their own; all numbers come from a seed.

`STYLES[-1]`, the beams, is kept back: it is for figures that are reported, and nobody develops on it. Two more labs,
`LATER`, are those of `foreign_response_styles`; `KEPT` is another one kept back, of `foreign_kept_torsion_styles`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from foreign_common import Array, log_uniform
from foreign_oscillator_device import Device, Record, natural_square, simulate
from foreign_oscillator_excitations import (
    coloured_noise,
    multisine,
    noise_burst,
    random_steps,
    stepped_sine,
    sweep,
)
from foreign_oscillator_motion import Law

STYLES = ("shaker_lab", "mems", "test_stand", "beam")
LATER = ("aerospace_panel", "afm_cantilever")
KEPT = ("torsion_balance",)
KIND = 7  # of the streams, so that they are not those of the VO2 styles


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """An oscillator with the lab around it: its records, what its user believes, instruments, units, files."""

    style: str
    device: Device
    records: tuple[Record, ...]
    quality: float
    rms: float  # of the motion about its mean, without any effect, and its largest value
    largest: float
    largest_drive: float
    displacement_unit: str
    drive_unit: str
    user: str  # "identify", "start" (identify from a rough model), "sheet" (diagnose a data sheet's model)
    cubic_known: bool  # whether the user's model has a cubic stiffness
    white: float  # RMS of the noise over that of the motion
    flicker: float
    velocity: bool  # whether a vibrometer's velocity is in the files
    bits: int  # of the converter, 0: none to speak of
    sensor_gain: float  # readings are so many times the displacement that the unit says
    file: str  # "csv" | "npz" | "csv with time" | "csv with commas" | "mat"


AnyBench = TypeVar("AnyBench", bound=Bench)


def stream(style: str, seed: int, what: str) -> np.random.Generator:
    """Random numbers of one purpose, so that an effect does not change the device or the records."""
    purposes = ("device", "records", "effect", "noise", "user", "values")
    return np.random.default_rng([KIND, STYLES.index(style), seed, purposes.index(what)])


def draw_bench(style: str, seed: int, linear: bool = False) -> Bench:
    """The bench of a style and seed; `linear`: its spring is, and its user's model has no cubic stiffness."""
    if style not in STYLES:
        raise ValueError(f"style must be one of {', '.join(STYLES)}, got {style!r}")
    draw = {"shaker_lab": _shaker_lab, "mems": _mems, "test_stand": _test_stand, "beam": _beam}[style]
    bench = draw(stream(style, seed, "device"), stream(style, seed, "records"), linear)
    return with_user(replace(bench, style=style), stream(style, seed, "user"), linear)


def with_user(bench: AnyBench, rng: np.random.Generator, linear: bool) -> AnyBench:
    """The bench with a user who has a model or not; `linear`: the model has no cubic stiffness."""
    user = str(rng.choice(["identify", "identify", "start", "sheet"]))
    if linear and user == "identify":  # which fits a cubic stiffness too
        user = "start"
    known = not linear and (user == "identify" or bench.device.law.cubic != 0.0)
    return replace(bench, user=user, cubic_known=known)


def _bench(
    rng: np.random.Generator,
    device: Device,
    waves: list[tuple[str, Array, Array]],
    motion: float,
    hardening: float,
    drive_unit: str,
    displacement_unit: str,
) -> Bench:
    """A bench whose motion has RMS `motion`; waves are (name, drive, what was sent before), to fit and to test.

    `hardening`: cubic over linear force at the largest motion.
    """
    law, natural = device.law, np.sqrt(natural_square(device.law))
    records = _records(rng, waves)
    straight = Law(damping=law.damping, stiffness=natural**2, cubic=0.0, gain=law.gain)
    trial = replace(device, law=straight, rest=0.0)
    moved = np.concatenate([simulate(trial, record).displacement for record in records])
    scale = motion / np.sqrt(np.mean(moved**2))
    sign_per_unit = {"mm": -1e3, "um": -1e6, "rad": -1.0}[displacement_unit]
    if drive_unit == "m/s^2":
        gain = sign_per_unit * float(rng.uniform(0.9, 1.6))
        level = scale * law.gain / abs(gain)
    else:
        level = log_uniform(rng, 0.2, 5.0)
        gain = scale * law.gain / level
    cubic = law.cubic
    if law.stiffness > 0.0:
        cubic = hardening * natural**2 / np.max(np.abs(moved * scale)) ** 2
    device = replace(device, law=law._replace(gain=float(gain), cubic=float(cubic)))
    records = [replace(r, drive=level * r.drive, before=level * r.before) for r in records]
    motions = np.concatenate([simulate(device, record).displacement for record in records])
    return Bench(
        style="",
        device=device,
        records=tuple(records),
        quality=natural / law.damping,
        rms=float(np.std(motions)),
        largest=float(np.max(np.abs(motions - device.rest))),
        largest_drive=float(max(np.max(np.abs(r.drive)) for r in records)),
        displacement_unit=displacement_unit,
        drive_unit=drive_unit,
        user="",
        cubic_known=False,
        white=log_uniform(rng, 5e-4, 1e-2),
        flicker=0.0,
        velocity=False,
        bits=0,
        sensor_gain=1.0,
        file="npz",
    )


def _records(rng: np.random.Generator, waves: list[tuple[str, Array, Array]]) -> list[Record]:
    """The waves as records: the last ones to test, sometimes none; in some labs the first two are one, repeated."""
    tests = int(rng.choice([0, 1, 1, 1, 2]))
    said = "fit" if rng.random() < 0.6 else ""
    twice = len(waves) - tests > 2 and rng.random() < 0.25
    records = []
    for k, (name, drive, before) in enumerate(waves):
        use = "test" if k >= len(waves) - tests else said
        _, sent, earlier = waves[0] if twice and k < 2 else (name, drive, before)
        repeat, own = "A" if twice and k < 2 else "", int(rng.integers(1 << 30))
        records.append(
            Record(name=f"{name}{k:02d}", use=use, drive=sent, before=earlier, seed=own, repeat=repeat)
        )
    return records


def _spring(rng: np.random.Generator, linear: bool) -> float:
    """Cubic over linear force at the largest motion: none in half of the devices, seldom softening."""
    drawn = float(rng.choice([0.0, 0.0, log_uniform(rng, 0.03, 0.5), -log_uniform(rng, 0.02, 0.12)]))
    return 0.0 if linear else drawn


def _law(natural_Hz: float, quality: float) -> Law:
    natural = 2.0 * np.pi * natural_Hz
    return Law(damping=natural / quality, stiffness=natural**2, cubic=0.0, gain=natural**2)


def _nothing() -> Array:
    return np.empty(0)


def _shaker_lab(rng: np.random.Generator, waves_rng: np.random.Generator, linear: bool) -> Bench:
    """2048 Hz, bursts of band noise and sweeps, mm in CSV; sometimes a vibrometer beside the displacement."""
    natural = log_uniform(rng, 12.0, 160.0)
    f = natural / 2048.0
    hold = str(rng.choice(["band-limited", "band-limited", "linear"]))
    device = Device(law=_law(natural, log_uniform(rng, 5.0, 150.0)), period_s=1.0 / 2048.0, hold=hold)
    samples = 512 * round(np.clip(80.0 / f, 4096, 10240) / 512)
    waves: list[tuple[str, Array, Array]] = []
    for k in range(int(rng.integers(3, 6))):
        if k % 2 == 0:
            wave = noise_burst(samples, 0.25 * f, min(3.0 * f, 0.4), waves_rng)
            waves.append(("burst", wave, _nothing()))
        else:
            ends = np.array([0.4 * f, min(2.2 * f, 0.4)]) * waves_rng.uniform(0.85, 1.15, 2)
            logarithmic = bool(waves_rng.random() < 0.5)
            waves.append(("sweep", sweep(samples, float(ends[0]), float(ends[1]), logarithmic), _nothing()))
    unit, motion = str(rng.choice(["N", "m/s^2", "V"])), log_uniform(rng, 0.02, 5.0)
    bench = _bench(rng, device, waves, motion, _spring(rng, linear), unit, "mm")
    return replace(bench, velocity=bool(rng.random() < 0.3), file="csv")


def _mems(rng: np.random.Generator, waves_rng: np.random.Generator, linear: bool) -> Bench:
    """kHz to MHz, um, multisines from a converter that holds; 12 bits; half of them read at the periods' ends."""
    natural, f = log_uniform(rng, 1.5e3, 4e5), 1.0 / float(rng.uniform(12.0, 32.0))
    rate = float(f"{natural / f:.3g}")
    device = Device(
        law=_law(natural, log_uniform(rng, 20.0, 300.0)),
        period_s=1.0 / rate,
        hold="zero",
        read_at_end=bool(rng.random() < 0.5),
    )
    samples = int(rng.choice([4096, 6000, 8192]))
    waves = []
    for _ in range(int(rng.integers(3, 7))):
        lines, high = int(waves_rng.integers(15, 80)), float(waves_rng.uniform(1.5, 2.6))
        waves.append(("multisine", multisine(samples, lines, 0.2 * f, high * f, waves_rng), _nothing()))
    unit, motion = str(rng.choice(["V", "A"])), log_uniform(rng, 0.01, 3.0)
    bench = _bench(rng, device, waves, motion, _spring(rng, linear), unit, "um")
    return replace(bench, bits=12, file="npz")


def _test_stand(rng: np.random.Generator, waves_rng: np.random.Generator, linear: bool) -> Bench:
    """200 Hz, rad or mm, stepped sines and random steps; the file begins while the device moves."""
    natural = log_uniform(rng, 0.5, 8.0)
    f = natural / 200.0
    device = Device(law=_law(natural, log_uniform(rng, 3.0, 60.0)), period_s=1.0 / 200.0, hold="zero")
    samples = int(np.clip(rng.uniform(40.0, 70.0) / f, 4000, 14000))
    waves: list[tuple[str, Array, Array]] = []
    for k in range(int(rng.integers(2, 6))):
        before = round(float(waves_rng.uniform(3.0, 12.0)) / f)
        shape = random_steps if k % 2 else stepped_sine
        wave = shape(samples + before, f, waves_rng)
        waves.append(("steps" if k % 2 else "sines", wave[before:], wave[:before]))
    unit = str(rng.choice(["N", "V", "A"]))
    of = str(rng.choice(["rad", "mm"]))
    motion = float(rng.uniform(0.15, 0.75)) if of == "rad" else log_uniform(rng, 0.5, 20.0)
    bench = _bench(rng, device, waves, motion, _spring(rng, linear), unit, of)
    return replace(bench, file=str(rng.choice(["csv with time", "csv with commas"])))


def _beam(rng: np.random.Generator, waves_rng: np.random.Generator, linear: bool) -> Bench:
    """Two wells or a hardening spring, chirps up and down and noise, linear hold, 1/f noise, a gain of its own."""
    natural, f = log_uniform(rng, 4.0, 400.0), 1.0 / float(rng.uniform(20.0, 50.0))
    law = _law(natural, log_uniform(rng, 5.0, 100.0))
    device = Device(law=law, period_s=float(f"{f / natural:.3g}"), hold="linear")
    samples = int(rng.integers(5000, 10000))
    waves: list[tuple[str, Array, Array]] = []
    for k in range(int(rng.integers(3, 7))):
        low, high = np.array([0.4, 2.4]) * f * waves_rng.uniform(0.85, 1.15, 2)
        if k % 3 == 2:
            waves.append(("noise", coloured_noise(samples, f, waves_rng), _nothing()))
        else:
            ends = (low, high) if k % 3 == 0 else (high, low)
            waves.append(("up" if k % 3 == 0 else "down", sweep(samples, *ends, True), _nothing()))
    unit, motion = str(rng.choice(["m/s^2", "N", "V"])), log_uniform(rng, 0.1, 8.0)
    hardening, wells_drawn = log_uniform(rng, 0.1, 1.0), bool(rng.random() < 0.5)
    half, side = motion * float(rng.uniform(0.7, 3.0)), float(rng.choice([-1.0, 1.0]))
    if wells_drawn and not linear:  # half: from the middle to a well
        wells = law._replace(stiffness=-0.5 * law.stiffness, cubic=0.5 * law.stiffness / half**2)
        device = replace(device, law=wells, rest=half * side, restart_periods=4.0)
    bench = _bench(rng, device, waves, motion, 0.0 if linear else hardening, unit, "mm")
    bench = replace(bench, white=0.6 * bench.white, flicker=0.8 * bench.white)
    return replace(bench, sensor_gain=float(rng.uniform(0.8, 1.2)), file="mat")
