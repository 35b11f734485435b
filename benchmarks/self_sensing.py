"""Self-sensing of actuators that differ from their equations: acquire, identify, then steps without a position sensor.

Each device has other parameters than the shipped model (10 % standard deviation, on a curve's place in K 1 %); with
effects it also has laws that the equations do not have. The identification has an external instrument of the position;
the loop has the electrical quantities alone.

    python benchmarks/self_sensing.py voice_coil --devices 6 --seed 10
"""

from __future__ import annotations

import argparse
import re
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import rtctl

MODELS = Path(__file__).parents[1] / "scenarios" / "models" / "equations"
SPREAD = 0.1


@dataclass(frozen=True, kw_only=True)
class Actuator:
    """How an actuator is measured and driven, and what its devices have beside its equations."""

    period: str
    limits: dict[str, str]
    excitation: dict[str, Any]
    levels: tuple[float, float]
    """Range of the steps, in `unit`."""
    unit: str
    hold_s: float
    changed: tuple[tuple[str, str], ...]
    """Texts of the model, and what they become in a device with effects."""
    parameters: str
    """Parameters of these effects."""
    exact: tuple[str, ...] = ()
    """Parameters that all devices share."""
    spread: dict[str, float] = field(default_factory=dict)
    """Parameters of another spread than `SPREAD`."""


ACTUATORS = {
    "voice_coil": Actuator(  # dry friction, a suspension that creeps, eddy currents
        period="200 us",
        limits={"low": "-6 V", "high": "6 V", "safe": "0 V", "sensed_low": "-2 A", "sensed_high": "2 A"},
        excitation={
            "kind": "random_multisine", "duration": "2 s", "frequency_low": "1 Hz", "frequency_high": "200 Hz",
            "amplitude": "40 %",
        },
        levels=(-2.0, 2.0), unit="mm", hold_s=0.1,
        changed=(
            ("- damping*speed)", "- damping*speed - friction*tanh(speed/slow) - creep*(position - crept))"),
            ("(voltage - resistance*current", "(voltage - resistance*current - eddy*(current - inner)"),
            ("\n[model.terms]",
             'crept = { unit = "mm", rate = "(position - crept)/creeping" }\n'
             'inner = { unit = "A", rate = "eddy*(current - inner)/inner_inductance" }\n\n[model.terms]'),
        ),
        parameters='friction = { value = 0.03, unit = "N" }\nslow = { value = 2.0, unit = "mm/s" }\n'
        'creep = { value = 60.0, unit = "N/m" }\ncreeping = { value = 0.5, unit = "s" }\n'
        'eddy = { value = 2.0, unit = "ohm" }\ninner_inductance = { value = 0.2, unit = "mH" }\n',
    ),
    "piezo_stack": Actuator(  # a charge that leaks, a slower creep, an electrostrictive part of the stroke
        period="100 us",
        limits={"low": "0 V", "high": "120 V", "safe": "0 V", "sensed_low": "-100 uC", "sensed_high": "1500 uC"},
        excitation={
            "kind": "random_multisine", "duration": "1 s", "frequency_low": "1 Hz", "frequency_high": "1500 Hz",
            "amplitude": "40 %", "offset": "50 %",
        },
        levels=(2.0, 12.0), unit="um", hold_s=0.05,
        changed=(
            ("capacity*voltage + transformer*position", "capacity*voltage + transformer*position - leaked"),
            ("- hysteresis + crept)", "- hysteresis + crept + crept_2 + bent*(voltage - hysteresis)^2)"),
            ("\n[model.terms]",
             'leaked = { unit = "uC", rate = "(capacity*voltage + transformer*position - leaked)/leaking" }\n'
             'crept_2 = { unit = "V", rate = "(creep*(voltage - hysteresis) - crept_2)/creeping_2" }\n\n[model.terms]'),
        ),
        parameters='leaking = { value = 30.0, unit = "s" }\ncreeping_2 = { value = 10.0, unit = "s" }\n'
        'bent = { value = 0.001, unit = "1/V" }\n',
        exact=("amplifier",),
    ),
    "sma_wire": Actuator(  # resistances that depend on the temperature, a warmer room, a stroke that bends
        period="10 ms",
        limits={"low": "0 A", "high": "0.6 A", "safe": "0 A", "sensed_low": "2 ohm", "sensed_high": "8 ohm"},
        excitation={"kind": "random_staircase", "hold": "1.5 s", "levels": 40, "low": "30 %"},
        levels=(1.0, 4.0), unit="mm", hold_s=4.0,
        changed=(
            ("austenite*(1 - martensite) + cold*martensite",
             "(austenite*(1 - martensite) + cold*martensite)*(1 + tcr*(temperature - room))"),
            ("stroke*(1 - martensite)", "stroke*(1 - martensite)*(1 + bent*martensite)"),
        ),
        parameters='tcr = { value = 2e-4, unit = "1/K" }\nbent = { value = 0.05, unit = "1" }\n',
        exact=("room",), spread={"hot": 0.01, "cool": 0.01},
    ),
}  # fmt: skip


