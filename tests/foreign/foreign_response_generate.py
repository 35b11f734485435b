"""Writes a data set of a panel or of a microscope's cantilever, for `foreign_oscillator_generate.py --style ...`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from foreign_common import Array, flicker, record_lines, write_tdms
from foreign_oscillator_device import Effect, natural_square
from foreign_response_device import EQUATIONS, simulate
from foreign_response_sizes import hide
from foreign_response_styles import ResponseBench, stream
from foreign_truth import Lab, model_text, told_case

RANGE = 1.15  # of the converter, in the largest reading
SUFFIX = {"uff": ".uff", "uff binary": ".uff", "tdms": ".tdms", "h5": ".h5"}


def write_records(bench: ResponseBench, effects: tuple[Effect, ...], seed: int, folder: Path) -> str:
    """Write a file for each record; returns their manifest."""
    files = []
    for record, reading in zip(bench.records, measured(bench, effects, seed), strict=True):
        path = (folder / record.name).with_suffix(SUFFIX[bench.file])
        _write(bench, path, {bench.name_of_drive: record.drive, bench.name_of_response: reading})
        files.append(path.name)
    return _manifest(bench, seed, files)


def measured(bench: ResponseBench, effects: tuple[Effect, ...], seed: int) -> list[Array]:
    """Readings of all records in the file's unit, with noise and the converter's steps."""
    rng = stream(bench.style, seed, "noise")
    readings = []
    for record in bench.records:
        clean = simulate(bench.device, record, bench.response, effects).reading
        if not np.isfinite(clean).all():
            raise RuntimeError(f"{bench.style} {seed}: the motion diverges")
        noise = bench.white * rng.normal(size=clean.size) + bench.flicker * flicker(clean.size, rng)
        readings.append(clean + bench.reading_rms * noise)
    if bench.bits:
        step = 2.0 * RANGE * max(np.max(np.abs(reading)) for reading in readings) / 2**bench.bits
        readings = [step * np.round(reading / step) for reading in readings]
    return [bench.to_unit * bench.sensor_gain * reading for reading in readings]


def _write(bench: ResponseBench, path: Path, columns: dict[str, Array]) -> None:
    if bench.file == "tdms":
        write_tdms(path, "scope", bench.device.period_s, columns)
    elif bench.file == "h5":
        import h5py  # an extra of the program; only these files need it

        with h5py.File(path, "w", track_order=True) as file:
            for name, column in columns.items():
                file.create_dataset(name, data=column.astype(np.float64), track_times=False)
    else:
        _write_uff(path, bench, columns)


def _write_uff(path: Path, bench: ResponseBench, columns: dict[str, Array]) -> None:
    """Universal file format, dataset 58 (text) or 58b: one function of time for each channel, quantity and unit."""
    binary, step = bench.file == "uff binary", bench.device.period_s
    parts: list[bytes] = []
    for k, (name, column) in enumerate(columns.items()):
        node, kind, unit = (1, 13, "N") if k == 0 else (7, 12, bench.response_unit)
        numbers = column.astype("<f8").tobytes()
        tail = f"b{1:6d}{2:6d}{11:12d}{len(numbers):12d}{0:6d}{0:6d}{0:12d}{0:12d}" if binary else ""
        lines = [
            "    -1",
            f"    58{tail}".ljust(80),
            name,
            f"{bench.style}, {path.stem}",
            "01-MAR-24  09:30:00",
        ]
        lines += ["NONE", "NONE"]
        lines.append(f"{1:5d}{0:10d}{1:5d}{0:10d} {'PANEL':10}{node:10d}{3:4d} {'NONE':10}{0:10d}{0:4d}")
        lines.append(f"{4:10d}{column.size:10d}{1:10d}{0.0:13.5E}{step:13.5E}{0.0:13.5E}")
        for quantity, label, of in (
            (17, "time", "s"),
            (kind, name, unit),
            (0, "NONE", "NONE"),
            (0, "NONE", "NONE"),
        ):
            lines.append(f"{quantity:10d}{0:5d}{0:5d}{0:5d} {label:20} {of:20}")
        parts.append(("\n".join(lines) + "\n").encode("ascii"))
        if not binary:  # 4E20.12
            cells = [f"{value:20.12E}" for value in column.tolist()]
            text = "\n".join("".join(cells[i : i + 4]) for i in range(0, len(cells), 4)) + "\n"
        parts += [numbers if binary else text.encode("ascii"), b"    -1\n"]
    path.write_bytes(b"".join(parts))


def _manifest(bench: ResponseBench, seed: int, files: list[str]) -> str:
    """The manifest's text, in the form of formats.md, section 1."""
    lines = ["[dataset]", f'name = "{bench.style.replace("_", " ")} {seed}"', 'plant = "oscillator"', ""]
    lines += ["[signals.drive]", 'role = "input"', f'unit = "{bench.drive_unit}"']
    lines += [f'column = "{bench.name_of_drive}"', f'hold = "{bench.device.hold}"', ""]
    lines += [f"[signals.{bench.response}]", 'role = "output"', f'unit = "{bench.response_unit}"']
    lines += [f'column = "{bench.name_of_response}"', ""]
    for file, record in zip(files, bench.records, strict=True):
        lines += record_lines(file, bench.device.period_s, record.use)
    return "\n".join(lines)


def user_model(bench: ResponseBench, rng: np.random.Generator) -> str:
    """Text of a model with values that are off by a little."""
    law, z = bench.device.law, bench.displacement_unit
    gain = law.gain * bench.sensor_gain
    values = {
        "damping": (law.damping * float(rng.uniform(0.75, 1.3)), "1/s"),
        "stiffness": (law.stiffness * (1.0 + float(rng.uniform(-0.5, 0.5)) / bench.quality), "1/s^2"),
        "stiffness_cubic": (
            law.cubic / bench.sensor_gain**2 * float(rng.uniform(0.85, 1.15)),
            f"1/({z}^2*s^2)",
        ),
        "drive_gain": (gain * float(rng.uniform(0.93, 1.07)), f"{z}/s^2/({bench.drive_unit})"),
    }
    if not bench.cubic_known:
        del values["stiffness_cubic"]
    return model_text(values)


def told_truth(
    bench: ResponseBench, effects: tuple[Effect, ...], shares: tuple[float, ...], seed: int
) -> dict[str, object]:
    """What was hidden, and the device; no diagnosis may read it."""
    device = bench.device
    told = {
        "law": device.law._asdict(),
        "law_unit": bench.displacement_unit,
        "natural_Hz": float(np.sqrt(natural_square(device.law))) / (2.0 * np.pi),
        "quality": bench.quality,
        "period_s": device.period_s,
        "hold": device.hold,
        "read_at_end": device.read_at_end,
        "response": f"{bench.response} [{bench.response_unit}]",
        "sensor_gain": bench.sensor_gain,
        "bits": bench.bits,
        "motion_rms": bench.rms,
        "motion_largest": bench.largest,
        "reading_rms": bench.reading_rms,
        "noise_white": bench.white,
        "noise_flicker": bench.flicker,
    }
    return told_case(bench, seed, effects, shares, equations=EQUATIONS, over=bench.response, device=told)


LAB = Lab(hide=hide, records=write_records, model=user_model, truth=told_truth, stream=stream)
