"""The film of `foreign_device`, moved one sample period a command; what is hidden may begin at any time.

With the effect there from the start the readings are those of `foreign_device.simulate`, save for a drift and an
ageing, which count from their beginning and not from each record's start. Device time goes on between records.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from math import exp, floor

import numpy as np
from foreign_device import CREEP_DECADES, SUBSTEPS, Device, Effect
from scipy.signal import cont2discrete

KEPT = 1024  # periods of current that a delay can reach back


class Lag:
    """First-order lag [any unit] with a fixed factor a step; at rest where it begins."""

    def __init__(self, tau_s: float, step_s: float, first: float) -> None:
        self._keep = exp(-step_s / tau_s) if tau_s > 0.0 else 0.0
        self.value = first

    def follow(self, target: float) -> float:
        """One step towards `target`."""
        self.value = target + (self.value - target) * self._keep
        return self.value


class Mode:
    """The beam's mode of unit static gain: z'' + (w/Q) z' + w^2 z = w^2 d, at rest where it begins."""

    def __init__(self, natural_period_s: float, quality: float, step_s: float, first: float) -> None:
        w = 2.0 * np.pi / natural_period_s
        b, a, _ = cont2discrete(([w * w], [1.0, w / quality, w * w]), step_s, method="foh")
        self._b, self._a = b.ravel().tolist(), a.tolist()
        self._first, self._x, self._z = first, [0.0, 0.0], [0.0, 0.0]

    def follow(self, bending: float) -> float:
        """One step with the bending [um] at its end."""
        x = bending - self._first
        past = self._b[1] * self._x[0] + self._b[2] * self._x[1]
        past -= self._a[1] * self._z[0] + self._a[2] * self._z[1]
        z = self._b[0] * x + past
        self._x, self._z = [x, self._x[0]], [z, self._z[0]]
        return self._first + z


class Film:
    """A device at rest, cold and without current; `hidden` acts from the device time `begin_s` on (None: never).

    `begin_s` may be set later, also by another thread; the effect begins with the next period.
    """

    def __init__(self, device: Device, hidden: Effect | None = None, begin_s: float | None = 0.0) -> None:
        self._device, self._hidden, self.begin_s = device, hidden, begin_s
        self._elapsed = 0.0  # device time [s]
        self._step = device.period_s / SUBSTEPS
        self._keep = exp(-self._step / device.tau_s)
        self._loop = device.new_loop()
        self._fast, self._slow = device.ambient_C, 0.0
        self._seen = self._loop.move(self._fast)
        self._squares: deque[float] = deque([0.0] * KEPT, KEPT)
        self._current = self._held = 0.0
        self._time: float | None = None  # since the effect began [s]
        self._edge = self._read_edge()

    def _begin(self, effect: Effect) -> None:
        """What is hidden acts from here on; what it filters is at rest."""
        self._time = 0.0
        if effect.id == "sensor.self_heating" and not any(self._squares):
            self._fast += effect.size  # the meter was on before the first current
            self._seen = self._loop.move(self._fast)
        fractions, tau = self._loop.fractions, self._device.tau_s
        self._creeping = [[Lag(n * tau, self._step, part) for n in CREEP_DECADES] for part in fractions]
        self._resistance_lag = Lag(self._size("sensor.lag"), self._step, self._resistance())
        if effect.id == "structure.resonance":
            quality = float(effect.values["quality"])
            self._mode = Mode(effect.size, quality, self._step, self._bending(fractions[1]))
        self._edge = self._read_edge()

    def advance(self, current_mA: float) -> tuple[float, float]:
        """One sample period with a current [mA]: resistance [ohm] and deflection [um], before any noise."""
        due = self.begin_s is not None and self._elapsed >= self.begin_s
        if self._hidden and due and self._time is None:
            self._begin(self._hidden)
        self._elapsed += self._device.period_s
        start, before = self._edge, self._current
        self._current = current_mA
        self._squares.append(self._acting(current_mA) ** 2)
        for k in range(SUBSTEPS):
            self._heat_up(self._mean_square(k))
            if self._time is not None:
                self._time += self._step
            self._edge = self._read_edge()
        (resistance, deflection), in_force = (
            (start, before) if self._device.convention == "start" else (self._edge, current_mA)
        )
        return resistance + self._size("sensor.crosstalk") * in_force, deflection

    def _size(self, name: str) -> float:
        effect = self._hidden
        return effect.size if effect and self._time is not None and effect.id == name else 0.0

    def _value(self, name: str, otherwise: float = 1.0) -> float:
        return float(self._hidden.values.get(name, otherwise)) if self._hidden else otherwise

    def _acting(self, current: float) -> float:
        """Current [mA] behind a dead band."""
        width = self._size("actuation.deadband")
        if width and self._hidden and self._hidden.values["form"] == "zero":
            return max(current - width, 0.0)
        if abs(current - self._held) >= width:
            self._held = current
        return self._held

    def _mean_square(self, substep: int) -> float:
        """Mean square of the current [mA^2] that acts in a substep, late by the hidden delay."""
        begin = substep / SUBSTEPS - self._size("actuation.delay") / self._device.period_s
        end = begin + 1.0 / SUBSTEPS
        first = floor(begin)
        old = self._squares[max(first - 1, -KEPT)]  # the last element is the period from 0 to 1
        share = min((first + 1 - begin) * SUBSTEPS, 1.0)
        new = self._squares[first] if end > first + 1 else old
        return old * share + new * (1.0 - share)

    def _heat_up(self, square: float) -> None:
        """One substep of the heat balance, then the transition."""
        device, step = self._device, self._step
        power = device.gain_C_per_mA2 * square
        power *= 1.0 + self._size("heater.tcr") * (self._fast + self._slow - device.ambient_C)
        grown = self._size("thermal.ambient_drift") * self._value("sign")
        final = device.ambient_C + grown * (1.0 - exp(-(self._time or 0.0) / self._value("settling_s")))
        if sense := self._size("sensor.self_heating"):
            cold = float(device.resistance(device.ambient_C, 0.0))
            final += sense * self._resistance() / cold
        share = self._size("thermal.second_time_constant")
        final += (1.0 - share) * power
        self._fast = final + (self._fast - final) * self._keep
        if share:
            self._slow = share * power + (self._slow - share * power) * exp(-step / self._value("tau2_s"))
        free, lag = self._fast + self._slow, self._size("hysteresis.rate_dependence")
        self._seen = free + (self._seen - free) * (exp(-step / lag) if lag else 0.0)
        left = self._loop.move(self._seen, self._size("thermal.latent_heat"))
        self._fast += left - self._seen
        self._seen = left

    def _fractions(self) -> Iterable[float]:
        creep = self._size("hysteresis.creep")
        if not creep:
            return self._loop.fractions
        now = zip(self._loop.fractions, self._creeping, strict=True)
        return [
            (1.0 - creep) * part + creep * sum(lag.follow(part) for lag in lags) / len(lags)
            for part, lags in now
        ]

    def _resistance(self) -> float:
        return float(self._device.resistance(self._fast + self._slow, self._loop.fractions[0]))

    def _bending(self, fraction: float) -> float:
        warmer = self._fast + self._slow - self._device.ambient_C
        return self._device.deflection_um * fraction + self._device.bimorph_um_per_K * warmer

    def _read_edge(self) -> tuple[float, float]:
        """Resistance [ohm] and deflection [um] at the end of a substep, by instruments without noise."""
        electrical, structural = self._fractions()
        resistance = float(self._device.resistance(self._fast + self._slow, electrical))
        if self._size("sensor.lag"):
            resistance = self._resistance_lag.follow(resistance)
        aged = ((self._time or 0.0) / self._value("over_s")) ** self._value("exponent")
        deflection = self._bending(structural)
        if self._size("structure.resonance"):
            deflection = self._mode.follow(deflection)
        return resistance * (1.0 + self._size("sensor.ageing") * aged), deflection
