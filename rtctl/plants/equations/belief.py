"""How far a filter believes a user's equations: from a motion that the equations themselves make.

Each state is believed to a share of its swing over the time in which it moves through that swing: the spectral density
of what its rate misses is share^2 (RMS of the state) (RMS of its rate) in a motion under random commands.
"""

from __future__ import annotations

import math

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.equations.controlled import StateSpace
from rtctl.border.errors import InputError
from rtctl.estimators.cubature import FilterSettings
from rtctl.estimators.equations.flow import move, sides_at
from rtctl.estimators.equations.rest import STEP_SHARE, rates_of, state_at_rest

MODEL_ERROR = 0.02
"""Share of its swing to which a state is believed."""
START_ERROR = MODEL_ERROR
"""Standard deviation of a state at the start, where the device rests, as a share of its swing."""
KNOWN = 1e-9
"""The same of a state that events alone change."""
LEAST_NOISE = 1e-3
"""Noise of a reading for which the model file states none, as a share of the reading's swing."""
HOLDS, SAMPLES = 40, 8
"""Random commands of the motion, and samples of each."""
MOST_STEPS = 200_000
"""Steps of the motion, most: a model with rates further apart is moved for less than its slowest one needs."""


def filter_settings(model: StateSpace) -> FilterSettings:
    """Return what a filter believes. Raises InputError where the equations move nowhere."""
    fastest, slowest = rates_of(model)
    x, rates, readings = _motion(model, fastest, slowest)
    if not np.isfinite(x).all():
        raise InputError('estimator.kind = "kalman": the equations diverge under random commands')
    swing = np.maximum(x.std(axis=0), 1e-9 * np.maximum(np.abs(x).max(axis=0), 1e-12))
    speed = np.sqrt((rates**2).mean(axis=0))
    spread = np.maximum(readings.std(axis=0), 1e-12)
    noise = np.where(model.noise > 0.0, model.noise, LEAST_NOISE * spread)
    return FilterSettings(
        start=np.where(model.switched, KNOWN, START_ERROR) * swing,
        drift=MODEL_ERROR**2 * swing * speed,
        noise=noise,
        step_s=STEP_SHARE / fastest,
    )


def _motion(model: StateSpace, fastest: float, slowest: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return states (m, n), rates (m, n) and readings (m, readings) under random commands between their limits."""
    rng, width = np.random.default_rng(0), len(model.profile.commands)
    bounds = model.command_range
    hold_s = min(3.0 / slowest, STEP_SHARE * MOST_STEPS / HOLDS / fastest)
    steps = max(1, math.ceil(hold_s / SAMPLES * fastest / STEP_SHARE))
    x = state_at_rest(model, (0.0,) * width)[None].copy()
    sides = sides_at(model, x, (0.0,) * width)
    states, rates, readings = [], [], []
    for _ in range(HOLDS):
        levels = rng.uniform(bounds[:, 0], bounds[:, 1]).tolist()
        for _ in range(SAMPLES):
            move(model, x, sides, levels, hold_s / SAMPLES / steps, steps)
            states.append(x[0].copy())
            rates.append(model.rates(x, levels)[0])
            readings.append(model.readings(x, levels)[0])
    return np.array(states), np.array(rates), np.array(readings)
