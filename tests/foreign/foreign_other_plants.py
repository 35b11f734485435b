"""Plants that are no single oscillator, measured by somebody who takes them for one.

python tests/foreign/foreign_other_plants.py --plant two_tanks --seed 3 --out DIR

DIR/dataset.toml says `plant = "oscillator"`. Every right-hand side is of a text book or of a published benchmark, and
all sizes are drawn. Nothing here looks at the program that is asked, but its author knows it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from math import exp, sin, sqrt
from pathlib import Path

import numpy as np
from foreign_common import Array, log_uniform

STEPS = 10  # of the integration, a sample
SAMPLES = 1500
USES = ("fit", "fit", "test")
Rates = Callable[[list[float], float], list[float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plant:
    """A plant at drawn sizes."""

    rates: Rates  # of the states, at the states and the drive
    read: Callable[[list[float], float], float]  # what the sensor shows of states and drive
    start: list[float]
    low: float  # of the drive
    high: float
    time_s: float  # its slowest one
    units: tuple[str, str]  # of drive and reading
    limits: tuple[float, ...] = ()  # above which a state overflows


def two_tanks(rng: np.random.Generator) -> Plant:
    """One above the other (Schoukens and others, 2016): outflow by the root of the level; half of them overflow."""
    outflow, leak, pump = log_uniform(rng, 0.03, 0.3), rng.uniform(0.8, 1.3), log_uniform(rng, 0.03, 0.3)
    top = (pump / outflow) ** 2
    limits = (0.8 * top, 0.8 * top / leak**2) if rng.uniform() < 0.5 else ()

    def rates(x: list[float], u: float) -> list[float]:
        first, second = outflow * sqrt(max(x[0], 0.0)), leak * outflow * sqrt(max(x[1], 0.0))
        return [pump * u - first, first - second]

    return Plant(
        rates=rates, read=lambda x, u: x[1], start=[0.3 * top, 0.3 * top / leak**2], low=0.2, high=1.0,
        time_s=2.0 * sqrt(top) / outflow, units=("V", "cm"), limits=limits,
    )  # fmt: skip


def radiating_plate(rng: np.random.Generator) -> Plant:
    """Heated from outside, cooled by air and by radiation, read by a thermocouple in a sheath."""
    mass, air, sheath = log_uniform(rng, 30.0, 300.0), rng.uniform(0.02, 0.1), log_uniform(rng, 2.0, 30.0)
    area, ambient, power = rng.uniform(0.005, 0.02), 293.0, rng.uniform(60.0, 200.0)

    def rates(x: list[float], u: float) -> list[float]:
        lost = air * (x[0] - ambient) + 5.67e-8 * area * (x[0] ** 4 - ambient**4)
        return [(power * u - lost) / mass, (x[0] - x[1]) / sheath]

    return Plant(
        rates=rates, read=lambda x, u: x[1] - ambient, start=[ambient, ambient], low=0.0, high=1.0,
        time_s=mass / (air + 4 * 5.67e-8 * area * 420.0**3), units=("V", "K"),
    )  # fmt: skip


def diode_clamp(rng: np.random.Generator) -> Plant:
    """A capacitor behind a resistor, with a diode to ground."""
    time, knee, leak = log_uniform(rng, 1e-4, 1e-2), rng.uniform(0.04, 0.09), log_uniform(rng, 1e-6, 1e-4)

    def rates(x: list[float], u: float) -> list[float]:
        return [(u - x[0] - leak * (exp(min(x[0] / knee, 40.0)) - 1.0)) / time]

    return Plant(
        rates=rates, read=lambda x, u: x[0], start=[0.0], low=-2.0, high=2.0, time_s=time, units=("V", "V")
    )


def stirred_reactor(rng: np.random.Generator) -> Plant:
    """Van de Vusse's reactions, isothermal: concentration of B by the dilution rate, against it at first."""
    one, two, three = (
        50.0 * rng.uniform(0.8, 1.2),
        100.0 * rng.uniform(0.8, 1.2),
        10.0 * rng.uniform(0.8, 1.2),
    )

    def rates(x: list[float], u: float) -> list[float]:
        return [
            -one * x[0] - three * x[0] ** 2 + u * (10.0 - x[0]),
            one * x[0] - two * x[1] - u * x[1],
        ]

    return Plant(
        rates=rates, read=lambda x, u: x[1], start=[3.0, 1.117], low=5.0, high=80.0, time_s=0.02,
        units=("1/h", "V"),
    )  # fmt: skip


