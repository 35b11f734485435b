"""Writes a data set of a film of grains; `foreign_generate.py --style nanoribbon` (or `buckled_bridge`) calls it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from foreign_common import Array, flicker, record_lines, write_truth
from foreign_device import Effect, Readings
from foreign_grain_device import EQUATIONS, simulate
from foreign_grain_excitations import records
from foreign_grain_sizes import AT_REST, SMALLEST, Plan, Shares, hide, noise_shares
from foreign_grain_styles import Bench, draw_bench, stream
from scipy.io import savemat

FACTOR = {"uA": 1e3, "A": 1e-3, "ohm": 1.0, "kohm": 1e-3, "nm": 1e3, "mm": 1e-3}  # from mA, ohm and um
Written = list[tuple[str, str, list[int]]]  # file, use, rows of the file (or none)


def generate(style: str, seed: int, folder: Path, names: tuple[str, ...] | None = ()) -> Path:
    """Write the case to `folder`; `names` are hidden, or what the seed draws if None. Returns the manifest's path."""
    bench = draw_bench(style, seed)
    plan = records(bench, seed)
    hidden, shares = hide(bench, seed, plan, names)
    folder.mkdir(parents=True, exist_ok=True)
    rng, readings = stream(style, seed, "noise"), []
    early = staircase_before(stream(style, seed, "staircase"), hidden)
    for _, use, current in plan:
        clean = simulate(bench.device, current, () if use == "identify" and early else hidden)
        readings.append(with_instruments(bench, clean, rng))
    written = _write(bench, folder, plan, readings)
    manifest = folder / "dataset.toml"
    manifest.write_text(_manifest(bench, seed, written), encoding="utf-8")
    truth = _truth(bench, seed, hidden, shares, "before the effect" if early else "with the effect")
    truth["noise_shares"] = noise_shares(bench, [current for _, use, current in plan if use == "fit"])
    write_truth(folder, truth)
    return manifest


def staircase_before(rng: np.random.Generator, hidden: tuple[Effect, ...]) -> bool:
    """Whether the staircase was recorded before the effect began: always where it would hold all of the effect."""
    drawn = bool(rng.random() < 0.5)
    return drawn or any(effect.id in AT_REST for effect in hidden)


def with_instruments(bench: Bench, readings: Readings, rng: np.random.Generator) -> Readings:
    """Readings with the noise of the bench and the steps of its instruments, in ohm and um."""
    n = readings.resistance.size
    noise = bench.resistance_noise * rng.normal(size=n) + bench.resistance_flicker * flicker(n, rng)
    resistance = readings.resistance * (1.0 + noise)
    ranges = np.array(bench.ranges_ohm)
    step = ranges[np.minimum(np.searchsorted(ranges, resistance), ranges.size - 1)] / bench.counts
    deflection = readings.deflection + bench.deflection_noise_um * rng.normal(size=n)
    deflection = deflection + bench.deflection_flicker_um * flicker(n, rng)
    steps = bench.deflection_step_um
    return readings._replace(
        resistance=step * np.maximum(np.round(resistance / step), 1.0),
        deflection=steps * np.round(deflection / steps),
    )


def _write(bench: Bench, folder: Path, plan: Plan, readings: list[Readings]) -> Written:
    """Write the records in the bench's kind of file, each in its own or all in one."""
    written: Written = []
    tables = []
    for (_, _, current), reading in zip(plan, readings, strict=True):
        table = {
            bench.names["current"]: current * FACTOR[bench.current_unit],
            bench.names["resistance"]: reading.resistance * FACTOR[bench.resistance_unit],
            bench.names["deflection"]: reading.deflection * FACTOR[bench.deflection_unit],
        }
        if bench.file.startswith("h5"):  # the converter's counts; the manifest has their scale
            counts = np.round(reading.deflection / bench.deflection_step_um)
            table[bench.names["deflection"]] = counts.astype(np.int32)
        tables.append(table)
    if bench.file == "h5 in one":
        _write_h5(folder / "run.h5", {k: np.concatenate([t[k] for t in tables]) for k in tables[0]})
        ends = np.cumsum([current.size for _, _, current in plan]).tolist()
        for (_, use, current), end in zip(plan, ends, strict=True):
            written.append(("run.h5", use, [end - current.size, end]))
        return written
    for (name, use, current), table in zip(plan, tables, strict=True):
        if bench.file == "h5":
            path = folder / f"{name}.h5"
            _write_h5(path, table)
        elif bench.file == "mat":
            path = folder / f"{name}.mat"
            savemat(path, {key: column[:, None] for key, column in table.items()})
        else:
            path = folder / f"{name}.csv"
            clock = {"Zeit": 1e3 * bench.device.period_s * np.arange(current.size)}
            _write_commas(path, clock | table)
        written.append((path.name, use, []))
    return written