def write_device(path: Path, name: str, seed: int, *, effects: bool) -> None:
    """Write a device like the shipped model with other parameters and, with `effects`, laws that it does not have."""
    made, rng = ACTUATORS[name], np.random.default_rng(seed)
    text = (MODELS / f"{name}.toml").read_text()
    for key, value in re.findall(r"^(\w+) += \{ value = ([-\d.e]+)", text, re.MULTILINE):
        spread = 0.0 if key in made.exact else made.spread.get(key, SPREAD)
        changed = float(value) * (1.0 + spread * np.clip(rng.standard_normal(), -2.0, 2.0))
        text = re.sub(
            rf"^({key} += {{ value = ){re.escape(value)}", rf"\g<1>{changed:.6g}", text, flags=re.MULTILINE
        )
    if effects:
        for old, new in (*made.changed, ("\n[device]", f"{made.parameters}\n[device]")):
            assert old in text, old
            text = text.replace(old, new, 1)
    path.write_text(text)


def measure(folder: Path, name: str, seed: int, *, effects: bool) -> list[float]:
    """Return mean and largest error of the estimate, and mean error of tracking, each in percent of the range."""
    made, device, model = ACTUATORS[name], folder / "device.toml", MODELS / f"{name}.toml"
    write_device(device, name, seed, effects=effects)
    driver = {"kind": "inprocess", "device": str(device), "seed": seed}
    heading = {"title": name, "plant": "equations", "model": str(model), "period": made.period}
    records = [{**made.excitation, "use": use, "seed": k} for k, use in enumerate(("fit", "test"))]
    data = rtctl.acquire(
        {"scenario": heading, "driver": driver, "limits": made.limits, "excitation": records}, folder / "data"
    )
    identified = folder / "identified.toml"
    rtctl.identify(data, model=model).save(identified)
    levels = [f"{level:.3f} {made.unit}" for level in np.random.default_rng(seed).uniform(*made.levels, 20)]
    found = rtctl.run(
        {
            "scenario": {**heading, "duration": f"{20 * made.hold_s} s"}, "driver": driver, "limits": made.limits,
            "reference": {"kind": "steps", "hold": f"{made.hold_s} s", "levels": levels},
            "estimator": {"kind": "kalman"}, "controller": {"kind": "pid"},
        },
        model=identified,
    )  # fmt: skip
    sensing, tracking = found.summary["self_sensing"], found.summary["tracking"]
    return [sensing["mean_abs_percent"], sensing["max_abs_percent"], tracking["mean_abs_percent"]]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("actuator", choices=ACTUATORS)
    parser.add_argument("--devices", type=int, default=6)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    print("| device | effects outside the model | self-sensing mean, % | largest, % | tracking mean, % |")
    print("|---|---|---|---|---|")
    for effects in (False, True):
        for seed in range(args.seed, args.seed + args.devices):
            with tempfile.TemporaryDirectory() as folder:
                row = measure(Path(folder), args.actuator, seed, effects=effects)
            figures = " | ".join(f"{one:.3f}" for one in row)
            print(f"| {seed} | {'yes' if effects else 'no'} | {figures} |", flush=True)


if __name__ == "__main__":
    main()
