"""Writes a data set of a sputtered cantilever; `foreign_generate.py --style sputtered_cantilever` calls it."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
from foreign_common import Array, flicker
from foreign_device import Effect, Readings
from foreign_grain_sizes import AT_REST, SMALLEST
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
    rng, early, files = stream(style, seed, "noise"), staircase_before(style, seed, hidden), []
    for name, use, current in plan:
        clean = simulate(bench.device, current, () if use == "identify" and early else hidden)
        files.append((_write(bench, folder / name, as_volts(bench, current, clean, rng)), use))
    manifest = folder / "dataset.toml"
    manifest.write_text(_manifest(bench, seed, files), encoding="utf-8")
    truth = _truth(bench, seed, hidden, shares, "before the effect" if early else "with the effect")
    truth["noise_shares"] = noise_shares(bench, [current for _, use, current in plan if use == "fit"])
    (folder / "truth.json").write_text(json.dumps(truth, indent=2) + "\n", encoding="utf-8")
    return manifest


def staircase_before(style: str, seed: int, hidden: tuple[Effect, ...]) -> bool:
    """Whether the staircase was recorded before the effect began: always where it would hold all of the effect."""
    drawn = bool(stream(style, seed, "staircase").random() < 0.5)
    return drawn or any(effect.id in AT_REST for effect in hidden)


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
        from nptdms import ChannelObject, TdmsWriter  # an extra of the program; only these files need it

        properties = {"wf_increment": bench.device.period_s, "wf_start_offset": 0.0}
        with TdmsWriter(path.with_suffix(".tdms")) as file:
            file.write_segment([ChannelObject("DAQ", name, x, properties) for name, x in columns.items()])
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
    timed = bench.file != "tdms"
    for file, use in files:
        lines += ["[[records]]", f'file = "{file}"']
        lines += [f'time = "{TIME}"', 'time_unit = "us"'] if timed else []
        lines += [] if timed else [f"sample_rate_hz = {1.0 / bench.device.period_s:.9g}"]
        lines += [f'use = "{use}"', ""]
    return "\n".join(lines)


def _truth(
    bench: Bench, seed: int, hidden: tuple[Effect, ...], shares: list[dict[str, float]], staircase: str
) -> dict[str, object]:
    """What was hidden, and the device; no diagnosis may read it."""
    device, first = bench.device, hidden[0] if hidden else None
    effects = [
        {**asdict(effect), "equation": EQUATIONS[effect.id], "shares": share}
        for effect, share in zip(hidden, shares, strict=True)
    ]
    return {
        "style": bench.style,
        "seed": seed,
        "effect": first.id if first else None,
        "second": hidden[1].id if len(hidden) > 1 else None,
        "equation": EQUATIONS[first.id] if first else None,
        "size": first.size if first else 0.0,
        "unit": first.unit if first else None,
        "values": first.values if first else {},
        "effects": effects,
        "share": min((max(share.values()) for share in shares), default=0.0),
        "shares": shares[0] if shares else {},
        "share_is": f"RMS left by a re-fit of time constant and gain over the standard deviation, >= {SMALLEST}",
        "convention": device.convention,
        "staircase": staircase,
        "groups": [staircase, f"read at the {device.convention}"],
        "device": {
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
        },
    }
