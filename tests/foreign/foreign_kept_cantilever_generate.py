"""Writes a data set of a sputtered cantilever; `foreign_generate.py --style sputtered_cantilever` calls it."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
from foreign_common import Array, flicker, record_lines, write_tdms, write_truth
from foreign_device import Effect, Readings
from foreign_grain_generate import staircase_before, told_truth
from foreign_grain_sizes import Shares
from foreign_kept_cantilever_device import EQUATIONS, simulate
from foreign_kept_cantilever_excitations import records
from foreign_kept_cantilever_sizes import hide, noise_shares
from foreign_kept_cantilever_styles import LASER_STEP_V, Bench, draw_bench, stream

COLUMNS = {"current": "AO_source", "resistance": "AI_film", "deflection": "AI_laser"}  # all in V
TIME = "time_us"


def generate(style: str, seed: int, folder: Path, names: tuple[str, ...] | None = ()) -> Path:
    """Write the case to `folder`; `names` are hidden, or what the seed draws if None. Returns the manifest's path."""
    bench = draw_bench(style, seed)
    plan = records(bench, seed)
    hidden, shares = hide(bench, seed, plan, names)
    folder.mkdir(parents=True, exist_ok=True)
    rng, files = stream(style, seed, "noise"), []
    early = staircase_before(stream(style, seed, "staircase"), hidden)
    for name, use, current in plan:
        clean = simulate(bench.device, current, () if use == "identify" and early else hidden)
        files.append((_write(bench, folder / name, as_volts(bench, current, clean, rng)), use))
    manifest = folder / "dataset.toml"
    manifest.write_text(_manifest(bench, seed, files), encoding="utf-8")
    truth = _truth(bench, seed, hidden, shares, "before the effect" if early else "with the effect")
    truth["noise_shares"] = noise_shares(bench, [current for _, use, current in plan if use == "fit"])
    write_truth(folder, truth)
    return manifest


def as_volts(bench: Bench, current: Array, clean: Readings, rng: np.random.Generator) -> dict[str, Array]:
    """What the converters say of one record, with noise and their steps; columns as in the file."""
    n, step = current.size, bench.volts / bench.counts
    ohm = clean.resistance * (1.0 + bench.resistance_flicker * flicker(n, rng))
    film = 1e-3 * bench.sense_mA * (ohm + bench.resistance_noise_ohm * rng.normal(size=n))
    bent = clean.deflection + bench.deflection_noise_um * rng.normal(size=n)
    laser = bench.rest_V - bent / bench.um_per_V
    seen = [
        current / bench.mA_per_V,
        step * np.maximum(np.round(film / step), 1.0),
        LASER_STEP_V * np.round(laser / LASER_STEP_V),
    ]
    return dict(zip(COLUMNS.values(), seen, strict=True))


def _write(bench: Bench, path: Path, columns: dict[str, Array]) -> str:
    """Write one record in the bench's kind of file; returns the file's name."""
    if bench.file == "tdms":
        write_tdms(path.with_suffix(".tdms"), "DAQ", bench.device.period_s, columns)
        return path.with_suffix(".tdms").name
    size = next(iter(columns.values())).size
    table = {TIME: np.round(1e6 * bench.device.period_s * np.arange(size))} | columns
    text = np.column_stack(list(table.values()))
    np.savetxt(path.with_suffix(".csv"), text, "%.10g", ",", header=",".join(table), comments="")
    return path.with_suffix(".csv").name


def _manifest(bench: Bench, seed: int, files: list[tuple[str, str]]) -> str:
    """The manifest's text, in the form of formats.md, sections 1 and 6: volts to mA, ohm and um."""
    signals = {
        "current": ("input", "mA", bench.mA_per_V, 0.0),
        "resistance": ("output", "ohm", 1e3 / bench.sense_mA, 0.0),
        "deflection": ("output", "um", -bench.um_per_V, bench.um_per_V * bench.rest_V),
    }
    lines = ["[dataset]", f'name = "cantilever, wafer {seed}"', 'plant = "vo2"', ""]
    for name, (role, unit, scale, offset) in signals.items():
        lines += [f"[signals.{name}]", f'role = "{role}"', f'unit = "{unit}"', f'column = "{COLUMNS[name]}"']
        lines += [f"scale = {scale:.12g}  # {unit} per V"] + ([f"offset = {offset:.12g}"] if offset else [])
        lines += ['hold = "zero"', ""] if role == "input" else [""]
    time = None if bench.file == "tdms" else (TIME, "us")
    for file, use in files:
        lines += record_lines(file, bench.device.period_s, use, time=time)
    return "\n".join(lines)


def _truth(
    bench: Bench, seed: int, hidden: tuple[Effect, ...], shares: list[Shares], staircase: str
) -> dict[str, object]:
    """What was hidden, and the device; no diagnosis may read it."""
    device = bench.device
    effects = [
        {**asdict(effect), "equation": EQUATIONS[effect.id], "shares": share}
        for effect, share in zip(hidden, shares, strict=True)
    ]
    told = {
        "time_constant_s": device.tau_s,
        "second_share": device.second_share,
        "period_s": device.period_s,
        "ambient_C": device.ambient_C,
        "gain_C_per_mA2": device.gain_C_per_mA2,
        "structure_later_K": device.cells.later,
        "film": device.film._asdict(),
        "deflection_um": device.deflection_um,
        "bimorph_per_K": device.bimorph_per_K,
        "bimorph_hot": device.bimorph_hot,
        "ripple": device.ripple,
        "current_mA": [bench.low_mA, bench.centre_mA, bench.high_mA],
        "hold_samples": bench.hold_samples,
    }
    return told_truth(bench.style, seed, effects, device.convention, staircase, told)
