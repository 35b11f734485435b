"""A sputtered film on a cantilever with a heater of its own: what it reads, with effects and without.

What is hidden has the ids of `foreign_device.EFFECTS`; at size zero each vanishes, and several may act together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from foreign_common import Array
from foreign_device import Effect, Readings
from foreign_grain_device import follow, rows_of, size_of, substeps, with_crosstalk, with_mode
from foreign_kept_cantilever_motion import Cells, Film, Heat, resistances, warm

CREEP = (6.0, 20.0, 60.0, 180.0, 540.0)  # time constants of creep, in those of the film
SECOND_SHARE = 0.003  # of the heat, at most, by the fin's next mode
SECOND_FASTER = 8.0  # times than the first one

EQUATIONS = {
    "thermal.second_time_constant": "a share s of the heating arrives with the slower time constant tau2",
    "thermal.latent_heat": "T + s m is what the heat changes, m the electrical fraction: the transition costs s [K]",
    "thermal.ambient_drift": "T_room +- s t / T, or +- s (1 - cos(pi t / T)) / 2, t from the record's start",
    "heater.tcr": "power g i^2 (1 + s (T - T_ambient)): the heater's resistance rises",
    "actuation.delay": "the current acts s later, also by parts of a sample",
    "actuation.deadband": "'zero': i_eff = max(i - s, 0); 'hold': the source ignores changes below s",
    "hysteresis.rate_dependence": "both fractions follow their equilibrium, s dm/dt = m_eq(T) - m",
    "hysteresis.creep": "m' = (1 - s) m + s mean of m lagged by 6, 20, 60, 180, 540 tau: log-time creep",
    "sensor.self_heating": "the constant sense current adds s R/R_cold [K] to the film's final temperature",
    "sensor.lag": "the meter's reading follows R with dR_read/dt = (R - R_read)/s",
    "sensor.ageing": "R_read = R (1 +- s (1 - exp(-c t / T)) / (1 - exp(-c))): contacts that drift in each record",
    "sensor.crosstalk": "R_read = R + s i, i the current in force until the reading",
    "structure.resonance": "z'' + (w/Q) z' + w^2 z = w^2 d, w = 2 pi / s: the beam's mode follows the bending d",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class CantileverDevice:
    """All that a lab would have to know about its device."""

    ambient_C: float
    gain_C_per_mA2: float
    tau_s: float
    second_share: float
    period_s: float
    convention: str  # a row's reading: "start" or "end" of the period in which its current acts
    cells: Cells
    film: Film
    deflection_um: float  # of a whole transition
    bimorph_per_K: float  # expansion over the deflection of a whole transition, cold
    bimorph_hot: float  # the metallic phase's expansion over the cold one's
    ripple: float  # what the read-out's calibration has left, over the deflection of a whole transition
    ripple_um: float  # its period

    def bending(self, structural: Array, temperature: Array) -> Array:
        """Deflection [um] from the cold device's."""
        softer = 1.0 + (self.bimorph_hot - 1.0) * structural
        z = self.deflection_um * (structural + self.bimorph_per_K * softer * (temperature - self.ambient_C))
        return z + self.ripple * self.deflection_um * np.sin(2.0 * np.pi * z / self.ripple_um)


def simulate(device: CantileverDevice, current_mA: Array, effects: tuple[Effect, ...] = ()) -> Readings:
    """Readings of a device that was at rest, cold and without current, before the first row."""
    found, step, time, square = substeps(current_mA, device.period_s, effects)
    power = device.gain_C_per_mA2 * square
    room = np.full(time.size, device.ambient_C)
    if drift := found.get("thermal.ambient_drift"):
        place = time / time[-1]
        grown = place if drift.values["form"] == "linear" else 0.5 - 0.5 * np.cos(np.pi * place)
        room = room + drift.size * float(drift.values["sign"]) * grown
    temperature, electrical, structural = warm(
        power, room, _heat(device, found, step), device.cells, device.film
    )
    if creep := found.get("hysteresis.creep"):
        parts = np.column_stack([electrical, structural])
        slow = np.mean([follow(parts, n * device.tau_s, step) for n in CREEP], axis=0)
        electrical, structural = ((1.0 - creep.size) * parts + creep.size * slow).T
    rows = rows_of(current_mA.size, device.convention)
    read = resistances(temperature, electrical, device.film)
    if lag := found.get("sensor.lag"):
        read = follow(read, lag.size, step)
    read = read[rows]
    if age := found.get("sensor.ageing"):
        bend = float(age.values["bend"])
        aged = np.expm1(-bend * time[rows] / time[-1]) / np.expm1(-bend)
        read = read * (1.0 + age.size * float(age.values["sign"]) * aged)
    read = with_crosstalk(read, current_mA, device.convention, found)
    bending = with_mode(device.bending(structural, temperature), step, found)
    return Readings(read, bending[rows], temperature[rows])


def _heat(device: CantileverDevice, found: dict[str, Effect], step: float) -> Heat:
    late = found.get("thermal.second_time_constant")
    return Heat(
        tau=device.tau_s,
        second=device.tau_s / SECOND_FASTER,
        second_share=device.second_share,
        step=step,
        ambient=device.ambient_C,
        slow_share=size_of("thermal.second_time_constant", found),
        slow=float(late.values["tau2_s"]) if late else 1.0,
        tcr=size_of("heater.tcr", found),
        sense=size_of("sensor.self_heating", found),
        lag=size_of("hysteresis.rate_dependence", found),
        latent=size_of("thermal.latent_heat", found),
    )
