"""The heated film once more, in tiny explicit steps, straight from the sentences of the mechanisms."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from vo2_model_cases import PERIOD_S, TAU_S, small_model

from rtctl.hysteresis.preisach.model import PreisachModel, preisach_step

STEPS = 160
"""In a sample period."""
R_COLD = 130e3


class Film:
    """A read-out that is stepped; `relays` is the part of its output that has memory."""

    def __init__(self, model: PreisachModel) -> None:
        self.model, self.params, self.state = model, model.params, model.initial_state(0.0)
        self.y = self.relays = 0.0

    def at(self, v: float) -> float:
        self.y = preisach_step(self.state, v, self.params).y
        self.relays = self.y - self.model.c - v * (self.model.c1 + self.model.c2 * v)
        return self.y


class Dense(NamedTuple):
    """Every tiny step (samples * STEPS - STEPS + 1,): -ln R, deflection, v [mA], relays of both read-outs."""

    reading: np.ndarray
    deflection: np.ndarray
    v: np.ndarray
    reading_relays: np.ndarray
    deflection_relays: np.ndarray


def dense(
    current: np.ndarray,
    *,
    tcr: float = 0.0,
    loss: float = 0.0,
    share: float = 0.0,
    slow_s: float = 1.0,
    latent: float = 0.0,
    own: float = 0.0,
    known: float = 1.0,
    lag_s: float = 0.0,
    activation: float = 0.0,
    expansion: float = 0.0,
    mixing: float = 0.0,
    drift: float = 0.0,
    settling_s: float = math.inf,
    late: int = 0,
    zone: float = 0.0,
    cooling: float = 0.0,
    sharpness: float = 0.0,
    film_heat: float = 0.0,
    back: float = 0.0,
) -> Dense:
    """A held current (samples,); `late` in tiny steps; the first `zone` [mA] of it does not heat. The loops hold a
    backlash of half width `back` [mA].
    """
    current = np.maximum(current - zone, 0.0)
    model, dt = small_model(), PERIOD_S / STEPS
    film, beam = Film(model.resistance_preisach), Film(model.deflection_preisach)
    mass = float(model.deflection_preisach.mu.sum())
    film_mass = float(model.resistance_preisach.mu.sum())
    held = np.repeat(current[:-1], STEPS)
    held = np.concatenate((np.full(late, current[0]), held))[: len(held)]
    p = current[0] ** 2

    def cold_share(s: float) -> float:
        v = zone + np.sqrt(s)
        return float(np.exp(-Film(model.resistance_preisach).at(v))) / R_COLD

    def temperature(s: float) -> float:
        return float(brentq(lambda x: x * (1 + known * loss * x) / (1 + known * tcr * x) - s, 0.0, 500.0))

    metal, cold = 1 / model.resistance.low, 1 / model.resistance.high
    coldest = temperature(model.current.low**2)

    def of_the_mixture(y: float, seen: float, T: float) -> float:
        """-ln R at T of a film whose metal is that of y and `seen`: conductances to the power n, or logarithms, add."""
        then, now = (cold * np.exp(activation * (x - coldest)) for x in (seen, T))
        if mixing == 0.0:
            share = (y - np.log(then)) / np.log(metal / then)
            return float((1 - share) * np.log(now) + share * np.log(metal))
        share = (np.exp(y) ** mixing - then**mixing) / (metal**mixing - then**mixing)
        return float(np.log((1 - share) * now**mixing + share * metal**mixing) / mixing)

    def gained(x: float) -> float:
        extra = (1 - known) * own * cold_share(x) if own and known < 1 else 0.0
        return float(p * (1 + tcr * x) - x - loss * x * x + extra)

    T = float(brentq(gained, 0.0, 500.0))
    main = second = T
    lagged = None
    turned, way = 0.0, 1.0
    stored, rows = None, []
    before, phase_before, capacity = T, 0.0, 1.0
    slow = np.exp(-dt / slow_s)
    for k in range(len(held) + 1):
        passed = k * dt if settling_s == math.inf else settling_s * (1.0 - math.exp(-k * dt / settling_s))
        warm = T + drift * passed
        lagged = warm if lagged is None else (warm + (lagged - warm) * np.exp(-dt / lag_s) if lag_s else warm)
        v, seen = (zone + np.sqrt(x * (1 + known * loss * x) / (1 + known * tcr * x)) for x in (warm, lagged))
        way = way if abs(seen - turned) < 1e-12 else float(np.sign(seen - turned))
        turned = seen
        film.at(seen + way * back)
        beam.at(seen + way * back)
        ahead = warm - lagged
        reading = of_the_mixture(film.y, warm - ahead, warm)
        rows.append((reading, beam.y - expansion * ahead, v, film.relays, beam.relays))
        if k == len(held):
            break
        share_of_cold = np.exp(-film.y) / R_COLD
        now = latent * beam.relays / mass + film_heat * film.relays / film_mass + known * own * share_of_cold
        released = 0.0 if stored is None else now - stored
        stored = now
        p = held[k] ** 2
        target = p * (1 + tcr * T) - loss * T * T + (1 - known) * own * share_of_cold
        phase = beam.relays / mass
        if sharpness and k and abs(T - before) > 1e-12:
            capacity = 1 + sharpness * ((phase - phase_before) / (T - before)) ** 2
        before, phase_before = T, phase
        longer = 1 + cooling if target < main else 1
        main = target + (main - target) * np.exp(-dt / (TAU_S * longer * capacity)) - released
        second = target + (second - target) * slow
        T = (1 - share) * main + share * second
    return Dense(*(np.array(column) for column in zip(*rows, strict=True)))


def heated_by_phase(current: np.ndarray, growth: float, known: float) -> Dense:
    """A held current (samples,) whose power grows by `growth` phi; the film's true temperature is the state.

    Loops that know of it are at the current that holds this temperature at this phase.
    """
    model, dt = small_model(), PERIOD_S / STEPS
    film, beam = Film(model.resistance_preisach), Film(model.deflection_preisach)
    mass = float(model.resistance_preisach.mu.sum())
    power = np.repeat(current, STEPS)[: (len(current) - 1) * STEPS + 1] ** 2

    def beyond(s: float) -> float:
        tried = Film(model.resistance_preisach)
        tried.at(np.sqrt(s))
        return float(power[0] * (1 + (1 - known) * growth * tried.relays / mass) - s)

    s = float(brentq(beyond, 0.1, 500.0))
    film.at(np.sqrt(s))
    T, rows = s * (1 + known * growth * film.relays / mass), []
    for p in power:
        s = T / (1 + known * growth * film.relays / mass)
        rows.append((film.at(np.sqrt(s)), beam.at(np.sqrt(s)), np.sqrt(s), film.relays, beam.relays))
        target = p * (1 + growth * film.relays / mass)
        T = target + (T - target) * np.exp(-dt / TAU_S)
    return Dense(*(np.array(column) for column in zip(*rows, strict=True)))
