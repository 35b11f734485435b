"""The loop closes: devices with an effect that nobody told the program, before and after a diagnosis.

Each row is the whole way over the program's own commands and files:

    rtctl acquire -> rtctl identify (VO2) -> rtctl run -> rtctl diagnose -> rtctl run --model model-extended.toml

The effect stands in the device's file alone. A resonator's records are taken of the same device with a sampling
instrument (drive and displacement), its loop runs on the lock-in. What is done is kept in --out and not done again.

    python benchmarks/closed_loop_gain.py [--cases NAME ...] [--out out/closed_loop] [--results docs/results.md]
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rtctl.session.run_files
from rtctl.border.mechanisms import plain_unit
from rtctl.cli import main as rtctl_main

ROOT = Path(__file__).resolve().parent.parent
BEGIN, END = "<!-- closed_loop_gain: begin -->", "<!-- closed_loop_gain: end -->"
QUIET_SEED = "driver.seed=77"
"""Of the runs that are scored; acquisitions have 78."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A device with an effect, and what is tracked on it."""

    name: str
    plant: str
    hidden: str
    """What the device's file has, beyond the bundled device."""
    tells: str
    """The same, for a reader."""
    scenario: str


CASES = (
    Case(
        name="vo2-delay", plant="vo2", scenario="multisine_1_10hz",
        hidden='delay = "3 ms"', tells="current acts 3 ms late",
    ),
    Case(
        name="vo2-second-time-constant", plant="vo2", scenario="multisine_1_10hz",
        hidden='second_share = 0.35\nsecond_time_constant = "6 ms"', tells="35 % of the heating follows in 6 ms",
    ),
    Case(
        name="vo2-sensor-lag", plant="vo2", scenario="multisine_1_10hz",
        hidden='sensor_lag = "4 ms"', tells="resistance reading lags by 4 ms",
    ),
    Case(
        name="vo2-rate-dependence", plant="vo2", scenario="multisine_1_10hz",
        hidden='domain_lag = "4 ms"', tells="transition lags the temperature by 4 ms",
    ),
    Case(
        name="me-delay", plant="me", scenario="me_amplitude",
        hidden='id = "drive.delay"\nparameters = { delay = { value = 20.0, unit = "us" } }',
        tells="current acts 20 us late",
    ),
    Case(
        name="me-sensor-saturation", plant="me", scenario="me_amplitude",
        hidden='id = "sensor.saturation"\nparameters = { curvature = { value = 0.5, unit = "1/um^2" } }',
        tells="displacement sensor saturates at 1.4 um",
    ),
)  # fmt: skip
BEAM = """
[device]
name = "ME-A"

[device.drive]
unit = "mA"
low = "-250 mA"
high = "250 mA"

[device.displacement]
unit = "um"
noise = "0.3 nm"
broken_above = "20 um"
"""
BENCH = """[plant]
kind = "me"
name = "ME-A"
seed = 1
model = "beam.toml"

[coil]
current_high = "400 mA"
frequency_low = "6.5 kHz"
frequency_high = "8.5 kHz"
frequency_rest = "7.5 kHz"

[lock_in]
white = "2e-6 um/Hz^0.5"
converter_range = "2 um"
converter_bits = 18
vibrometer = "2e-7 um/Hz^0.5"
"""
RECORDS = """[scenario]
title = "resonator, drive and displacement sample by sample"
plant = "oscillator"
drive_unit = "mA"
displacement_unit = "um"
period = "20 us"

[driver]
device = "beam.toml"
seed = 78

[limits]
low = "-250 mA"
high = "250 mA"
safe = "0 mA"

[[excitation]]
kind = "random_multisine"
use = "fit"
duration = "0.32768 s"
frequency_low = "7.2 kHz"
frequency_high = "7.8 kHz"
amplitude = "50 %"
seed = 1

[[excitation]]
kind = "frequency_sweep"
use = "fit"
duration = "0.3 s"
frequency_low = "7.35 kHz"
frequency_high = "7.65 kHz"
amplitude = "20 %"

[[excitation]]
kind = "random_multisine"
use = "test"
duration = "0.32768 s"
frequency_low = "7.2 kHz"
frequency_high = "7.8 kHz"
amplitude = "50 %"
seed = 2
"""


