"""Writes a data set of a simulated VO2 actuator as an outside lab would, with `truth.json` beside it.

python tests/foreign/foreign_generate.py --style few_domains --seed 3 --effect thermal.latent_heat --out DIR
"""

from __future__ import annotations

import argparse
from pathlib import Path

import foreign_grain_generate
import foreign_kept_cantilever_generate
import numpy as np
from foreign_common import flicker, write_truth
from foreign_device import EFFECTS, Effect, Readings, simulate
from foreign_excitations import records
from foreign_grain_styles import STYLES as GRAIN_STYLES
from foreign_kept_cantilever_styles import STYLES as KEPT_STYLES
from foreign_loops import Array
from foreign_sizes import draw_id, sized_effect
from foreign_styles import STYLES, Bench, draw_bench, stream

SEVERAL = (*GRAIN_STYLES, *KEPT_STYLES)  # styles that can hide two effects
FACTOR = {"ohm": 1.0, "kohm": 1e-3, "um": 1.0, "mm": 1e-3}  # from ohm and um


def generate(style: str, seed: int, folder: Path, effect: str | None = None) -> Path:
    """Write the case to `folder`; `effect` is an id, None, or "draw". Returns the manifest's path.

    The styles of `SEVERAL` can hide two effects: ids with + between.
    """
    if style in SEVERAL:
        names = None if effect == "draw" else tuple(effect.split("+")) if effect else ()
        later = foreign_kept_cantilever_generate if style in KEPT_STYLES else foreign_grain_generate
        return later.generate(style, seed, folder, names)
    bench = draw_bench(style, seed)
    plan = records(bench, seed)
    effect_id = draw_id(style, seed) if effect == "draw" else effect
    hidden: Effect | None = None
    shares: dict[str, float] = {}
    if effect_id is not None:
        moving = [current for _, use, current in plan if use != "identify"]
        hidden, shares = sized_effect(bench, seed, effect_id, moving)

    folder.mkdir(parents=True, exist_ok=True)
    rng = stream(style, seed, "noise")
    files, healthy = [], staircase_before(seed)
    for name, use, current in plan:
        acting = None if use == "identify" and healthy else hidden
        readings = with_instruments(bench, simulate(bench.device, current, acting), rng)
        files.append((_write_columns(bench, folder / name, current, readings), use))
    manifest = folder / "dataset.toml"
    manifest.write_text(_manifest(bench, seed, files), encoding="utf-8")
    write_truth(folder, _truth(bench, seed, hidden, shares))
    return manifest


def staircase_before(seed: int) -> bool:
    """Whether the staircase was recorded before the effect began: so in every other block of four seeds.

    In the other blocks the loops are identified on the device that has the effect, and hold what it does at rest.
    """
    return seed // 4 % 2 == 1


def with_instruments(bench: Bench, readings: Readings, rng: np.random.Generator) -> Readings:
    """Readings with the noise of the bench, its converter's steps, in ohm and um."""
    n = readings.resistance.size
    noise = bench.resistance_noise * rng.normal(size=n)
    if bench.resistance_flicker:
        noise = noise + bench.resistance_flicker * flicker(n, rng)
    resistance = readings.resistance * (1.0 + noise)
    if bench.resistance_step_ohm:
        steps = np.round(resistance / bench.resistance_step_ohm)
        resistance = bench.resistance_step_ohm * np.maximum(steps, 1.0)
    deflection = readings.deflection + bench.deflection_noise_um * rng.normal(size=n)
    return Readings(resistance, deflection, readings.temperature)


def _write_columns(bench: Bench, path: Path, current: Array, readings: Readings) -> str:
    """Write one record in the bench's kind of file; returns the file's name."""
    columns = {
        "current": current,
        "resistance": readings.resistance * FACTOR[bench.resistance_unit],
        "deflection": readings.deflection * FACTOR[bench.deflection_unit],
    }
    if bench.file == "npz":
        np.savez(path.with_suffix(".npz"), **columns)
        return path.with_suffix(".npz").name
    if bench.file == "csv with time":
        columns = {"t": np.arange(current.size) * bench.device.period_s} | columns
    digits = "%.5g" if bench.file == "csv 5 digits" else "%.9g"
    table = np.column_stack(list(columns.values()))
    np.savetxt(path.with_suffix(".csv"), table, digits, ",", header=",".join(columns), comments="")
    return path.with_suffix(".csv").name


def _manifest(bench: Bench, seed: int, files: list[tuple[str, str]]) -> str:
    """The manifest's text, in the form of formats.md, section 1."""
    rate = 1.0 / bench.device.period_s
    clock = 'time = "t"' if bench.file == "csv with time" else f"sample_rate_hz = {rate:.6g}"
    lines = ["[dataset]", f'name = "actuator {bench.style} {seed}"', 'plant = "vo2"', ""]
    lines += ["[signals.current]", 'role = "input"', 'unit = "mA"', 'hold = "zero"', ""]
    lines += ["[signals.resistance]", 'role = "output"', f'unit = "{bench.resistance_unit}"', ""]
    lines += ["[signals.deflection]", 'role = "output"', f'unit = "{bench.deflection_unit}"', ""]
    for file, use in files:
        lines += ["[[records]]", f'file = "{file}"', clock, f'use = "{use}"', ""]
    return "\n".join(lines)


def _truth(bench: Bench, seed: int, hidden: Effect | None, shares: dict[str, float]) -> dict[str, object]:
    """What was hidden, and the device; no diagnosis may read it."""
    device = bench.device
    staircase = "before the effect" if staircase_before(seed) else "with the effect"
    return {
        "style": bench.style,
        "seed": seed,
        "effect": hidden.id if hidden else None,
        "equation": EFFECTS[hidden.id] if hidden else None,
        "size": hidden.size if hidden else 0.0,
        "unit": hidden.unit if hidden else None,
        "values": hidden.values if hidden else {},
        "share": max(shares.values(), default=0.0),
        "shares": shares,
        "convention": device.convention,
        "staircase": staircase,
        "groups": [staircase],
        "device": {
            "time_constant_s": device.tau_s,
            "period_s": device.period_s,
            "ambient_C": device.ambient_C,
            "gain_C_per_mA2": device.gain_C_per_mA2,
            "mixing": device.mixing,
            "semiconductor_ohm": device.semiconductor_ohm,
            "metal_ohm": device.metal_ohm,
            "activation_K": device.activation_K,
            "deflection_um": device.deflection_um,
            "bimorph_um_per_K": device.bimorph_um_per_K,
            "current_mA": [bench.low_mA, bench.centre_mA, bench.high_mA],
            "hold_samples": bench.hold_samples,
        },
    }


def main() -> None:
    """Write one case from the command line."""
    parser = argparse.ArgumentParser(description="Measured data of a simulated VO2 actuator.")
    parser.add_argument("--style", choices=(*STYLES, *SEVERAL), required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--effect", default="none", help="none, draw, or an id: " + ", ".join(EFFECTS))
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    effect = None if given.effect == "none" else given.effect
    several = (effect or "").split("+") if given.style in SEVERAL else [effect]
    if effect not in (None, "draw") and not set(several) <= set(EFFECTS):
        parser.error(f"--effect must be none, draw, or one of {', '.join(EFFECTS)}; got {effect}")
    print(generate(given.style, given.seed, given.out, effect))


if __name__ == "__main__":
    main()
