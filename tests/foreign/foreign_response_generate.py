"""Writes a data set of a panel or of a microscope's cantilever; `foreign_oscillator_generate.py --style ...` calls it.

DIR/data has what a user has: `dataset.toml` with its records and, in half of the cases, `start.toml` (rough values to
identify from) or `sheet.toml` (a data sheet's model, to be diagnosed as it is). DIR/truth/truth.json is for the judge.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from foreign_common import Array, flicker
from foreign_oscillator_device import Effect, natural_square
from foreign_response_device import EQUATIONS, simulate
from foreign_response_sizes import draw_case, hide
from foreign_response_styles import ResponseBench, stream
from foreign_truth import model_text, told_effects

RANGE = 1.15  # of the converter, in the largest reading
SUFFIX = {"uff": ".uff", "uff binary": ".uff", "tdms": ".tdms", "h5": ".h5"}


def generate(
    style: str, seed: int, folder: Path, names: tuple[str, ...] | None = (), which: str = "known"
) -> Path:
    """Write the case to `folder`; `names` are hidden, or what the seed draws if None. Returns the manifest's path."""
    bench, effects, shares = draw_case(style, seed, which) if names is None else hide(style, seed, names)
    data, truth = folder / "data", folder / "truth"
    for part in (data, truth):
        part.mkdir(parents=True, exist_ok=True)
    files = []
    for record, reading in zip(bench.records, measured(bench, effects, seed), strict=True):
        path = (data / record.name).with_suffix(SUFFIX[bench.file])
        _write(bench, path, {bench.name_of_drive: record.drive, bench.name_of_response: reading})
        files.append(path.name)
    (data / "dataset.toml").write_text(_manifest(bench, seed, files), encoding="utf-8")
    if bench.user != "identify":
        (data / f"{bench.user}.toml").write_text(user_model(bench, seed), encoding="utf-8")
    told = json.dumps(told_truth(bench, effects, shares, seed), indent=2)
    (truth / "truth.json").write_text(told + "\n", encoding="utf-8")
    return data / "dataset.toml"


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
        _write_tdms(path, bench, columns)
    elif bench.file == "h5":
        import h5py  # an extra of the program; only these files need it

        with h5py.File(path, "w", track_order=True) as file:
            for name, column in columns.items():
                file.create_dataset(name, data=column.astype(np.float64), track_times=False)
    else:
        _write_uff(path, bench, columns)


def _write_tdms(path: Path, bench: ResponseBench, columns: dict[str, Array]) -> None:
    from nptdms import ChannelObject, TdmsWriter

    properties = {"wf_increment": bench.device.period_s, "wf_start_offset": 0.0}
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject("scope", name, x, properties) for name, x in columns.items()])


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
        lines += ["[[records]]", f'file = "{file}"', f"sample_rate_hz = {1.0 / bench.device.period_s:.9g}"]
        lines += [f'use = "{record.use}"'] if record.use else []
        lines.append("")
    return "\n".join(lines)


def user_model(bench: ResponseBench, seed: int) -> str:
    """Text of a model with values that are off by a little."""
    rng, law = stream(bench.style, seed, "values"), bench.device.law
    z, gain = bench.displacement_unit, law.gain * bench.sensor_gain
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
    return {
        "style": bench.style,
        "seed": seed,
        "share_is": f"RMS left by a re-fit of the user's model over RMS of the {bench.response}, start known",
        **told_effects(effects, shares, EQUATIONS, read_at_end=device.read_at_end),
        "groups": ["read at the end" if device.read_at_end else "read at the start", f"user: {bench.user}"],
        "device": {
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
        },
    }
