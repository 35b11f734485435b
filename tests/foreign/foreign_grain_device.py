"""A film of grains on a ribbon or a buckled bridge, heated by a current: what it reads, with effects and without.

The film is the second layer of the thermal path; the first is so fast that nobody would see it. What is hidden has the
ids of `foreign_device.EFFECTS`; at size zero each of them vanishes, and several may act together.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from foreign_common import Array
from foreign_device import Effect, Readings
from foreign_grain_motion import Film, Grains, Heat, heat_up, resistances
from scipy.signal import cont2discrete, lfilter

SUBSTEPS = 6  # a sample period; the current is constant in each
CREEP = (8.0, 25.0, 80.0, 250.0)  # time constants of creep, in those of the film
LAYER_MOST = 0.001  # of the film's time constant: the first layer's

EQUATIONS = {
    "thermal.second_time_constant": "a share s of the heating arrives with the slower time constant tau2",
    "thermal.latent_heat": "each grain that turns takes its share of s [K] from the film, and gives it back",
    "thermal.ambient_drift": "T_room(t) = T_room +- s (1 - exp(-t/t_d)) / (1 - exp(-T/t_d)), t from the record's start",
    "heater.tcr": "power g i^2 (1 + s (T - T_ambient)): the heater's resistance rises",
    "actuation.delay": "the current acts s later, also by parts of a sample",
    "actuation.deadband": "'zero': i_eff = max(i - s, 0); 'hold': the source ignores changes below s",
    "hysteresis.rate_dependence": "the grains see T_h, s dT_h/dt = T - T_h; expansion and carriers see T",
    "hysteresis.creep": "m' = (1 - s) m + s mean of m lagged by 8, 25, 80, 250 tau: log-time creep",
    "sensor.self_heating": "the constant sense current adds s R/R_cold [K] to the film's final temperature",
    "sensor.lag": "the meter's reading follows R with dR_read/dt = (R - R_read)/s",
    "sensor.ageing": "R_read = R (1 +- s ln(1 + t/t_a) / ln(1 + T/t_a)): contacts that drift in each record",
    "sensor.crosstalk": "R_read = R + s i, i the current in force until the reading",
    "structure.resonance": "z'' + (w/Q) z' + w^2 z = w^2 d, w = 2 pi / s: the beam's mode follows the bending d",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class GrainDevice:
    """All that a lab would have to know about its device."""

    ambient_C: float
    gain_C_per_mA2: float
    tau_s: float
    layer_s: float
    period_s: float
    convention: str  # a row's reading: "start" or "end" of the period in which its current acts
    grains: Grains
    profile: Array  # warmth of each column over the mean [1]
    coupling_K: float
    film: Film
    deflection_um: float
    bimorph_per_K: float  # over the deflection of a whole transition
    buckling: float  # 0: bends in proportion

    def bending(self, structural: Array, temperature: Array) -> Array:
        """Deflection [um] from the cold device's."""
        x = structural + self.bimorph_per_K * (temperature - self.ambient_C)
        if self.buckling == 0.0:
            return self.deflection_um * x
        rise = np.sqrt(1.0 + self.buckling * x) - 1.0
        return self.deflection_um * rise / (sqrt(1.0 + self.buckling) - 1.0)


def make_grains(
    ambient: float, up: Array, down: Array, warmth: Array, column: Array, electrical: Array, bends: Array
) -> Grains:
    """Grains in the order that the kernel needs; thresholds in °C, `warmth` of each column."""
    profile = warmth[column]
    order = np.argsort(ambient + (up - ambient) / profile, kind="stable")
    up, down, profile, column = up[order], down[order], profile[order], column[order]
    electrical, bends = electrical[order], bends[order]
    whole = np.bincount(column, electrical, warmth.size)
    return Grains(
        up=up,
        down=down,
        profile=profile,
        falling=np.argsort(-(ambient + (down - ambient) / profile), kind="stable"),
        column=column,
        in_column=electrical / whole[column],
        electrical=electrical / electrical.sum(),
        bends=bends / bends.sum(),
    )


def acting_square(current: Array, period: float, found: dict[str, Effect]) -> Array:
    """Mean square of the current [mA^2] that acts in each of the substeps."""
    band = found.get("actuation.deadband")
    if band and band.values["form"] == "zero":
        current = np.maximum(current - band.size, 0.0)
    elif band:
        held, kept = 0.0, np.empty_like(current)
        for k, wanted in enumerate(current.tolist()):
            held = wanted if abs(wanted - held) >= band.size else held
            kept[k] = held
        current = kept
    late = found["actuation.delay"].size / period if "actuation.delay" in found else 0.0
    energy = np.concatenate([[0.0], np.cumsum(current**2)])
    edges = np.arange(current.size * SUBSTEPS + 1) / SUBSTEPS - late
    return np.diff(np.interp(edges, np.arange(energy.size), energy)) * SUBSTEPS


