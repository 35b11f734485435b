"""Self-sensing of voice coils that differ from their model: acquire, identify, then steps without a position sensor.

Each device has other parameters than the shipped model (10 % standard deviation) and three effects that its equations
do not have: dry friction, a suspension that creeps, eddy currents beside the coil. The identification has an external
instrument of the position; the loop has voltage and current alone.

    python benchmarks/voice_coil_self_sensing.py --devices 6 --seed 0
"""

from __future__ import annotations

import argparse
import re
import tempfile
from pathlib import Path

import numpy as np

import rtctl

MODEL = Path(__file__).parents[1] / "scenarios" / "models" / "equations" / "voice_coil.toml"
SPREAD = 0.1
HEADING = {"plant": "equations", "model": str(MODEL), "period": "200 us"}
LIMITS = {"low": "-6 V", "high": "6 V", "safe": "0 V", "sensed_low": "-2 A", "sensed_high": "2 A"}
NOISE = {
    "kind": "random_multisine",
    "duration": "2 s",
    "frequency_low": "1 Hz",
    "frequency_high": "200 Hz",
    "amplitude": "40 %",
}


def write_device(path: Path, seed: int, *, effects: bool) -> None:
    """Write a device like the shipped model with other parameters and, with `effects`, laws that it does not have."""
    rng, text = np.random.default_rng(seed), MODEL.read_text()
    for name, value in re.findall(r"^(\w+) += \{ value = ([-\d.e]+)", text, re.MULTILINE):
        changed = float(value) * (1.0 + SPREAD * np.clip(rng.standard_normal(), -2.0, 2.0))
        text = re.sub(
            rf"^({name} += {{ value = ){re.escape(value)}", rf"\g<1>{changed:.6g}", text, flags=re.MULTILINE
        )
    if effects:
        text = text.replace(
            "- damping*speed)", "- damping*speed - friction*tanh(speed/slow) - creep*(position - crept))"
        )
        text = text.replace(
            "(voltage - resistance*current", "(voltage - resistance*current - eddy*(current - inner)"
        )
        text = text.replace(
            "\n[model.terms]",
            'crept = { unit = "mm", rate = "(position - crept)/creeping" }\n'
            'inner = { unit = "A", rate = "eddy*(current - inner)/inner_inductance" }\n\n[model.terms]',
        )
        text = text.replace(
            "\n[device]",
            'friction = { value = 0.03, unit = "N" }\nslow = { value = 2.0, unit = "mm/s" }\n'
            'creep = { value = 60.0, unit = "N/m" }\ncreeping = { value = 0.5, unit = "s" }\n'
            'eddy = { value = 2.0, unit = "ohm" }\ninner_inductance = { value = 0.2, unit = "mH" }\n\n[device]',
            1,
        )
    path.write_text(text)


def measure(folder: Path, seed: int, *, effects: bool) -> list[float]:
    """Return mean and largest error of the estimate, and mean error of tracking, each in percent of the range."""
    device = folder / "device.toml"
    write_device(device, seed, effects=effects)
    driver = {"kind": "inprocess", "device": str(device), "seed": seed}
    data = rtctl.acquire(
        {
            "scenario": {"title": "coil", **HEADING}, "driver": driver, "limits": LIMITS,
            "excitation": [{**NOISE, "use": "fit", "seed": 1}, {**NOISE, "use": "test", "seed": 2}],
        },
        folder / "data",
    )  # fmt: skip
    identified = folder / "identified.toml"
    rtctl.identify(data, model=MODEL).save(identified)
    levels = [f"{level:.3f} mm" for level in np.random.default_rng(seed).uniform(-2.0, 2.0, 20)]
    found = rtctl.run(
        {
            "scenario": {"title": "steps", **HEADING, "duration": "2 s"}, "driver": driver, "limits": LIMITS,
            "reference": {"kind": "steps", "hold": "100 ms", "levels": levels},
            "estimator": {"kind": "kalman"}, "controller": {"kind": "pid"},
        },
        model=identified,
    )  # fmt: skip
    errors = found.summary
    sensing, tracking = errors["self_sensing"], errors["tracking"]
    return [sensing["mean_abs_percent"], sensing["max_abs_percent"], tracking["mean_abs_percent"]]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--devices", type=int, default=6)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    print("| device | effects outside the model | self-sensing mean, % | largest, % | tracking mean, % |")
    print("|---|---|---|---|---|")
    for effects in (False, True):
        for seed in range(args.seed, args.seed + args.devices):
            with tempfile.TemporaryDirectory() as folder:
                row = measure(Path(folder), seed, effects=effects)
            print(
                f"| {seed} | {'yes' if effects else 'no'} | "
                + " | ".join(f"{one:.3f}" for one in row)
                + " |",
                flush=True,
            )


if __name__ == "__main__":
    main()