def belt_drives(rng: np.random.Generator) -> Plant:
    """Two motors, a belt and a pulley whose speed a counter shows without its sign (Wigren and Schoukens, 2017)."""
    motor, pulley = log_uniform(rng, 0.1, 0.5), log_uniform(rng, 0.05, 0.2)
    stiff, loss = log_uniform(rng, 100.0, 600.0), rng.uniform(3.0, 12.0)

    def rates(x: list[float], u: float) -> list[float]:
        return [(u - x[0]) / motor, x[2], stiff * (x[0] - x[1]) - loss * x[2] - pulley * x[2]]

    return Plant(
        rates=rates, read=lambda x, u: abs(x[1]), start=[0.0, 0.0, 0.0], low=-1.0, high=1.0, time_s=3 * motor,
        units=("V", "V"),
    )  # fmt: skip


def propeller_arm(rng: np.random.Generator) -> Plant:
    """An arm with a propeller: a rotor that lags, thrust by its speed squared, gravity by the sine of the angle."""
    rotor, gravity = log_uniform(rng, 0.05, 0.3), log_uniform(rng, 10.0, 60.0)
    damping, thrust = rng.uniform(0.2, 1.0) * sqrt(gravity), rng.uniform(0.3, 0.7) * gravity

    def rates(x: list[float], u: float) -> list[float]:
        return [(u - x[0]) / rotor, x[2], thrust * x[0] * abs(x[0]) - gravity * sin(x[1]) - damping * x[2]]

    return Plant(
        rates=rates, read=lambda x, u: x[1], start=[0.0, 0.0, 0.0], low=0.1, high=1.0,
        time_s=6.0 / sqrt(gravity), units=("V", "rad"),
    )  # fmt: skip


def piezo_stack(rng: np.random.Generator) -> Plant:
    """Slow motions of a stack: an asymmetric hysteresis of several plays behind an amplifier with a pole, and creep."""
    widths = np.linspace(0.02, 0.4, 8)
    weights = rng.uniform(0.5, 1.0) * 0.05 * np.exp(-widths / 0.2)
    bend, creep, pole = rng.uniform(-0.15, 0.15), rng.uniform(0.02, 0.06), 0.01
    plays = np.zeros(len(widths))

    def rates(x: list[float], u: float) -> list[float]:
        return [(u - x[0]) / pole, (x[0] - x[1]) / 5.0]

    def read(x: list[float], u: float) -> float:
        np.copyto(plays, np.clip(plays, x[0] - widths, x[0] + widths))
        return 10.0 * (x[0] + bend * x[0] ** 2 + float(weights @ plays) * 8.0 + creep * x[1])

    return Plant(rates=rates, read=read, start=[0.0, 0.0], low=0.0, high=1.0, time_s=1.0, units=("V", "um"))


def motor_speed(rng: np.random.Generator) -> Plant:
    """Speed of a motor: inductance, inertia, bearing friction that holds it still below a voltage."""
    electric, mechanic = log_uniform(rng, 2e-3, 2e-2), log_uniform(rng, 0.05, 0.3)
    friction = rng.uniform(0.1, 0.25)

    def rates(x: list[float], u: float) -> list[float]:
        return [(u - x[0]) / electric, (x[0] - x[1] - friction * np.tanh(200.0 * x[1])) / mechanic]

    return Plant(
        rates=rates, read=lambda x, u: 100.0 * x[1], start=[0.0, 0.0], low=-1.0, high=1.0, time_s=mechanic,
        units=("V", "rad/s"),
    )  # fmt: skip