def _write_h5(path: Path, table: dict[str, Array]) -> None:
    import h5py  # an extra of the program; only these files need it

    with h5py.File(path, "w", track_order=True) as file:
        for name, column in table.items():
            file.create_dataset(name, data=column, track_times=False)


def _write_commas(path: Path, table: dict[str, Array]) -> None:
    rows = [";".join(table)]
    for row in zip(*(column.tolist() for column in table.values()), strict=True):
        rows.append(";".join(f"{value:.8g}" for value in row).replace(".", ","))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def _manifest(bench: Bench, seed: int, written: Written) -> str:
    """The manifest's text, in the form of formats.md, sections 1 and 6."""
    units = (bench.current_unit, bench.resistance_unit, bench.deflection_unit)
    lines = ["[dataset]", f'name = "{bench.style.replace("_", " ")} {seed}"', 'plant = "vo2"', ""]
    for (signal, column), unit in zip(bench.names.items(), units, strict=True):
        role = "input" if signal == "current" else "output"
        lines += [f"[signals.{signal}]", f'role = "{role}"', f'unit = "{unit}"', f'column = "{column}"']
        lines += ['hold = "zero"'] if role == "input" else []
        if signal == "deflection" and bench.file.startswith("h5"):
            lines.append(f"scale = {bench.deflection_step_um * FACTOR[unit]:.6g}  # {unit} a count")
        lines.append("")
    time = ("Zeit", "ms") if bench.file == "csv with commas" else None
    for file, use, rows in written:
        lines += record_lines(file, bench.device.period_s, use, rows, time)
    return "\n".join(lines)


def _truth(
    bench: Bench, seed: int, hidden: tuple[Effect, ...], shares: list[Shares], staircase: str
) -> dict[str, object]:
    """What was hidden, and the device; no diagnosis may read it."""
    device = bench.device
    effects = [
        {
            "id": e.id,
            "equation": EQUATIONS[e.id],
            "size": e.size,
            "unit": e.unit,
            "values": e.values,
            "shares": s,
        }
        for e, s in zip(hidden, shares, strict=True)
    ]
    told = {
        "time_constant_s": device.tau_s,
        "first_layer_s": device.layer_s,
        "period_s": device.period_s,
        "ambient_C": device.ambient_C,
        "gain_C_per_mA2": device.gain_C_per_mA2,
        "coupling_K": device.coupling_K,
        "buckling": device.buckling,
        "grains": int(device.grains.up.size),
        "columns": int(device.profile.size),
        "film": device.film._asdict(),
        "deflection_um": device.deflection_um,
        "bimorph_per_K": device.bimorph_per_K,
        "current_mA": [bench.low_mA, bench.centre_mA, bench.high_mA],
        "hold_samples": bench.hold_samples,
    }
    return told_truth(bench.style, seed, effects, device.convention, staircase, told)


def told_truth(
    style: str,
    seed: int,
    effects: list[dict[str, Any]],
    convention: str,
    staircase: str,
    device: dict[str, Any],
) -> dict[str, object]:
    """What a film's truth says; `effects`: id, equation, size, unit, values and shares of each."""
    first = effects[0] if effects else {}
    return {
        "style": style,
        "seed": seed,
        "effect": first.get("id"),
        "second": effects[1]["id"] if len(effects) > 1 else None,
        "equation": first.get("equation"),
        "size": first.get("size", 0.0),
        "unit": first.get("unit"),
        "values": first.get("values", {}),
        "effects": effects,
        "share": min((max(effect["shares"].values()) for effect in effects), default=0.0),
        "shares": first.get("shares", {}),
        "share_is": f"RMS left by a re-fit of time constant and gain over the standard deviation, >= {SMALLEST}",
        "convention": convention,
        "staircase": staircase,
        "groups": [staircase, f"read at the {convention}"],
        "device": device,
    }


def without_layer(bench: Bench) -> Bench:
    """The same bench whose device has no first layer to speak of: what a first-order model believes."""
    return replace(bench, device=replace(bench.device, layer_s=1e-6 * bench.device.tau_s))
