"""A lab with a bar on a torsion fibre, kept back for final figures: nobody develops on it.

It runs only where it is asked for (`--style torsion_balance`); all numbers come from a seed. In the law the angle is in
rad; the files have it in mrad or degrees, as counts of the autocollimator's electronics.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from foreign_common import Array, log_uniform
from foreign_kept_torsion_device import simulate
from foreign_oscillator_device import Device, Record, natural_square
from foreign_oscillator_excitations import unit
from foreign_oscillator_motion import Law
from foreign_oscillator_styles import KEPT as STYLES
from foreign_oscillator_styles import with_user
from foreign_response_styles import ResponseBench
from scipy.signal import max_len_seq

KIND = 17  # of the streams, so that they are not those of other styles
DEGREES = 180.0 / np.pi


@dataclass(frozen=True, slots=True, kw_only=True)
class TorsionBench(ResponseBench):
    """A bench whose noise is the electronics' (`white`) and that of the air in the light's path (`flicker`)."""

    air_samples: float  # correlation time of the air
    zero: float  # reading of the bar at rest that the electronics had, in the file's unit, and the manifest takes away


def stream(style: str, seed: int, what: str) -> np.random.Generator:
    """Random numbers of one purpose, so that an effect does not change the device or the records."""
    purposes = ("device", "records", "effect", "noise", "user", "values")
    return np.random.default_rng([KIND, STYLES.index(style), seed, purposes.index(what)])


def draw_bench(style: str, seed: int, linear: bool = False) -> TorsionBench:
    """The bench of a style and seed; `linear`: its fibre is, and its user's model has no cubic stiffness."""
    if style not in STYLES:
        raise ValueError(f"style must be one of {', '.join(STYLES)}, got {style!r}")
    bench = _torsion_balance(stream(style, seed, "device"), stream(style, seed, "records"), linear)
    return with_user(bench, stream(style, seed, "user"), linear)


def _torsion_balance(rng: np.random.Generator, waves_rng: np.random.Generator, linear: bool) -> TorsionBench:
    """0.05 to 25 Hz, 18 to 45 samples a period; many short records of unequal length, Parquet or Arrow.

    The torque is a coil's or that of plates (V, mA, or uN*m), either way round; a converter holds it, or a
    generator draws straight lines. A third of the benches read at the ends of the periods.
    """
    natural, f = log_uniform(rng, 0.05, 25.0), 1.0 / float(rng.uniform(18.0, 45.0))
    quality, w = log_uniform(rng, 6.0, 120.0), 2.0 * np.pi * natural
    device = Device(
        law=Law(damping=w / quality, stiffness=w * w, cubic=0.0, gain=w * w),
        period_s=1.0 / float(f"{natural / f:.3g}"),
        hold=str(rng.choice(["zero", "zero", "linear"])),
        read_at_end=bool(rng.random() < 0.35),
    )
    f = natural * device.period_s
    kinds = ["kicks", "binary", "modulated", "glide", "stairs", "binary", "kicks", "glide"]
    waves: list[tuple[str, Array]] = []
    for kind in [
        *kinds[: int(rng.integers(4, 8))],
        "binary",
        str(rng.choice(["kicks", "modulated", "stairs"])),
    ]:
        samples = int(np.clip(float(waves_rng.uniform(45.0, 90.0)) / f, 1200, 3600))
        waves.append((kind, WAVES[kind](samples, f, quality, waves_rng)))
    hardening = float(rng.choice([0.0, 0.0, log_uniform(rng, 0.03, 0.35), -log_uniform(rng, 0.02, 0.1)]))
    motion, drive_unit = log_uniform(rng, 0.012, 0.5), str(rng.choice(["V", "mA", "uN*m"]))
    in_degrees = motion > 0.1
    to_unit = DEGREES if in_degrees else 1e3
    return _scaled(
        rng,
        device,
        waves,
        wanted=motion,
        hardening=0.0 if linear else hardening,
        displacement_unit="rad",
        drive_unit=drive_unit,
        white=log_uniform(rng, 6e-4, 5e-3),
        flicker=log_uniform(rng, 3e-4, 2e-3),
        bits=int(rng.integers(15, 19)),
        file=str(rng.choice(["parquet", "parquet in one", "arrow"])),
        response_unit="deg" if in_degrees else "mrad",
        to_unit=to_unit,
        name_of_drive={"V": "U_coil", "mA": "I_coil", "uN*m": "torque"}[drive_unit],
        name_of_response="angle_counts",
        air_samples=float(rng.uniform(2.0, 12.0)),
        zero=round(float(rng.normal(0.0, 3.0)) * motion * to_unit, 3),
    )


