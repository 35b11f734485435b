"""Two labs with oscillators: a panel with an accelerometer on it, and the cantilever of an atomic-force microscope.

They run only where they are asked for (`--style`), not in turn with `foreign_oscillator_styles.STYLES`; all numbers
come from a seed. In the law z is in mm (panel) or nm (cantilever).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from foreign_common import Array, log_uniform
from foreign_oscillator_device import Device, Record, natural_square
from foreign_oscillator_excitations import band_noise, sweep, unit
from foreign_oscillator_motion import Law
from foreign_oscillator_styles import LATER as STYLES
from foreign_oscillator_styles import Bench, with_user
from foreign_response_device import simulate

KIND = 13  # of the streams, so that they are not those of other styles
SHIFT = {"aerospace_panel": 0, "afm_cantilever": 1}
STANDARD_GRAVITY = 9806.65  # mm/s^2


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseBench(Bench):
    """A bench with another sensor: what it reads, in which unit, and how large its readings are (in the law's unit)."""

    response: str  # "displacement" | "acceleration"
    response_unit: str
    to_unit: float  # of the file, from the law's unit
    reading_rms: float
    reading_largest: float
    name_of_drive: str
    name_of_response: str


def stream(style: str, seed: int, what: str) -> np.random.Generator:
    """Random numbers of one purpose, so that an effect does not change the device or the records."""
    purposes = ("device", "records", "effect", "noise", "user", "values")
    return np.random.default_rng([KIND, SHIFT[style], seed, purposes.index(what)])


def draw_bench(style: str, seed: int, linear: bool = False) -> ResponseBench:
    """The bench of a style and seed; `linear`: its spring is, and its user's model has no cubic stiffness."""
    if style not in STYLES:
        raise ValueError(f"style must be one of {', '.join(STYLES)}, got {style!r}")
    draw = {"aerospace_panel": _aerospace_panel, "afm_cantilever": _afm_cantilever}[style]
    bench = draw(stream(style, seed, "device"), stream(style, seed, "records"), linear)
    return with_user(bench, stream(style, seed, "user"), linear)


def _aerospace_panel(rng: np.random.Generator, waves_rng: np.random.Generator, linear: bool) -> ResponseBench:
    """50 to 400 Hz; shaker with a force cell (N), accelerometer (m/s^2 or g), UFF; pulses like a hammer's too."""
    natural = log_uniform(rng, 50.0, 400.0)
    rate = 2560.0 if natural < 150.0 else 5120.0
    f, quality = natural / rate, log_uniform(rng, 12.0, 90.0)
    kilograms, level_g = log_uniform(rng, 0.4, 8.0), log_uniform(rng, 0.2, 5.0)
    w = 2.0 * np.pi * natural
    law = Law(damping=w / quality, stiffness=w * w, cubic=0.0, gain=1e3 / kilograms)
    hold = str(rng.choice(["band-limited", "band-limited", "linear"]))
    device = Device(law=law, period_s=1.0 / rate, hold=hold)
    samples = int(rng.choice([5120, 7680, 10240]))
    kinds = ["random", "sweep", "pulses", "levels", "sweep"][: int(rng.integers(3, 6))]
    ends = np.array([0.35 * f, min(2.5 * f, 0.35)])
    waves: list[tuple[str, Array]] = []
    for kind in [*kinds, str(rng.choice(["random", "pulses"]))]:
        low, high = ends * waves_rng.uniform(0.9, 1.1, 2)
        if kind == "random":
            waves.append((kind, _faded(band_noise(samples, 0.3 * f, min(2.8 * f, 0.4), waves_rng))))
        elif kind == "sweep":
            up = bool(waves_rng.random() < 0.5)
            waves.append((kind, sweep(samples, *((low, high) if up else (high, low)), True)))
        elif kind == "pulses":
            waves.append((kind, _pulses(samples, f, quality, waves_rng)))
        else:
            waves.append((kind, _levels(samples, f, waves_rng)))
    hardening = float(rng.choice([0.0, 0.0, log_uniform(rng, 0.03, 0.4), -log_uniform(rng, 0.02, 0.1)]))
    unit_read = str(rng.choice(["m/s^2", "m/s^2", "g_0"]))
    return _scaled(
        rng,
        device,
        waves,
        wanted=level_g * STANDARD_GRAVITY,
        level=None,
        hardening=0.0 if linear else hardening,
        style="aerospace_panel",
        displacement_unit="mm",
        drive_unit="N",
        white=log_uniform(rng, 8e-4, 5e-3),
        flicker=log_uniform(rng, 3e-4, 2e-3),
        bits=0,
        sensor_gain=1.0,
        file=str(rng.choice(["uff", "uff binary"])),
        response="acceleration",
        response_unit=unit_read,
        to_unit=1e-3 if unit_read == "m/s^2" else 1.0 / STANDARD_GRAVITY,
        name_of_drive="FORCE 1Z+",
        name_of_response="ACC 7Z+",
    )


def _afm_cantilever(rng: np.random.Generator, waves_rng: np.random.Generator, linear: bool) -> ResponseBench:
    """12 to 350 kHz, nm from a photodiode of 13 to 15 bits with 1/f noise; chirps, bursts with ring-down, two tones.

    The dither piezo's voltage is that of a converter that holds; half of the benches read at the ends of its periods.
    """
    natural, f = log_uniform(rng, 12e3, 350e3), 1.0 / float(rng.uniform(10.0, 22.0))
    quality = log_uniform(rng, 50.0, 350.0)
    w = 2.0 * np.pi * natural
    device = Device(
        law=Law(damping=w / quality, stiffness=w * w, cubic=0.0, gain=w * w),
        period_s=1.0 / float(f"{natural / f:.4g}"),
        hold="zero",
        read_at_end=bool(rng.random() < 0.5),
    )
    samples = int(np.clip(2.5 * quality / f, 5000, 11000))
    waves: list[tuple[str, Array]] = []
    kinds = ["chirp", "ringdown", "tones", "chirp", "ringdown"][: int(rng.integers(3, 6))]
    for kind in [*kinds, str(rng.choice(["tones", "ringdown", "chirp"]))]:
        if kind == "chirp":
            wide = float(waves_rng.uniform(0.06, 0.35)) * float(waves_rng.choice([-1.0, 1.0]))
            waves.append((kind, sweep(samples, f * (1.0 - wide), f * (1.0 + wide), False)))
        elif kind == "ringdown":
            waves.append((kind, _ringdown(samples, f, quality, waves_rng)))
        else:
            waves.append((kind, _tones(samples, f, quality, waves_rng)))
    hardening = float(rng.choice([0.0, 0.0, 0.0, log_uniform(rng, 0.01, 0.1)]))
    return _scaled(
        rng,
        device,
        waves,
        wanted=log_uniform(rng, 2.0, 80.0),
        level=log_uniform(rng, 0.02, 3.0),
        hardening=0.0 if linear else hardening,
        style="afm_cantilever",
        displacement_unit="nm",
        drive_unit="V",
        white=log_uniform(rng, 1e-3, 8e-3),
        flicker=log_uniform(rng, 3e-4, 3e-3),
        bits=int(rng.integers(13, 16)),
        sensor_gain=float(rng.uniform(0.85, 1.15)),
        file=str(rng.choice(["tdms", "h5"])),
        response="displacement",
        response_unit="nm",
        to_unit=1.0,
        name_of_drive="dither",
        name_of_response="deflection",
    )


def _scaled(
    rng: np.random.Generator,
    device: Device,
    waves: list[tuple[str, Array]],
    *,
    wanted: float,
    level: float | None,
    hardening: float,
    **others: object,
) -> ResponseBench:
    """The bench whose readings have RMS `wanted` while its spring is straight; `level`: RMS of the drive, or as needed.

    `hardening`: cubic over linear force at the largest motion.
    """
    response, law = str(others["response"]), device.law
    tests = int(rng.choice([1, 1, 2]))
    said = str(rng.choice(["fit", "fit", ""]))
    records = [
        Record(
            name=f"{name}_{k + 1}",
            use="test" if k >= len(waves) - tests else said,
            drive=wave,
            seed=int(rng.integers(1 << 30)),
        )
        for k, (name, wave) in enumerate(waves)
    ]
    seen = [simulate(device, record, response) for record in records]
    scale = wanted / np.sqrt(np.mean(np.concatenate([r.reading for r in seen]) ** 2))
    if level is None:
        level = scale
    else:
        law = law._replace(gain=float(scale * law.gain / level))
    largest = float(scale * max(np.max(np.abs(r.motion)) for r in seen))
    law = law._replace(cubic=float(hardening * law.stiffness / largest**2))
    device = replace(device, law=law)
    records = [replace(record, drive=level * record.drive) for record in records]
    seen = [simulate(device, record, response) for record in records]
    readings, motion = np.concatenate([r.reading for r in seen]), np.concatenate([r.motion for r in seen])
    return ResponseBench(
        device=device,
        records=tuple(records),
        quality=float(np.sqrt(natural_square(law)) / law.damping),
        rms=float(np.std(motion)),
        largest=float(np.max(np.abs(motion))),
        largest_drive=float(max(np.max(np.abs(record.drive)) for record in records)),
        reading_rms=float(np.std(readings)),
        reading_largest=float(np.max(np.abs(readings))),
        user="",
        cubic_known=False,
        velocity=False,
        **others,  # type: ignore[arg-type]
    )


def _faded(wave: Array) -> Array:
    """The wave with a soft start and end."""
    edge = np.minimum(np.arange(wave.size), np.arange(wave.size)[::-1]) / (0.05 * wave.size)
    return unit(wave * np.sin(0.5 * np.pi * np.minimum(edge, 1.0)) ** 2)


def _pulses(samples: int, f: float, quality: float, rng: np.random.Generator) -> Array:
    """Half sines like a hammer's, 0.25 to 0.6 natural periods long, some Q/2 periods apart, of either direction."""
    wave, place = np.zeros(samples), round(0.5 / f)
    while True:
        length = max(round(float(rng.uniform(0.25, 0.6)) / f), 4)
        if place + length >= samples:
            return unit(wave)
        top = float(rng.choice([-1.0, 1.0])) * float(rng.uniform(0.4, 1.0))
        wave[place : place + length] += top * np.sin(np.pi * np.arange(length) / length)
        place += round(max(0.5 * quality, 8.0) * float(rng.uniform(0.7, 1.6)) / f)


def _levels(samples: int, f: float, rng: np.random.Generator) -> Array:
    """Band noise about the resonance in four levels, each louder than the one before."""
    noise = band_noise(samples, 0.5 * f, 1.8 * f, rng)
    loud = np.repeat([0.3, 0.7, 1.3, 2.0], -(-samples // 4))[:samples]
    soft = np.convolve(loud, np.ones(161) / 161.0, "same")
    return _faded(noise * soft)


def _ringdown(samples: int, f: float, quality: float, rng: np.random.Generator) -> Array:
    """Bursts near the resonance, each followed by silence of about Q/3 periods."""
    wave, place = np.zeros(samples), 0
    while place < samples:
        on, off = np.round(np.array([0.25, 0.35]) * quality * rng.uniform(0.6, 1.6, 2) / f).astype(int) + 20
        tone = f * (1.0 + float(rng.normal(0.0, 1.5)) / quality)
        time = np.arange(min(on, samples - place))
        wave[place : place + time.size] = float(rng.uniform(0.3, 1.0)) * np.sin(2.0 * np.pi * tone * time)
        place += on + off
    return unit(wave)


def _tones(samples: int, f: float, quality: float, rng: np.random.Generator) -> Array:
    """Two tones a linewidth or two apart (intermodulation), and a weak third below."""
    time = np.arange(samples)
    beside = float(rng.uniform(0.6, 2.5)) * f / quality
    tones = np.array([f - 0.5 * beside, f + 0.5 * beside, float(rng.uniform(0.3, 0.8)) * f])
    sizes = np.array([1.0, float(rng.uniform(0.4, 1.0)), 2.0])
    waves = np.sin(2.0 * np.pi * (np.outer(time, tones) + rng.random(3))) @ sizes
    return _faded(waves)
