"""Writes a data set of a torsion balance; `foreign_oscillator_generate.py --style torsion_balance` calls it.

DIR/data has what a user has: `dataset.toml` with its records and, in half of the cases, `start.toml` (rough values to
identify from) or `sheet.toml` (a data sheet's model, to be diagnosed as it is). DIR/truth/truth.json is for the judge.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from foreign_common import Array
from foreign_kept_torsion_device import EQUATIONS, simulate
from foreign_kept_torsion_sizes import draw_case, hide
from foreign_kept_torsion_styles import TorsionBench, stream
from foreign_oscillator_device import Effect
from foreign_truth import model_text, told_effects
from scipy.signal import lfilter

RANGE = 1.2  # of the converter, in the largest reading
TIME = "t_us"


def generate(
    style: str, seed: int, folder: Path, names: tuple[str, ...] | None = (), which: str = "known"
) -> Path:
    """Write the case to `folder`; `names` are hidden, or what the seed draws if None. Returns the manifest's path."""
    bench, effects, shares = draw_case(style, seed, which) if names is None else hide(style, seed, names)
    data, truth = folder / "data", folder / "truth"
    for part in (data, truth):
        part.mkdir(parents=True, exist_ok=True)
    readings = measured(bench, effects, seed)
    step = count_step(bench, readings)
    (data / "dataset.toml").write_text(
        _manifest(bench, seed, step, _write(bench, data, readings, step)), "utf-8"
    )
    if bench.user != "identify":
        (data / f"{bench.user}.toml").write_text(user_model(bench, seed), encoding="utf-8")
    told = json.dumps(told_truth(bench, effects, shares, seed), indent=2)
    (truth / "truth.json").write_text(told + "\n", encoding="utf-8")
    return data / "dataset.toml"


def measured(bench: TorsionBench, effects: tuple[Effect, ...], seed: int) -> list[Array]:
    """Readings of all records in the file's unit, with the noise of electronics and air, before the converter."""
    rng, readings = stream(bench.style, seed, "noise"), []
    for record in bench.records:
        clean = simulate(bench.device, record, effects).reading
        if not np.isfinite(clean).all():
            raise RuntimeError(f"{bench.style} {seed}: the motion diverges")
        noise = bench.white * rng.normal(size=clean.size)
        noise = noise + bench.flicker * air(clean.size, bench.air_samples, rng)
        readings.append(bench.to_unit * (clean + bench.reading_rms * noise))
    return readings


def air(samples: int, correlation: float, rng: np.random.Generator) -> Array:
    """Noise of unit variance whose correlation falls by 1/e in `correlation` samples: Ornstein and Uhlenbeck's."""
    keep, drawn = float(np.exp(-1.0 / correlation)), rng.normal(size=samples)
    drawn[1:] *= np.sqrt(1.0 - keep * keep)
    return np.asarray(lfilter([1.0], [1.0, -keep], drawn))


def count_step(bench: TorsionBench, readings: list[Array]) -> float:
    """A count of the converter in the file's unit, to four digits, so that the manifest can state it."""
    largest = max(float(np.max(np.abs(reading))) for reading in readings)
    return float(f"{2.0 * RANGE * (largest + abs(bench.zero)) / 2**bench.bits:.4g}")


def _write(
    bench: TorsionBench, folder: Path, readings: list[Array], step: float
) -> list[tuple[str, list[int]]]:
    """Write the records, each in a file or all in one; returns file and rows (or none) of each."""
    tables = []
    for record, reading in zip(bench.records, readings, strict=True):
        counts = np.round((reading + bench.zero) / step).astype(np.int32)
        columns = {bench.name_of_drive: record.drive, bench.name_of_response: counts}
        if bench.file == "arrow":
            columns = {TIME: 1e6 * bench.device.period_s * np.arange(counts.size)} | columns
        tables.append(pa.table(columns))
    if bench.file == "parquet in one":
        pq.write_table(pa.concat_tables(tables), folder / "balance.parquet")
        ends = np.cumsum([table.num_rows for table in tables]).tolist()
        return [("balance.parquet", [e - t.num_rows, e]) for t, e in zip(tables, ends, strict=True)]
    written: list[tuple[str, list[int]]] = []
    for record, table in zip(bench.records, tables, strict=True):
        path = folder / f"{record.name}.{bench.file}"
        if bench.file == "parquet":
            pq.write_table(table, path)
        else:
            with pa.OSFile(str(path), "wb") as sink, pa.ipc.new_file(sink, table.schema) as file:
                file.write_table(table)
        written.append((path.name, []))
    return written


