"""A lab with a sputtered film on a cantilever, kept back for final figures: nobody develops on it.

It runs only where it is asked for (`--style sputtered_cantilever`); all numbers come from a seed.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np
from foreign_common import Array, log_uniform
from foreign_kept_cantilever_device import SECOND_SHARE, CantileverDevice
from foreign_kept_cantilever_motion import Cells, Film
from scipy.special import ndtri
from scipy.stats import qmc

STYLES = ("sputtered_cantilever",)
KIND = 19  # of the streams, so that they are not those of other styles
CELLS = 128
LASER_STEP_V = 20.0 / 2**16  # of the converter behind the triangulator


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """A device with the lab around it: current range, instruments, and the kind of file."""

    style: str
    device: CantileverDevice
    low_mA: float
    high_mA: float
    centre_mA: float  # in the middle of the transition
    hold_samples: int  # of a level of the staircase
    mA_per_V: float  # of the source, whose voltage is in the files
    sense_mA: float  # through the film, whose voltage is in the files
    volts: float  # range of the film's converter
    counts: int  # of that converter in its range
    resistance_noise_ohm: float  # of the amplifier, white
    resistance_flicker: float  # relative, 1/f
    um_per_V: float  # of the triangulator, which sees the beam come nearer: its voltage falls
    rest_V: float  # of the triangulator, for the cold beam
    deflection_noise_um: float
    file: str  # "tdms" | "csv in us"


def stream(style: str, seed: int, what: str) -> np.random.Generator:
    """Random numbers of one purpose, so that an effect does not change the device or the records."""
    purposes = ("device", "records", "effect", "noise", "order", "staircase")
    return np.random.default_rng([KIND, STYLES.index(style), seed, purposes.index(what)])


def draw_bench(style: str, seed: int) -> Bench:
    """The bench of a style and seed."""
    if style not in STYLES:
        raise ValueError(f"style must be one of {', '.join(STYLES)}, got {style!r}")
    return _sputtered_cantilever(stream(style, seed, "device"))


def _sputtered_cantilever(rng: np.random.Generator) -> Bench:
    """100 to 800 Sa/s; a voltage commands the current, and the film's and the triangulator's voltages are written down.

    The film's resistance is Lichtenecker's mean or nearly, behind contacts; its noise is an amplifier's, in ohm.
    """
    ambient, high_mA = float(rng.uniform(20.0, 26.0)), log_uniform(rng, 4.0, 60.0)
    cells = draw_cells(rng)
    metal, deflection = log_uniform(rng, 150.0, 3e3), log_uniform(rng, 15.0, 300.0)
    film = Film(
        semiconductor=metal * log_uniform(rng, 30.0, 200.0),
        activation=float(rng.uniform(2000.0, 3800.0)),
        metal=metal,
        metal_per_K=float(rng.uniform(0.0, 8e-4)),
        contacts=metal * float(rng.uniform(0.05, 0.4)),
        power=float(rng.uniform(0.02, 0.3)),
    )
    period = 1.0 / float(rng.choice([100.0, 200.0, 500.0, 800.0]))
    hottest = float(np.max(cells.up + 1.0 / cells.speed)) + cells.later + float(rng.uniform(1.0, 5.0))
    coldest = max(float(np.min(cells.down)) - float(rng.uniform(1.0, 5.0)), ambient + 5.0)
    centre = 0.5 * float(np.median(cells.up) + np.median(cells.down))
    gain = (hottest - ambient) / high_mA**2
    device = CantileverDevice(
        ambient_C=ambient,
        gain_C_per_mA2=gain,
        tau_s=period * float(rng.uniform(4.0, 11.0)),
        second_share=SECOND_SHARE * float(rng.uniform(0.2, 1.0)),
        period_s=period,
        convention=str(rng.choice(["start", "end"])),
        cells=cells,
        film=film,
        deflection_um=deflection,
        bimorph_per_K=-float(rng.uniform(0.002, 0.006)),
        bimorph_hot=float(rng.uniform(0.7, 1.2)),
        ripple=log_uniform(rng, 2e-4, 1.2e-3),
        ripple_um=deflection * float(rng.uniform(0.15, 0.5)),
    )
    cold_ohm = film.semiconductor * 1.3 + film.contacts
    volts = float(rng.choice([1.0, 2.0, 5.0, 10.0]))
    return Bench(
        style="sputtered_cantilever",
        device=device,
        low_mA=sqrt((coldest - ambient) / gain),
        high_mA=high_mA,
        centre_mA=sqrt((centre - ambient) / gain),
        hold_samples=ceil(float(rng.uniform(6.5, 9.0)) * device.tau_s / period),
        mA_per_V=float(rng.choice([2.0, 5.0, 10.0, 20.0])),
        sense_mA=float(f"{0.6 * volts / cold_ohm * 1e3:.2g}"),
        volts=volts,
        counts=2 ** int(rng.choice([18, 20])),
        resistance_noise_ohm=metal * log_uniform(rng, 3e-4, 2e-3),
        resistance_flicker=log_uniform(rng, 2e-4, 1e-3),
        um_per_V=float(f"{deflection / float(rng.uniform(1.0, 4.0)):.2g}"),
        rest_V=round(float(rng.uniform(4.5, 9.0)), 2),
        deflection_noise_um=deflection * log_uniform(rng, 3e-4, 1.5e-3),
        file=str(rng.choice(["tdms", "tdms", "csv in us"])),
    )


def draw_cells(rng: np.random.Generator) -> Cells:
    """Cells at Sobol's points of the film's distribution.

    Thresholds on heating: a normal with an exponential tail to the hot side or, less often, the cold one. Widths:
    lognormal, wider (or narrower) where the threshold is high; so cooling is broader than heating, and lopsided.
    """
    places = np.clip(qmc.Sobol(5, seed=rng).random(CELLS), 1e-6, 1.0 - 1e-6)
    first, second, third, fourth = ndtri(places[:, :4]).T
    tail = float(rng.choice([1.0, 1.0, -1.0])) * float(rng.uniform(0.4, 2.2))
    up = float(rng.uniform(63.0, 71.0)) + float(rng.uniform(1.0, 2.6)) * first - tail * np.log(places[:, 4])
    together = float(rng.uniform(-0.2, 0.75))
    score = (up - up.mean()) / up.std()
    mixed = together * score + sqrt(1.0 - together**2) * second
    width = float(rng.uniform(5.5, 10.5)) * np.exp(float(rng.uniform(0.1, 0.28)) * mixed)
    front = np.exp(rng.uniform(np.log(0.25), np.log(1.2)) + 0.3 * fourth)
    area = np.exp(0.6 * third)
    place = np.exp(float(rng.uniform(0.0, 0.5)) * fourth + float(rng.uniform(-0.25, 0.25)) * score)
    return Cells(
        up=up,
        down=up - width,
        speed=1.0 / front,
        electrical=area / area.sum(),
        structural=area * place / np.sum(area * place),
        later=float(rng.uniform(-0.8, 1.6)),
    )


def shown(bench: Bench, degrees: Array) -> Array:
    """Currents [mA] that bring the film to these temperatures [°C]."""
    rise = np.maximum(degrees - bench.device.ambient_C, 0.0)
    return np.asarray(np.sqrt(rise / bench.device.gain_C_per_mA2))
