"""The observer's loop with wrong readings and in other rooms: the table of docs/results.md.

    python benchmarks/disturbed_observer.py [--estimator KIND] [--device vo2_b] [--seconds 10]

The model is identified once on the device as it is; then one reading in fifty, or ten in a row each second, is replaced
by another one of the device's range, or the room is warmer or colder than on the day of identification.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from compare_estimators import SCENARIOS, identified

from drivers.inprocess import InProcessDriver
from plant_sim.catalogue import bundled_plant
from plant_sim.device import SimulatedDevice
from rtctl.border.records import Measurement
from rtctl.models.vo2 import Vo2Model
from rtctl.scenario.schema import load_scenario
from rtctl.session.closed_loop import track
from rtctl.wiring import load_plant

NAMES = ("steps", "multisine_1_10hz")
ROOMS_K = (-4, -2, 1, 3, 6, 8, 12)
SEED = 31


class WrongReadings(InProcessDriver):
    """A simulated device some of whose readings are wrong."""

    def __init__(self, device: SimulatedDevice, wrong: dict[int, float]) -> None:
        super().__init__(device)
        self._wrong, self._count = wrong, 0

    def exchange(self, levels: Sequence[float]) -> Measurement:
        """Exchange, and replace the reading where it is to be wrong."""
        reading = super().exchange(levels)
        self._count += 1
        wrong = self._wrong.get(self._count)
        return reading if wrong is None else reading._replace(sensed=(wrong,))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--estimator", default="observer")
    parser.add_argument("--device", default="vo2_b")
    parser.add_argument("--seconds", type=float, default=10.0)
    args = parser.parse_args()
    model = identified(args.device)
    print(f"| {args.device}, {args.estimator} | {' | '.join(NAMES)} |\n|---|{'---|' * len(NAMES)}")
    with TemporaryDirectory() as folder:
        for words, wrong, room_K in cases(model, round(1000 * args.seconds)):
            plant = warmer(args.device, room_K, Path(folder))
            cells = [run(args, name, model, plant, wrong) for name in NAMES]
            print(f"| {words} | {' | '.join(cells)} |", flush=True)


def cases(model: Vo2Model, samples: int) -> list[tuple[str, dict[int, float], int]]:
    """Return the words of each case, its wrong readings [ohm] by their number, and what the room is warmer by [K]."""
    draw = np.random.default_rng(SEED)
    low, high = math.log(model.resistance.low), math.log(model.resistance.high)

    def spoilt(indices: Sequence[int]) -> dict[int, float]:
        values = np.exp(draw.uniform(low, high, len(indices)))
        return dict(zip(indices, values.tolist(), strict=True))

    rows = [k for start in range(500, samples, 1000) for k in range(start, start + 10)]
    return [
        ("as identified", {}, 0),
        ("one reading in 50 wrong", spoilt(range(100, samples, 50)), 0),
        ("ten in a row wrong, each second", spoilt(rows), 0),
        *((f"room {room_K:+d} K", {}, room_K) for room_K in ROOMS_K),
    ]


def warmer(device: str, room_K: int, folder: Path) -> Path:
    """Return the file of the device in a room that is so much warmer than its own."""
    lines = bundled_plant(device).read_text(encoding="utf-8").splitlines()
    place = next(k for k, line in enumerate(lines) if line.startswith("ambient = "))
    celsius = float(lines[place].split('"')[1].split()[0])
    lines[place] = f'ambient = "{celsius + room_K:g} degC"'
    path = folder / f"{device}_{room_K}.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def run(args: argparse.Namespace, name: str, model: Vo2Model, plant: Path, wrong: dict[int, float]) -> str:
    """Return mean self-sensing and tracking error of a run [percent of the range]."""
    scenario, _ = load_scenario(
        SCENARIOS / f"{name}.toml",
        [f"estimator.kind={args.estimator}", f'scenario.duration="{args.seconds} s"'],
    )  # fmt: skip
    driver = WrongReadings(SimulatedDevice(load_plant(plant, seed=SEED)), wrong)
    signals = track(scenario, model, driver, lambda: False)[0].signals
    true, percent = signals["deflection"], 100.0 / model.deflection.width
    errors = [np.abs(signals[one] - true).mean() * percent for one in ("estimate", "setpoint")]
    return " / ".join(f"{error:.2f}" for error in errors)


if __name__ == "__main__":
    main()
