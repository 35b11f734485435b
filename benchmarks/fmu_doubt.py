"""Units as models beside data of devices that have an effect more: what the diagnosis says.

python benchmarks/fmu_doubt.py [--effects NAME ...]
python benchmarks/fmu_doubt.py --speed          time of a run beside the same equations compiled
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import rtctl

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "fmu"))
BEAM = """
[model]
kind = "equations"
[model.inputs]
force = { unit = "N" }
[model.states]
z = { unit = "mm", rate = "v" }
v = { unit = "mm/s", rate = "(force - k*z - k3*z^3 - c*v)/m" }
[model.outputs]
place = { unit = "mm", value = "z" }
[model.parameters]
k = { value = 900.0, unit = "N/m" }
k3 = { value = 300.0, unit = "N/m/mm^2" }
c = { value = 1.2, unit = "N*s/m" }
m = { value = 10.0, unit = "g" }
"""
MANIFEST = """
[dataset]
name = "beam"
plant = "fmu"
[signals.force]
role = "input"
column = "force"
unit = "N"
hold = "zero"
[signals.place]
role = "output"
column = "place"
unit = "mm"
"""
EFFECTS = {
    "nothing": "nothing",
    "lag": "reading lags, 2.5 ms",
    "saturation": "force saturates, u/(1 + 0.5 u^2)^(1/2)",
    "drift": "stiffness drifts, 0.25 1/s of itself",
    "offset": "force has a constant part, 0.1 N",
    "friction": "dry friction, 0.05 N (inside the unit's equations)",
    "heater": "power acts 0.6 s late",
}
PERIOD_S, SAMPLES = 1e-3, 1500


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--effects", nargs="+", choices=tuple(EFFECTS), default=tuple(EFFECTS))
    parser.add_argument("--speed", action="store_true")
    args = parser.parse_args()
    if args.speed:
        speed()
        return
    print("| hidden | verdict | causes | error on the test record | processor time, s |")
    print("|---|---|---|---|---|")
    for effect in args.effects:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            data, start = heater(folder) if effect == "heater" else beam(folder, effect)
            fitted = rtctl.identify(data, model=start).model.save(folder / "model.toml")
            before = os.times().user
            found = rtctl.diagnose(data, fitted)
            spent = os.times().user - before
        causes = "; ".join(one.statement for one in found.causes) or "–"
        print(
            f"| {EFFECTS[effect]} | `{found.verdict}` | {causes} | {_error(found.gain)} | {spent:.0f} |",
            flush=True,
        )


def _error(gain: Any) -> str:
    if gain is None:
        return "–"
    return f"{gain.before:.3g} to {gain.after:.3g} {gain.unit} (noise {gain.noise_floor:.3g})"


def speed() -> None:
    """Print how long a run takes, unit and equations in turns, least of 30."""
    from rtctl.border.simulation import Stimulus
    from rtctl.wiring_models import build_simulation, read_model

    stimulus = Stimulus(inputs={"force": multisine(1, 0.5)}, holds={"force": "zero"}, period_s=PERIOD_S)
    with tempfile.TemporaryDirectory() as place:
        beam(Path(place), "nothing")
        simulations = [
            build_simulation(read_model(Path(place) / name, kind), {"force": "N", "place": "mm"}, name, kind)
            for name, kind in (("beam.fmu", "fmu"), ("beam.toml", "equations"))
        ]
        values = [np.array([one.value for one in simulation.parameters]) for simulation in simulations]
        found = [
            simulation.predict(stimulus, own).outputs["place"]
            for simulation, own in zip(simulations, values, strict=True)
        ]
        least = [np.inf, np.inf]
        for _ in range(30):
            for k, (simulation, own) in enumerate(zip(simulations, values, strict=True)):
                begin = time.perf_counter()
                simulation.predict(stimulus, own)
                least[k] = min(least[k], time.perf_counter() - begin)
    apart = np.abs(found[0] - found[1]).max() / np.ptp(found[1])
    print(f"unit {1e3 * least[0]:.2f} ms, equations {1e3 * least[1]:.2f} ms: {least[0] / least[1]:.2f} times")
    print(f"largest difference {apart:.2g} of the range")


def heater(folder: Path) -> tuple[Path, Path]:
    """Return manifest and start model of the unit by another hand."""
    from fmu_units import MODEL, write_heater, write_heater_data

    write_heater(folder)
    (folder / "start.toml").write_text(MODEL, encoding="utf-8")
    return write_heater_data(folder, late_s=0.6), folder / "start.toml"


def beam(folder: Path, effect: str) -> tuple[Path, Path]:
    """Return manifest and unit of a mass on a spring that has an effect more."""
    (folder / "beam.toml").write_text(BEAM, encoding="utf-8")
    rtctl.export_fmu(folder / "beam.toml", folder / "beam.fmu", step_s=PERIOD_S)
    rng, lines = np.random.default_rng(5), [MANIFEST]
    for k, (seed, size, use) in enumerate(((1, 0.5, "fit"), (2, 0.8, "fit"), (3, 0.65, "test"))):
        force = multisine(seed, size)
        place = motion(force, effect)
        place = place + 0.01 * place.std() * rng.standard_normal(SAMPLES)
        rows = np.column_stack((PERIOD_S * np.arange(SAMPLES), force, place))
        np.savetxt(folder / f"r{k}.csv", rows, delimiter=",", header="t,force,place", comments="", fmt="%.7g")
        lines.append(f'[[records]]\nfile = "r{k}.csv"\ntime = "t"\nuse = "{use}"\n')
    (folder / "dataset.toml").write_text("\n".join(lines), encoding="utf-8")
    return folder / "dataset.toml", folder / "beam.fmu"


def multisine(seed: int, size: float) -> np.ndarray:
    """Return a force (samples,) [N] of RMS `size`."""
    rng, t = np.random.default_rng(seed), PERIOD_S * np.arange(SAMPLES)
    frequencies = 0.7 * np.arange(1, 60)
    phases = rng.uniform(0.0, 2.0 * np.pi, len(frequencies))
    made = np.cos(2.0 * np.pi * frequencies[:, None] * t + phases[:, None]).sum(axis=0)
    return size * made / made.std()


def motion(force: np.ndarray, effect: str) -> np.ndarray:
    """Return the readings (samples,) [mm] of the device, by SciPy."""
    k, k3, c, m = 850.0, 330e6, 1.0, 10.5e-3
    x, found = np.zeros(3), []
    for j, level in enumerate(force):
        found.append(1e3 * (x[2] if effect == "lag" else x[0]))
        acting = level / np.sqrt(1.0 + 0.5 * level**2) if effect == "saturation" else level
        acting += 0.1 if effect == "offset" else 0.0

        def rates(
            t: float, x: np.ndarray, acting: float = acting, begin: float = PERIOD_S * j
        ) -> list[float]:
            stiff = k * (1.0 + 0.25 * (begin + t)) if effect == "drift" else k
            dry = 0.05 * np.tanh(x[1] / 1e-3) if effect == "friction" else 0.0
            return [
                x[1],
                (acting - dry - stiff * x[0] - k3 * x[0] ** 3 - c * x[1]) / m,
                (x[0] - x[2]) / 2.5e-3,
            ]

        x = solve_ivp(rates, (0.0, PERIOD_S), x, rtol=1e-7, atol=1e-9).y[:, -1]
    return np.array(found)


if __name__ == "__main__":
    main()
