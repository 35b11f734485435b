"""Writes a data set of a torsion balance; `foreign_oscillator_generate.py --style torsion_balance` calls it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from foreign_common import Array, record_lines
from foreign_kept_torsion_device import EQUATIONS, simulate
from foreign_kept_torsion_sizes import hide
from foreign_kept_torsion_styles import TorsionBench, stream
from foreign_oscillator_device import Effect
from foreign_response_generate import user_model
from foreign_truth import Lab, told_case
from scipy.signal import lfilter

RANGE = 1.2  # of the converter, in the largest reading
TIME = "t_us"


def write_records(bench: TorsionBench, effects: tuple[Effect, ...], seed: int, folder: Path) -> str:
    """Write the records' files; returns their manifest."""
    readings = measured(bench, effects, seed)
    step = count_step(bench, readings)
    return _manifest(bench, seed, step, _write(bench, folder, readings, step))


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
    time = (TIME, "us") if bench.file == "arrow" else None
    for (file, rows), record in zip(written, bench.records, strict=True):
        lines += record_lines(file, bench.device.period_s, record.use, rows, time)
    return "\n".join(lines)


def told_truth(
    bench: TorsionBench, effects: tuple[Effect, ...], shares: tuple[float, ...], seed: int
) -> dict[str, object]:
    """What was hidden, and the device; no diagnosis may read it."""
    device = bench.device
    told = {
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
    }
    return told_case(bench, seed, effects, shares, equations=EQUATIONS, over="displacement", device=told)


LAB = Lab(hide=hide, records=write_records, model=user_model, truth=told_truth, stream=stream)