def _scaled(
    rng: np.random.Generator,
    device: Device,
    waves: list[tuple[str, Array]],
    *,
    wanted: float,
    hardening: float,
    **others: object,
) -> TorsionBench:
    """The bench whose angle has RMS `wanted` while its fibre is straight; `hardening` as cubic over linear torque."""
    tests, said = int(rng.choice([1, 2, 2])), str(rng.choice(["fit", "fit", ""]))
    level = log_uniform(rng, 0.05, 20.0)
    records = [
        Record(
            name=f"{k + 1:02d}_{name}",
            use="test" if k >= len(waves) - tests else said,
            drive=level * wave,
            seed=int(rng.integers(1 << 30)),
        )
        for k, (name, wave) in enumerate(waves)
    ]
    loud = [
        float(np.std(simulate(device, record).angle)) / float(rng.uniform(0.7, 1.3)) for record in records
    ]
    middle = float(np.median(loud))  # every run uses about the same part of the range
    records = [replace(r, drive=r.drive * middle / own) for r, own in zip(records, loud, strict=True)]
    angles = np.concatenate([simulate(device, record).angle for record in records])
    scale = wanted / float(np.std(angles))
    law = device.law._replace(gain=scale * device.law.gain * float(rng.choice([1.0, -1.0])))
    law = law._replace(cubic=hardening * law.stiffness / float(scale * np.max(np.abs(angles))) ** 2)
    device = replace(device, law=law)
    angles = np.concatenate([simulate(device, record).angle for record in records])
    rms, largest = float(np.std(angles)), float(np.max(np.abs(angles)))
    return TorsionBench(
        style="torsion_balance",
        device=device,
        records=tuple(records),
        quality=float(np.sqrt(natural_square(law)) / law.damping),
        rms=rms,
        largest=largest,
        largest_drive=float(max(np.max(np.abs(record.drive)) for record in records)),
        response="displacement",
        reading_rms=rms,
        reading_largest=largest,
        sensor_gain=1.0,
        user="",
        cubic_known=False,
        velocity=False,
        **others,  # type: ignore[arg-type]
    )


def _kicks(samples: int, f: float, quality: float, rng: np.random.Generator) -> Array:
    """Rectangular kicks of 0.1 to 0.5 periods and either direction, each with a decay behind it."""
    wave, place = np.zeros(samples), round(0.6 / f)
    while place < samples - 4:
        length = max(round(float(rng.uniform(0.1, 0.5)) / f), 2)
        wave[place : place + length] = float(rng.choice([-1.0, 1.0])) * float(rng.uniform(0.3, 1.0))
        place += length + round(float(rng.uniform(0.3, 1.0)) * float(np.clip(0.6 * quality, 4.0, 16.0)) / f)
    return unit(wave)


def _binary(samples: int, f: float, quality: float, rng: np.random.Generator) -> Array:
    """A maximum-length sequence of two levels; its clock is 0.12 to 0.4 natural periods."""
    clock = max(round(float(rng.uniform(0.12, 0.4)) / f), 1)
    bits, _ = max_len_seq(10, state=rng.permutation([1] * 5 + [0] * 5), length=-(-samples // clock))
    wave = np.repeat(2.0 * bits - 1.0, clock)[:samples]
    wave[: round(0.5 / f)] = 0.0
    return unit(wave)


def _modulated(samples: int, f: float, quality: float, rng: np.random.Generator) -> Array:
    """A torque that is switched on and off, 4 to 8 times at each of several rates, as calibrations are made."""
    wave, place = np.zeros(samples), round(0.4 / f)
    while place < samples:
        half = max(round(0.5 / (f * float(rng.uniform(0.35, 1.7)))), 1)
        switched = np.tile(np.repeat([1.0, 0.0], half), int(rng.integers(4, 9)))
        part = switched[: samples - place] * float(rng.uniform(0.4, 1.0)) * float(rng.choice([-1.0, 1.0]))
        wave[place : place + part.size] = part
        place += switched.size + round(float(rng.uniform(0.5, 3.0)) / f)
    return unit(wave)


def _glide(samples: int, f: float, quality: float, rng: np.random.Generator) -> Array:
    """A sine that glides through the resonance up and down again, once or twice."""
    low, high = f * np.array([rng.uniform(0.3, 0.6), rng.uniform(1.5, 2.3)])
    place = (np.linspace(0.0, int(rng.integers(1, 3)), samples) + float(rng.choice([0.0, 0.5]))) % 1.0
    rate = low + (high - low) * (1.0 - np.abs(2.0 * place - 1.0))
    return unit(np.sin(2.0 * np.pi * np.cumsum(rate)))


def _stairs(samples: int, f: float, quality: float, rng: np.random.Generator) -> Array:
    """A sine near the resonance that grows in four to six stairs, with silence behind the last."""
    tone = f * (1.0 + float(rng.normal(0.0, 1.0)) / min(quality, 30.0))
    stairs = int(rng.integers(4, 7))
    heights = np.append(np.linspace(1.0, float(stairs), stairs), 0.0)
    return unit(
        np.repeat(heights, -(-samples // heights.size))[:samples]
        * np.sin(2.0 * np.pi * tone * np.arange(samples))
    )


WAVES = {"kicks": _kicks, "binary": _binary, "modulated": _modulated, "glide": _glide, "stairs": _stairs}
