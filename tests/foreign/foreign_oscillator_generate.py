"""Writes a data set of a simulated oscillator as an outside lab would; what is hidden stands in a folder of its own.

python tests/foreign/foreign_oscillator_generate.py --style mems --seed 3 --effect friction.coulomb --out DIR

DIR/data has what a user has: `dataset.toml` with its records and, in half of the cases, `start.toml` (rough values to
identify from) or `sheet.toml` (a data sheet's model, to be diagnosed as it is). DIR/truth/truth.json is for the judge.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import foreign_kept_torsion_generate
import foreign_response_generate
import numpy as np
from foreign_common import Array, flicker
from foreign_oscillator_device import EFFECTS, Effect, Readings, natural_square, simulate
from foreign_oscillator_sizes import SETS, hide
from foreign_oscillator_styles import KEPT, LATER, STYLES, Bench, stream
from foreign_truth import Lab, model_text, told_case, write_case
from scipy.io import savemat

RANGE = 1.1  # of the converter, in the largest reading


def generate(
    style: str, seed: int, folder: Path, names: tuple[str, ...] | None = (), which: str = "known"
) -> Path:
    """Write the case to `folder`; `names` are hidden, or what the seed draws if None. Returns the manifest's path."""
    lab = LAB
    if style in LATER:
        lab = foreign_response_generate.LAB
    if style in KEPT:
        lab = foreign_kept_torsion_generate.LAB
    return write_case(lab, style, seed, folder, names, which)


def write_records(bench: Bench, effects: tuple[Effect, ...], seed: int, folder: Path) -> str:
    """Write a file for each record; returns their manifest."""
    rng = stream(bench.style, seed, "noise")
    clean = [simulate(bench.device, record, effects) for record in bench.records]
    if not all(np.isfinite(readings.displacement).all() for readings in clean):
        raise RuntimeError(f"{bench.style} {seed}: the motion diverges")
    noisy = [with_noise(bench, readings, rng) for readings in clean]
    if bench.bits:
        largest = max(np.max(np.abs(readings.displacement)) for readings in noisy)
        step = 2.0 * RANGE * largest / 2**bench.bits
        noisy = [r._replace(displacement=step * np.round(r.displacement / step)) for r in noisy]
    files = []
    for record, readings in zip(bench.records, noisy, strict=True):
        columns = {"drive": record.drive, "displacement": bench.sensor_gain * readings.displacement}
        if bench.velocity:
            columns["velocity"] = readings.velocity
        files.append(_write_columns(bench, folder / record.name, columns))
    return _manifest(bench, seed, files)


def with_noise(bench: Bench, readings: Readings, rng: np.random.Generator) -> Readings:
    """Readings with the noise of the sensors."""
    n = readings.displacement.size
    noise = bench.white * rng.normal(size=n)
    if bench.flicker:
        noise = noise + bench.flicker * flicker(n, rng)
    velocity = readings.velocity
    if bench.velocity:
        velocity = velocity + bench.white * np.std(velocity) * rng.normal(size=n)
    return readings._replace(displacement=readings.displacement + bench.rms * noise, velocity=velocity)


