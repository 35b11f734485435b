"""A film on a beam, heated by a current: tau dT/dt = T_ambient + g i^2 - T, then loop, resistance, bending.

Every hidden effect is one line of `simulate`; at size zero each of them vanishes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import exp
from typing import NamedTuple

import numpy as np
from foreign_loops import Array, DomainLoop, SmoothLoop
from scipy.signal import cont2discrete, lfilter

SUBSTEPS = 4  # a sample period; the current is constant in each
CREEP_DECADES = (10.0, 30.0, 100.0, 300.0)  # time constants of creep, in those of the film

EFFECTS: dict[str, str] = {
    "thermal.second_time_constant": "a share a of the heating arrives with the slower time constant tau2",
    "thermal.latent_heat": "tau dT/dt = ... - L tau dm/dt: enthalpy T + L m is what the heat changes",
    "thermal.ambient_drift": "T_ambient(t) = T_ambient +- A (1 - exp(-t/t_d)), t from the record's start",
    "heater.tcr": "power g i^2 (1 + alpha (T - T_ambient)): the heater's resistance rises",
    "actuation.delay": "the current acts d later, also by parts of a sample",
    "actuation.deadband": "'zero': i_eff = max(i - d, 0); 'hold': the source ignores changes below d",
    "hysteresis.rate_dependence": "the loop sees T_h, tau_h dT_h/dt = T - T_h; expansion and carriers see T",
    "hysteresis.creep": "m' = (1 - c) m + c mean of m lagged by 10, 30, 100, 300 tau: log-time creep",
    "sensor.self_heating": "the constant sense current adds s R/R_cold [K] to the film's final temperature",
    "sensor.lag": "the meter's reading follows R with dR_read/dt = (R - R_read)/tau_s",
    "sensor.ageing": "R_read = R (1 + a (t/T_record)^p): contacts that drift in each record",
    "sensor.crosstalk": "R_read = R + k i, i the current in force until the reading",
    "structure.resonance": "z'' + (w/Q) z' + w^2 z = w^2 d: the beam's mode follows the bending d",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """One hidden effect: its id, its size in `unit`, and the numbers or words beside the size."""

    id: str
    size: float
    unit: str
    values: dict[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Device:
    """All that a lab would have to know about its device."""

    ambient_C: float
    gain_C_per_mA2: float
    tau_s: float
    period_s: float
    convention: str  # a row's reading: "start" or "end" of the period in which its current acts
    new_loop: Callable[[], DomainLoop | SmoothLoop]
    mixing: str  # bruggeman | lichtenecker | series | percolation
    mixing_number: float  # dimensions of the effective medium; exponent of the percolation
    semiconductor_ohm: float  # at 25 °C
    activation_K: float
    metal_ohm: float
    deflection_um: float
    bimorph_um_per_K: float

    def resistance(self, temperature: Array | float, metallic: Array | float) -> Array:
        """Resistance [ohm] at `temperature` [°C] with a metallic fraction [1]."""
        kelvin = np.asarray(temperature) + 273.15
        semi = self.semiconductor_ohm * np.exp(self.activation_K * (1.0 / kelvin - 1.0 / 298.15))
        m = np.clip(metallic, 0.0, 1.0)
        if self.mixing == "lichtenecker":
            return np.exp((1.0 - m) * np.log(semi) + m * np.log(self.metal_ohm))
        if self.mixing == "series":
            return semi * (1.0 - m) + self.metal_ohm
        s, c = 1.0 / semi, 1.0 / self.metal_ohm
        if self.mixing == "percolation":
            return 1.0 / (s + (c - s) * m**self.mixing_number)
        d = self.mixing_number
        b = (d * m - 1.0) * c + (d * (1.0 - m) - 1.0) * s
        return 2.0 * (d - 1.0) / (b + np.sqrt(b * b + 4.0 * (d - 1.0) * c * s))


class Readings(NamedTuple):
    """Of each row, before any noise: resistance [ohm], deflection [um], film temperature [°C]."""

    resistance: Array
    deflection: Array
    temperature: Array


def acting_square(current: Array, period: float, effect: Effect | None) -> Array:
    """Mean square of the current [mA^2] that acts in each of the substeps."""
    if effect and effect.id == "actuation.deadband":
        if effect.values["form"] == "zero":
            current = np.maximum(current - effect.size, 0.0)
        else:
            held, kept = 0.0, np.empty_like(current)
            for k, wanted in enumerate(current.tolist()):
                held = wanted if abs(wanted - held) >= effect.size else held
                kept[k] = held
            current = kept
    late = effect.size / period if effect and effect.id == "actuation.delay" else 0.0
    energy = np.concatenate([[0.0], np.cumsum(current**2)])
    edges = np.arange(current.size * SUBSTEPS + 1) / SUBSTEPS - late
    return np.diff(np.interp(edges, np.arange(energy.size), energy)) * SUBSTEPS


def lagged(signal: Array, tau: float, step: float) -> Array:
    """First-order lag of `signal`, at rest at its first value; `tau` and `step` in seconds."""
    if tau <= 0.0:
        return signal
    a = exp(-step / tau)
    return signal[0] + lfilter([1.0 - a], [1.0, -a], signal - signal[0])


def ringing(signal: Array, natural_period: float, quality: float, step: float) -> Array:
    """Response of a mode with unit static gain; `natural_period` and `step` in seconds."""
    if natural_period <= 0.0:
        return signal
    w = 2.0 * np.pi / natural_period
    b, a, _ = cont2discrete(([w * w], [1.0, w / quality, w * w]), step, method="foh")
    return signal[0] + lfilter(b.ravel(), a, signal - signal[0])


def simulate(device: Device, current_mA: Array, effect: Effect | None = None) -> Readings:
    """Readings of a device that was at rest, cold and without current, before the first row."""

    def size(name: str) -> float:
        return effect.size if effect and effect.id == name else 0.0

    def value(name: str, otherwise: float) -> float:
        return float(effect.values.get(name, otherwise)) if effect else otherwise

    step = device.period_s / SUBSTEPS
    heat = device.gain_C_per_mA2 * acting_square(current_mA, device.period_s, effect)
    time = np.arange(heat.size + 1) * step
    drift = size("thermal.ambient_drift") * value("sign", 1.0)
    drift = drift * (1.0 - np.exp(-time[:-1] / value("settling_s", 1.0)))
    film, fractions = _heat_up(device, heat, device.ambient_C + drift, size, value, step)

    creep = size("hysteresis.creep")
    if creep:
        slow = [np.apply_along_axis(lagged, 0, fractions, n * device.tau_s, step) for n in CREEP_DECADES]
        fractions = (1.0 - creep) * fractions + creep * np.mean(slow, axis=0)
    resistance = lagged(device.resistance(film, fractions[:, 0]), size("sensor.lag"), step)
    bending = device.deflection_um * fractions[:, 1] + device.bimorph_um_per_K * (film - device.ambient_C)
    bending = ringing(bending, size("structure.resonance"), value("quality", 10.0), step)

    first = 0 if device.convention == "start" else SUBSTEPS
    rows = first + SUBSTEPS * np.arange(current_mA.size)
    ageing = size("sensor.ageing") * (time[rows] / time[-1]) ** value("exponent", 1.0)
    in_force = current_mA if first else np.concatenate([[0.0], current_mA[:-1]])
    read = resistance[rows] * (1.0 + ageing) + size("sensor.crosstalk") * in_force
    return Readings(read, bending[rows], film[rows])


def _heat_up(
    device: Device,
    heat: Array,
    ambient: Array,
    size: Callable[[str], float],
    value: Callable[[str, float], float],
    step: float,
) -> tuple[Array, Array]:
    """Temperature of the film [°C] and both metallic fractions at each substep's edge."""
    share, latent = size("thermal.second_time_constant"), size("thermal.latent_heat")
    alpha, sense = size("heater.tcr"), size("sensor.self_heating")
    lag = size("hysteresis.rate_dependence")
    keep = exp(-step / device.tau_s)
    keep_slow = exp(-step / value("tau2_s", 1.0)) if share else 0.0
    keep_seen = exp(-step / lag) if lag else 0.0

    loop = device.new_loop()
    cold = float(device.resistance(device.ambient_C, 0.0))
    fast, slow = float(ambient[0]) + sense, 0.0
    seen = loop.move(fast)
    rows = [(fast, *loop.fractions)]
    for power, room in zip(heat.tolist(), ambient.tolist(), strict=True):
        power *= 1.0 + alpha * (fast + slow - device.ambient_C)
        read = sense * float(device.resistance(fast + slow, rows[-1][1])) / cold if sense else 0.0
        final = room + (1.0 - share) * power + read
        fast = final + (fast - final) * keep
        slow = share * power + (slow - share * power) * keep_slow
        free = fast + slow
        seen = free + (seen - free) * keep_seen
        left = loop.move(seen, latent)
        if latent:
            fast += left - seen
            seen = left
        rows.append((fast + slow, *loop.fractions))
    table = np.array(rows)
    return table[:, 0], table[:, 1:]