def _manifest(bench: TorsionBench, seed: int, step: float, written: list[tuple[str, list[int]]]) -> str:
    """The manifest's text, in the form of formats.md, sections 1 and 6."""
    lines = ["[dataset]", f'name = "torsion balance, series {seed}"', 'plant = "oscillator"', ""]
    lines += ["[signals.drive]", 'role = "input"', f'unit = "{bench.drive_unit}"']
    lines += [f'column = "{bench.name_of_drive}"', f'hold = "{bench.device.hold}"', ""]
    lines += ["[signals.displacement]", 'role = "output"', f'unit = "{bench.response_unit}"']
    lines += [f'column = "{bench.name_of_response}"', f"scale = {step!r}", f"offset = {-bench.zero!r}", ""]
    timed = bench.file == "arrow"
    for (file, rows), record in zip(written, bench.records, strict=True):
        lines += ["[[records]]", f'file = "{file}"']
        lines += [f'time = "{TIME}"', 'time_unit = "us"'] if timed else []
        lines += [] if timed else [f"sample_rate_hz = {1.0 / bench.device.period_s:.9g}"]
        lines += [f"rows = {rows}"] if rows else []
        lines += [f'use = "{record.use}"'] if record.use else []
        lines.append("")
    return "\n".join(lines)


def user_model(bench: TorsionBench, seed: int) -> str:
    """Text of a model with values that are off by a little."""
    rng, law = stream(bench.style, seed, "values"), bench.device.law
    values = {
        "damping": (law.damping * float(rng.uniform(0.75, 1.3)), "1/s"),
        "stiffness": (law.stiffness * (1.0 + float(rng.uniform(-0.5, 0.5)) / bench.quality), "1/s^2"),
        "stiffness_cubic": (law.cubic * float(rng.uniform(0.85, 1.15)), "1/(rad^2*s^2)"),
        "drive_gain": (law.gain * float(rng.uniform(0.93, 1.07)), f"rad/s^2/({bench.drive_unit})"),
    }
    if not bench.cubic_known:
        del values["stiffness_cubic"]
    return model_text(values)


def told_truth(
    bench: TorsionBench, effects: tuple[Effect, ...], shares: tuple[float, ...], seed: int
) -> dict[str, object]:
    """What was hidden, and the device; no diagnosis may read it."""
    device = bench.device
    return {
        "style": bench.style,
        "seed": seed,
        "share_is": "RMS left by a re-fit of the user's model over RMS of the displacement, start known",
        **told_effects(effects, shares, EQUATIONS, read_at_end=device.read_at_end),
        "groups": ["read at the end" if device.read_at_end else "read at the start", f"user: {bench.user}"],
        "device": {
            "law": device.law._asdict(),
            "law_unit": bench.displacement_unit,
            "natural_Hz": float(np.sqrt(device.law.stiffness)) / (2.0 * np.pi),
            "quality": bench.quality,
            "period_s": device.period_s,
            "hold": device.hold,
            "read_at_end": device.read_at_end,
            "response": f"{bench.response} [{bench.response_unit}]",
            "bits": bench.bits,
            "motion_rms": bench.rms,
            "motion_largest": bench.largest,
            "noise_white": bench.white,
            "noise_air": bench.flicker,
            "air_samples": bench.air_samples,
        },
    }
