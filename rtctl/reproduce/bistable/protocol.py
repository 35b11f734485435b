"""The simulated shaker campaign by the paper's protocol: 45 frequencies, ten runs each, 60 s at 10 kHz after 10 s.

A record is a function of its number: it is made when it is looked at, one in memory, and never stored. The base's
acceleration is a sine of 3.81 m/s^2 (standard deviation over runs 0.086); in 23 records, at the four frequencies at
which the paper drops records, the frame answers with a weak tone on the beam's second mode, which the sensor sees then.
Noise: 4 um of white noise on the displacement, a triangulation sensor's, and 0.05 mm/s on the velocity: the filtered
acceleration of small intrawell motions stays readable, as in the paper, and the unfiltered one is noise, as in its
figure 3.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus
from rtctl.reproduce.bistable.models import TRUTH, Beam, SecondMode, model_file
from rtctl.wiring_models import build_simulation

UNITS = {"drive": "m/s^2", "displacement": "mm"}
SEED = 4200
"""Seed of the reported campaign; development used `DEVELOPMENT_SEED`."""
DEVELOPMENT_SEED = 104_100
RATE_HZ = 10_000.0
AMPLITUDE, AMPLITUDE_SPREAD = 3.81, 0.086
NOISE_MM, FRAME_NOISE_MM_S = 4e-3, 0.05
STARTS = ((-12.98, 12.94), (-857.89, 862.38))
"""Ranges of displacement [mm] and velocity [mm/s] from which motions start: the paper's."""
SECOND = SecondMode(gain=0.55, frequency_hz=83.0, damping_ratio=0.002)
"""Second mode: on a clamped beam it is driven 0.55 as much as the first, at six times its frequency."""
TONE = 0.4
"""Amplitude of the frame's response on it [m/s^2]: a tenth of the drive."""
LARGE_ORBIT = (11.5, 200.0)
"""Start of the records with the second mode: their motion goes through both wells where that motion is stable."""


class Setting(NamedTuple):
    """One record before it is made."""

    number: int
    frequency_hz: float
    run: int
    second_mode: bool


class Shaker(NamedTuple):
    """A campaign: its records and how long they are."""

    settings: tuple[Setting, ...]
    record_s: float
    unrecorded_s: float
    seed: int = SEED
    truth: Beam = TRUTH

    @property
    def samples(self) -> int:
        """Number of samples of a record."""
        return round(self.record_s * RATE_HZ)


class Recorded(NamedTuple):
    """One record as the instruments measure it."""

    setting: Setting
    displacement: FloatArray
    """Displacement of the tip [mm] against the frame."""
    frame_velocity: FloatArray
    """Velocity of the frame [mm/s]; the beam is driven by minus its derivative."""
    clean: FloatArray
    """Displacement without noise [mm]."""
    amplitude: float
    """Amplitude of the base's acceleration in this run [m/s^2]."""
    phase: float
    """Phase of the drive at the record's first sample, cos(2 pi f t + phase)."""


_DROPPED = {9.25: 8, 9.75: 4, 10.0: 4, 11.75: 7}
"""Number of records with the second mode by frequency: 23, as many as the paper drops."""


def shaker(*, short: bool, seed: int | None = None) -> Shaker:
    """Return the campaign; `short`: seven frequencies, two runs, 8 s, on the seed of the development."""
    if seed is None:
        seed = DEVELOPMENT_SEED if short else SEED
    frequencies = (
        [7.0, 8.25, 10.25, 11.75, 12.25, 13.75, 16.0] if short else np.arange(7.0, 18.01, 0.25).tolist()
    )
    runs = 2 if short else 10
    settings: list[Setting] = []
    for frequency in frequencies:
        for run in range(runs):
            with_mode = run < _DROPPED.get(frequency, 0)
            settings.append(Setting(len(settings), frequency, run, with_mode))
    return Shaker(tuple(settings), 8.0 if short else 60.0, 10.0, seed)


def record(campaign: Shaker, setting: Setting) -> Recorded:
    """Return the record of `setting`: the truth integrated at the sampling rate, plus the noise of both instruments."""
    rng = np.random.default_rng([campaign.seed, setting.number])
    amplitude = AMPLITUDE + AMPLITUDE_SPREAD * rng.standard_normal()
    phase = rng.uniform(0.0, 2.0 * np.pi)
    start = np.array([rng.uniform(*limits) for limits in STARTS])
    if setting.second_mode:
        start = np.array(LARGE_ORBIT)
        phase = 0.0
    before = round(campaign.unrecorded_s * RATE_HZ)
    t = np.arange(before + campaign.samples) / RATE_HZ
    rate = 2.0 * math.pi * setting.frequency_hz
    angle = rate * t + phase
    drive = amplitude * np.cos(angle)
    frame = -1000.0 * amplitude / rate * np.sin(angle[before:])
    second = SECOND if setting.second_mode else None
    if second is not None:
        tone = 2.0 * math.pi * second.frequency_hz
        drive += TONE * np.cos(tone * t)
        frame -= 1000.0 * TONE / tone * np.sin(tone * t[before:])
    simulation = build_simulation(model_file(campaign.truth, 1.0, second), UNITS, "the truth")
    values = np.array([parameter.value for parameter in simulation.parameters])
    stimulus = Stimulus(
        inputs={"drive": drive},
        holds={"drive": "linear"},
        period_s=1.0 / RATE_HZ,
        peak={"displacement": 15.0},
    )
    moved = simulation.predict(stimulus, values[None], start[None]).outputs["displacement"][0, before:]
    noise = rng.standard_normal((2, campaign.samples))
    return Recorded(
        setting, moved + NOISE_MM * noise[0], frame + FRAME_NOISE_MM_S * noise[1], moved, amplitude,
        float(angle[before] % (2.0 * np.pi)),
    )  # fmt: skip