def _write_columns(bench: Bench, path: Path, columns: dict[str, Array]) -> str:
    """Write one record in the bench's kind of file; returns the file's name."""
    if bench.file == "npz":
        np.savez(path.with_suffix(".npz"), **columns)
        return path.with_suffix(".npz").name
    if bench.file == "mat":
        savemat(path.with_suffix(".mat"), columns)
        return path.with_suffix(".mat").name
    if bench.file in ("csv with time", "csv with commas"):
        columns = {"t": np.arange(columns["drive"].size) * bench.device.period_s} | columns
    separator = ";" if bench.file == "csv with commas" else ","
    lines = [separator.join(columns)]
    for row in np.column_stack(list(columns.values())).tolist():
        text = separator.join(f"{value:.9g}" for value in row)
        lines.append(text.replace(".", ",") if separator == ";" else text)
    path.with_suffix(".csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path.with_suffix(".csv").name


def _manifest(bench: Bench, seed: int, files: list[str]) -> str:
    """The manifest's text, in the form of formats.md, section 1."""
    timed = bench.file in ("csv with time", "csv with commas")
    clock = 'time = "t"' if timed else f"sample_rate_hz = {1.0 / bench.device.period_s:.9g}"
    lines = ["[dataset]", f'name = "oscillator {bench.style} {seed}"', 'plant = "oscillator"', ""]
    lines += ["[signals.drive]", 'role = "input"', f'unit = "{bench.drive_unit}"']
    lines += [f'hold = "{bench.device.hold}"', ""]
    lines += ["[signals.displacement]", 'role = "output"', f'unit = "{bench.displacement_unit}"', ""]
    if bench.velocity:
        lines += ["[signals.velocity]", 'role = "output"', f'unit = "{bench.displacement_unit}/s"', ""]
    for file, record in zip(files, bench.records, strict=True):
        lines += ["[[records]]", f'file = "{file}"', clock]
        lines += [f'use = "{record.use}"'] if record.use else []
        lines += [f'repeat = "{record.repeat}"'] if record.repeat else []
        lines.append("")
    return "\n".join(lines)


def user_model(bench: Bench, rng: np.random.Generator) -> str:
    """Text of a model with values that are off by a little; empty where the user only identifies."""
    if bench.user == "identify":
        return ""
    law = bench.device.law
    z, u = bench.displacement_unit, bench.drive_unit
    gain = law.gain * bench.sensor_gain
    values = {
        "damping": (law.damping * float(rng.uniform(0.8, 1.25)), "1/s"),
        "stiffness": (law.stiffness * float(rng.uniform(0.98, 1.02)), "1/s^2"),
        "stiffness_cubic": (
            law.cubic / bench.sensor_gain**2 * float(rng.uniform(0.85, 1.15)),
            f"1/({z}^2*s^2)",
        ),
        "drive_gain": (gain * float(rng.uniform(0.94, 1.06)), f"{z}/s^2/({u})"),
    }
    if not bench.cubic_known:
        del values["stiffness_cubic"]
    return model_text(values)


def told_truth(
    bench: Bench, effects: tuple[Effect, ...], shares: tuple[float, ...], seed: int
) -> dict[str, object]:
    """What was hidden, and the device; no diagnosis may read it."""
    device = bench.device
    told = {
        "law": device.law._asdict(),
        "natural_Hz": float(np.sqrt(natural_square(device.law))) / (2.0 * np.pi),
        "quality": float(bench.quality),
        "period_s": device.period_s,
        "hold": device.hold,
        "rest": device.rest,
        "read_at_end": device.read_at_end,
        "sensor_gain": bench.sensor_gain,
        "motion_rms": bench.rms,
        "motion_largest": bench.largest,
        "noise_white": bench.white,
        "noise_flicker": bench.flicker,
    }
    return told_case(bench, seed, effects, shares, equations=EFFECTS, over="motion", device=told)


LAB = Lab(hide=hide, records=write_records, model=user_model, truth=told_truth, stream=stream)


def main() -> None:
    """Write one case from the command line."""
    parser = argparse.ArgumentParser(description="Measured data of a simulated oscillator.")
    parser.add_argument("--style", choices=(*STYLES, *LATER, *KEPT), required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument(
        "--effect", default="none", help="none, draw, or names with + between: " + ", ".join(EFFECTS)
    )
    parser.add_argument("--effects", choices=SETS, default="known", help="the set that `draw` draws from")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    names = {"none": (), "draw": None}.get(given.effect, tuple(given.effect.split("+")))
    if names and not set(names) <= set(EFFECTS):
        parser.error(f"--effect must be none, draw, or of {', '.join(EFFECTS)}; got {given.effect}")
    print(generate(given.style, given.seed, given.out, names, given.effects))


if __name__ == "__main__":
    main()