def main() -> None:
    """Run, print, and replace the block between the markers of the results page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", nargs="+", choices=[case.name for case in CASES], help="default: all")
    parser.add_argument("--out", type=Path, default=Path("out/closed_loop"))
    parser.add_argument("--results", type=Path, help="page whose marked block is replaced")
    args = parser.parse_args()
    rtctl.session.run_files.draw_run = lambda *nothing: None  # a picture a run is not needed here
    found = {}
    for case in CASES:
        if args.cases is None or case.name in args.cases:
            found[case] = closed(case, (args.out / case.name).resolve())
            print(row(case, found[case]), flush=True)
    text = table(found)
    print(text)
    if args.results is not None:
        head, _, rest = args.results.read_text(encoding="utf-8").partition(BEGIN)
        args.results.write_text(f"{head}{BEGIN}\n{text}\n{END}{rest.partition(END)[2]}", encoding="utf-8")


def closed(case: Case, folder: Path) -> dict[str, Any]:
    """The whole way of one case: summaries of the runs before and after, and the diagnosis."""
    folder.mkdir(parents=True, exist_ok=True)
    device = vo2_device(case, folder) if case.plant == "vo2" else me_device(case, folder)
    model = folder / "model.toml"
    if case.plant == "vo2":
        acquire_vo2(folder, device)
    else:
        once(folder / "data" / "dataset.toml", "acquire", folder / "records.toml", "--out", folder / "data")
        nominal = (ROOT / "scenarios" / "models" / "me_a.toml").read_text(encoding="utf-8")
        model.write_text(nominal, encoding="utf-8")
    run(case, folder / "before", device, model)
    begun = time.perf_counter()
    answer = folder / "diagnosis" / "diagnosis.json"
    once(
        answer, "diagnose", folder / "data" / "dataset.toml", "--model", model, "--out", folder / "diagnosis"
    )
    print(f"{case.name}: diagnosis {time.perf_counter() - begun:.0f} s", file=sys.stderr, flush=True)
    run(case, folder / "after", device, folder / "diagnosis" / "model-extended.toml")
    return {
        "diagnosis": json.loads(answer.read_text(encoding="utf-8")),
        **{when: json.loads((folder / when / "summary.json").read_text()) for when in ("before", "after")},
    }


def vo2_device(case: Case, folder: Path) -> Path:
    """Bundled device A with the effect."""
    path = folder / "device.toml"
    bundled = (ROOT / "plant_sim" / "vo2" / "devices" / "vo2_a.toml").read_text(encoding="utf-8")
    path.write_text(f"{bundled}\n[effects]\n{case.hidden}\n", encoding="utf-8")
    return path


def me_device(case: Case, folder: Path) -> Path:
    """The resonator that the bundled model is of, with the effect: its beam, and the bench with the lock-in."""
    nominal = (ROOT / "scenarios" / "models" / "me_a.toml").read_text(encoding="utf-8")
    parameters = nominal.partition("[provenance]")[0]
    (folder / "beam.toml").write_text(
        f"{parameters}\n[[model.mechanisms]]\n{case.hidden}\n{BEAM}", encoding="utf-8"
    )
    (folder / "records.toml").write_text(RECORDS, encoding="utf-8")
    path = folder / "bench.toml"
    path.write_text(BENCH, encoding="utf-8")
    return path


def acquire_vo2(folder: Path, device: Path) -> None:
    """The bundled acquisition with holds of 30 ms, so that slow heating has settled at their ends; then the model."""
    settled = [f"--set=excitation.{k}.hold=30 ms" for k in range(3)]
    data = folder / "data"
    once(
        data / "dataset.toml", "acquire", "acquire_vo2", "--out", data, "--set", f'driver.device="{device}"',
        "--set", "driver.seed=78", *settled,
    )  # fmt: skip
    once(
        folder / "model.toml",
        "identify",
        data / "dataset.toml",
        "--kind",
        "vo2",
        "--out",
        folder / "model.toml",
    )


def run(case: Case, out: Path, device: Path, model: Path) -> None:
    """The scenario on the device; whether it meets its checks is part of the table."""
    once(
        out / "summary.json", "run", case.scenario, "--model", model, "--out", out, "--set",
        f'driver.device="{device}"', "--set", QUIET_SEED, ok=(0, 1),
    )  # fmt: skip


def once(product: Path, *command: object, ok: tuple[int, ...] = (0,)) -> None:
    """A command of the program, unless what it makes is there."""
    if product.exists():
        return
    code = rtctl_main([*map(str, command), "--quiet"])
    if code not in ok:
        raise SystemExit(f"rtctl {' '.join(map(str, command))}: exit {code}")


def table(found: dict[Case, dict[str, Any]]) -> str:
    """The table with its command."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=True, cwd=ROOT
    ).stdout.strip()
    lines = [
        f"Made at commit {commit} by `python benchmarks/closed_loop_gain.py --results docs/results.md`.",
        "",
        "| hidden in the device | scenario | verdict of the diagnosis | tracking error before: mean / rms | after | "
        "times less (mean) | checks before, after |",
        "|---|---|---|---|---|---|---|",
    ]
    return "\n".join([*lines, *(row(case, one) for case, one in found.items())])


def row(case: Case, found: dict[str, Any]) -> str:
    """One line."""
    before, after = (found[when]["tracking"] for when in ("before", "after"))
    diagnosis = found["diagnosis"]
    causes = ", ".join(
        "{} ({})".format(
            cause["id"],
            ", ".join(
                f"{name} {one['value']:.3g} {plain_unit(one['unit'])}".rstrip()
                for name, one in cause["parameters"].items()
            ),
        )
        for cause in diagnosis["causes"]
    )
    errors = [f"{1e3 * one['mean_abs_um']:.4g} / {1e3 * one['rms_um']:.4g} nm" for one in (before, after)]
    less = before["mean_abs_um"] / after["mean_abs_um"]
    verdict, checks = diagnosis["verdict"], f"{found['before']['verdict']}, {found['after']['verdict']}"
    return (
        f"| {case.plant}: {case.tells} | {case.scenario} | {verdict}: {causes or 'no cause'} | {errors[0]} | "
        f"{errors[1]} | {less:.1f} | {checks} |"
    )


if __name__ == "__main__":
    main()