def substeps(
    current_mA: Array, period_s: float, effects: tuple[Effect, ...]
) -> tuple[dict[str, Effect], float, Array, Array]:
    """The effects that act, by id; the substep [s]; times [s] of all edges; mean square [mA^2] that acts between."""
    found = {effect.id: effect for effect in effects if effect.size != 0.0}
    step = period_s / SUBSTEPS
    square = acting_square(current_mA, period_s, found)
    return found, step, np.arange(square.size + 1) * step, square


def rows_of(samples: int, convention: str) -> Array:
    """Numbers of the edges at which the rows are read."""
    return (0 if convention == "start" else SUBSTEPS) + SUBSTEPS * np.arange(samples)


def size_of(name: str, found: dict[str, Effect]) -> float:
    """Size of an effect, 0 if it is not there."""
    return found[name].size if name in found else 0.0


def with_crosstalk(read: Array, current_mA: Array, convention: str, found: dict[str, Effect]) -> Array:
    """Resistance [ohm] of the rows with what the current in force until the reading adds."""
    leak = found.get("sensor.crosstalk")
    if not leak:
        return read
    in_force = np.concatenate([[0.0], current_mA[:-1]]) if convention == "start" else current_mA
    return read + leak.size * in_force


def with_mode(bending: Array, step: float, found: dict[str, Effect]) -> Array:
    """Deflection [um] at all edges, of a beam whose mode follows the bending."""
    mode = found.get("structure.resonance")
    return ring(bending, mode.size, float(mode.values["quality"]), step) if mode else bending


def follow(signal: Array, tau: float, step: float) -> Array:
    """First-order lag along the first axis, at rest at the first value; `tau` and `step` in seconds."""
    a = np.exp(-step / tau)
    return signal[0] + lfilter([1.0 - a], [1.0, -a], signal - signal[0], axis=0)


def ring(signal: Array, natural_period: float, quality: float, step: float) -> Array:
    """Response of a mode with unit static gain; `natural_period` and `step` in seconds."""
    w = 2.0 * np.pi / natural_period
    b, a, _ = cont2discrete(([w * w], [1.0, w / quality, w * w]), step, method="foh")
    return signal[0] + lfilter(b.ravel(), a, signal - signal[0])


def simulate(device: GrainDevice, current_mA: Array, effects: tuple[Effect, ...] = ()) -> Readings:
    """Readings of a device that was at rest, cold and without current, before the first row."""
    found, step, time, square = substeps(current_mA, device.period_s, effects)
    power = device.gain_C_per_mA2 * square
    room = np.full(time.size, device.ambient_C)
    if drift := found.get("thermal.ambient_drift"):
        grown = 1.0 - np.exp(-time / drift.values["settling_s"])
        room = room + drift.size * drift.values["sign"] * grown / grown[-1]
    temperature, parts = heat_up(
        power, room, _heat(device, found, step), device.grains, device.profile, device.film
    )
    if creep := found.get("hysteresis.creep"):
        slow = np.mean([follow(parts, n * device.tau_s, step) for n in CREEP], axis=0)
        parts = (1.0 - creep.size) * parts + creep.size * slow

    rows = rows_of(current_mA.size, device.convention)
    if lag := found.get("sensor.lag"):
        read = resistances(temperature, room, parts[:, 2:], device.profile, device.film)
        read = follow(read, lag.size, step)[rows]
    else:
        read = resistances(temperature[rows], room[rows], parts[rows, 2:], device.profile, device.film)
    if age := found.get("sensor.ageing"):
        start = float(age.values["start"]) * time[-1]
        aged = np.log1p(time[rows] / start) / np.log1p(time[-1] / start)
        read = read * (1.0 + age.size * age.values["sign"] * aged)
    read = with_crosstalk(read, current_mA, device.convention, found)
    bending = with_mode(device.bending(parts[:, 1], temperature), step, found)
    return Readings(read, bending[rows], temperature[rows])


def _heat(device: GrainDevice, found: dict[str, Effect], step: float) -> Heat:
    second = found.get("thermal.second_time_constant")
    return Heat(
        tau=device.tau_s,
        layer=device.layer_s,
        step=step,
        ambient=device.ambient_C,
        coupling=device.coupling_K,
        slow_share=second.size if second else 0.0,
        slow=float(second.values["tau2_s"]) if second else 1.0,
        tcr=size_of("heater.tcr", found),
        sense=size_of("sensor.self_heating", found),
        lag=size_of("hysteresis.rate_dependence", found),
        latent=size_of("thermal.latent_heat", found),
    )
