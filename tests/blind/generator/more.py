"""One more record of a case's own device, by the same sensors: what an experiment that somebody proposes would give.

The case is drawn again from its seed, so nothing has to be kept; the new record's file lies beside the old ones.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from . import noise as sensor_noise
from .excitations import fade
from .options import Options
from .oscillator import draw_oscillator
from .plan import Input, simulate
from .vo2.case import draw_vo2, measure
from .vo2.options import Vo2Options
from .vo2.plant import Input as Vo2Input
from .vo2.plant import simulate as simulate_vo2

FloatArray = NDArray[np.float64]
NUMBER = 63
"""Of the first new record, the next one counts down: no drawn case has so many, and each file has its own phase of the
mains."""
NOISE = 9
"""Sets its noise apart from all that was drawn."""


def more(
    seed: int, folder: Path, drive: FloatArray, period_s: float, plant: str = "oscillator", times: int = 1,
    **overrides: Any,
) -> list[str]:  # fmt: skip
    """Drive the device of this seed by `drive` (n,) in the manifest's unit, one level a `period_s`; so many records are
    added to the manifest in `folder` as ones to fit. Returns the names of their files.

    `seed`, `plant` and `overrides` as `generate` had them. The drive acts as in the other records: through the same
    hold, and what is band-limited is smoothed as they are. Noise has the same colour in time: a slower record has one
    in so many of its samples. Raises ValueError for a plant or a drive that is none, LeftDeviceError where the motion
    leaves the device.
    """
    if plant not in PLANTS:
        raise ValueError(f"no plant {plant!r}; there are {', '.join(PLANTS)}")
    levels = np.asarray(drive, dtype=float)
    if levels.ndim != 1 or levels.size < 2 or not np.isfinite(levels).all() or not period_s > 0.0:
        raise ValueError(
            f"drive is finite levels (n,) and period_s > 0 s; got {levels.shape}, {period_s!r} s"
        )
    path = folder / "dataset.toml"
    manifest = tomllib.loads(path.read_text(encoding="utf-8"))
    before = sum(record["file"].startswith("more") for record in manifest["records"])
    names = []
    for number, signals in enumerate(
        PLANTS[plant](seed, levels, period_s, range(before, before + times), overrides)
    ):
        names.append(f"more{before + number}.npz")
        columns = {manifest["signals"][key].get("column", key): values for key, values in signals.items()}
        np.savez(folder / names[-1], **columns)
        table = {"file": names[-1], "sample_rate_hz": 1.0 / period_s, "use": "fit"}
        manifest["records"].append(table | {"conditions": {"excitation": "proposed"}})
    path.write_text(tomli_w.dumps(manifest), encoding="utf-8")
    return names


def _oscillator(
    seed: int, levels: FloatArray, period_s: float, which: range, overrides: dict[str, Any]
) -> Iterator[dict[str, FloatArray]]:
    drawn, _ = draw_oscillator(seed, Options(**overrides))
    samples_a_period = 1.0 / (drawn.device.f0_Hz * period_s)
    if drawn.device.manifest_hold == "band-limited":
        levels = sosfiltfilt(butter(6, 0.5, output="sos"), levels * fade(levels.size, samples_a_period))
    plan = replace(drawn.plan, samples_a_period=samples_a_period)
    every = max(1, round(drawn.plan.samples_a_period / samples_a_period))
    for number in (NUMBER - k for k in which):
        record = Input(
            number=number, excitation="proposed", use="fit", drive=levels / drawn.drive_scale, displaced=0.0,
            file_number=number,
        )  # fmt: skip
        clean, _ = simulate(plan, record)
        rng = np.random.default_rng([seed, number, NOISE])
        read = sensor_noise.add_noise(
            rng, clean, drawn.noise, drawn.noise_rms, drawn.colour, like=drawn.clean[0].size, every=every
        )
        yield {"drive": levels, "displacement": read * drawn.device.length}


def _vo2(
    seed: int, levels: FloatArray, period_s: float, which: range, overrides: dict[str, Any]
) -> Iterator[dict[str, FloatArray]]:
    drawn, _ = draw_vo2(seed, Vo2Options(**overrides))
    for k in which:
        record = Vo2Input(
            number=NUMBER - k, position=len(drawn.inputs) + k, use="fit", excitation="proposed", current=levels,
            rate_Hz=1.0 / period_s,
        )  # fmt: skip
        rng = np.random.default_rng([seed, NUMBER - k, NOISE])
        yield {"current": levels} | measure(
            rng, drawn.noises, drawn.colours, simulate_vo2(drawn.plant, record), drawn.fits[0].current.size
        )


PLANTS = {"oscillator": _oscillator, "vo2": _vo2}