PLANTS: dict[str, Callable[[np.random.Generator], Plant]] = {
    one.__name__: one
    for one in (
        two_tanks, radiating_plate, diode_clamp, stirred_reactor,
        belt_drives, propeller_arm, piezo_stack, motor_speed,
    )
}  # fmt: skip
TRUE = {
    "propeller_arm": {"stiffness.gravity", "drive.lag", "drive.harmonics"},
    "piezo_stack": {"hysteresis.bouc_wen", "friction.presliding", "stiffness.viscoelastic"},
    "motor_speed": {"drive.lag", "drive.deadband", "friction.coulomb"},
    "belt_drives": {"drive.lag", "mode.second"},
    "radiating_plate": {"sensor.lag", "stiffness.quadratic", "stiffness.cubic"},
    "diode_clamp": {"stop.one_sided"},
}
"""Causes that are true of a plant in the coordinates of an oscillator, by the catalogue's ids: the loss of a plate
grows with its temperature as a hardening spring's force does, and a diode acts above a place."""


def simulate(plant: Plant, drive: Array, period_s: float) -> Array:
    """Readings (samples,) of a drive (samples,) that is held, by Runge and Kutta's fourth-order steps."""
    state, step, readings = list(plant.start), period_s / STEPS, []
    for u in drive.tolist():
        readings.append(plant.read(state, u))
        for _ in range(STEPS):
            one = plant.rates(state, u)
            two = plant.rates([x + 0.5 * step * k for x, k in zip(state, one, strict=True)], u)
            three = plant.rates([x + 0.5 * step * k for x, k in zip(state, two, strict=True)], u)
            four = plant.rates([x + step * k for x, k in zip(state, three, strict=True)], u)
            ways = zip(state, one, two, three, four, strict=True)
            state = [x + step / 6.0 * (a + 2.0 * b + 2.0 * c + d) for x, a, b, c, d in ways]
            if plant.limits:
                state = [min(x, top) for x, top in zip(state, plant.limits, strict=True)]
    return np.array(readings)


def draw_drive(plant: Plant, period_s: float, rng: np.random.Generator) -> Array:
    """Levels that are held for a random while, or a smooth random course, over the drive's range (samples,)."""
    if rng.uniform() < 0.5:
        longest = max(int(1.5 * plant.time_s / period_s), 8)
        levels: list[float] = []
        while len(levels) < SAMPLES:
            levels += [rng.uniform(plant.low, plant.high)] * int(rng.integers(longest // 6 + 1, longest))
        return np.array(levels[:SAMPLES])
    t, drive = np.arange(SAMPLES) * period_s, np.zeros(SAMPLES)
    for _ in range(12):
        frequency = log_uniform(rng, 4.0 / (SAMPLES * period_s), 0.6 / plant.time_s)
        drive += np.sin(2 * np.pi * frequency * t + rng.uniform(0.0, 2 * np.pi))
    drive = np.clip(drive / 7.0, -1.0, 1.0)
    return 0.5 * (plant.low + plant.high) + 0.5 * (plant.high - plant.low) * drive


def generate(name: str, seed: int, folder: Path) -> Path:
    """Write the case to `folder`; returns the manifest's path."""
    rng = np.random.default_rng([sum(name.encode()), seed])
    plant = PLANTS[name](rng)
    period_s = float(f"{plant.time_s / rng.uniform(20.0, 50.0):.2g}")
    tables, noise = [], log_uniform(rng, 1e-3, 1e-2)
    folder.mkdir(parents=True, exist_ok=True)
    for k, use in enumerate(USES):
        drive = draw_drive(plant, period_s, rng)
        reading = simulate(plant, drive, period_s)
        reading = reading + noise * reading.std() * rng.standard_normal(SAMPLES)
        np.savetxt(
            folder / f"r{k}.csv", np.column_stack((drive, reading)), delimiter=",", fmt="%.9g",
            header="drive,displacement", comments="",
        )  # fmt: skip
        tables.append(f'[[records]]\nfile = "r{k}.csv"\nsample_rate_hz = {1 / period_s!r}\nuse = "{use}"\n')
    signals = (
        f'[signals.drive]\nrole = "input"\nunit = "{plant.units[0]}"\nhold = "zero"\n'
        f'[signals.displacement]\nrole = "output"\nunit = "{plant.units[1]}"\n'
    )
    head = f'[dataset]\nname = "{name}-{seed}"\nplant = "oscillator"\n'
    (folder / "dataset.toml").write_text(head + signals + "".join(tables), encoding="utf-8")
    return folder / "dataset.toml"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plant", choices=tuple(PLANTS), required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    print(generate(asked.plant, asked.seed, asked.out))


if __name__ == "__main__":
    main()
