"""Records of a system with an effect, by SciPy's integrator, for all records at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from rtctl.border.arrays import FloatArray

from .effects import Acting, Make, Scene
from .system import HiddenSystem

SAMPLES, RECORDS = 600, 5
FLOOR_SHARE = 0.006
"""Noise over the output's standard deviation."""
SHOWS = 12.0
"""RMS change of the output by an effect, over the noise, before anything is fitted."""
MOST_SHOWN = 2.0 * SHOWS
MOST_SIZES = 12
"""Sizes that are tried, most."""
PLAIN = Acting()


def levels(system: HiddenSystem, seed: int, samples: int) -> FloatArray:
    """Levels (samples, records) that are held for one to four times the shortest hold."""
    random = np.random.default_rng([seed, 1])
    made = np.empty((samples, RECORDS))
    for k in range(RECORDS):
        at = 0
        while at < samples:
            held = system.hold_samples * int(random.integers(1, 5))
            made[at : at + held, k] = system.input[2] + system.input[3] * random.uniform(-1.0, 1.0)
            at += held
    return made


def simulate(
    system: HiddenSystem, u: FloatArray, p: dict[str, float], acting: Acting
) -> tuple[FloatArray, FloatArray]:
    """Return output and states, (samples, records) and (samples, states, records), at the instants of the readings."""
    dt, (n, records) = system.period_s, u.shape
    shaped = acting.shape_input(dt * np.arange(n)[:, None], u)
    own, states = len(system.states), len(system.states) + 4

    def rates(t: float, flat: FloatArray, level: FloatArray) -> FloatArray:
        x = flat.reshape(states, records)
        drive = x[own] if acting.input_lag_s else level
        values = p | {name: p[name] * factor(t, x[:own], drive) for name, factor in acting.factor.items()}
        found = np.zeros((states, records))
        found[:own] = system.rates(x[:own], drive, values)
        found[acting.state] += acting.push(t, x, drive)
        if acting.slow:
            found[acting.state] -= acting.slow[0] * (x[acting.state] - x[own + 3])
            found[own + 3] = (x[acting.state] - x[own + 3]) / acting.slow[1]
        y = system.output(x[:own], drive, values)
        if acting.input_lag_s:
            found[own] = (level - x[own]) / acting.input_lag_s
        if acting.output_lag_s:
            found[own + 1] = (y - x[own + 1]) / acting.output_lag_s
        if acting.corner:
            found[own + 2] = acting.corner * (y - x[own + 2])
        return found.ravel()

    start = np.repeat(np.array(system.start)[:, None], records, axis=1)
    y0 = system.output(start, shaped[0], p)
    x = np.concatenate((start, shaped[:1], np.broadcast_to(y0, (1, records)), np.zeros((1, records)),
                        start[acting.state][None]))  # fmt: skip
    reads = dt * np.arange(n) + acting.late_s
    jumps = dt * np.arange(1, n) + acting.delay_s
    times = np.unique(np.round(np.concatenate(([min(0.0, reads[0])], reads, jumps, [0.0])), 12))
    times = times[times <= reads[-1] + 1e-12]
    kept = {0.0: x.ravel()} if reads[0] >= 0.0 else {}
    flat, t = x.ravel(), times[0]
    kept[t] = flat
    for after in times[1:]:
        place = int(np.clip(np.floor((0.5 * (t + after) - acting.delay_s) / dt + 1e-9), 0, n - 1))
        solved = solve_ivp(rates, (t, after), flat, args=(shaped[place],), rtol=1e-7, atol=1e-9)
        flat, t = solved.y[:, -1], after
        kept[t] = flat
    course = np.array([kept[round(at, 12)] for at in reads]).reshape(n, states, records)
    before = shaped[np.clip(np.arange(n) - 1, 0, n - 1)]
    made = np.array([system.output(one[:own], level, p) for one, level in zip(course, before, strict=True)])
    if acting.output_lag_s:
        made = course[:, own + 1]
    if acting.corner:
        made = made - course[:, own + 2]
    return acting.read(reads[:, None], made), course[:, :own]


def scene_of(system: HiddenSystem, u: FloatArray, y: FloatArray, x: FloatArray) -> Scene:
    """Sizes of a plain motion."""
    dt = system.period_s
    counted = x - np.array(system.references)[:, None]
    rates = np.sqrt(np.mean((np.diff(x, axis=0) / dt) ** 2, axis=(0, 2)))
    zero = float(y[0, 0]) if system.references[-1] else 0.0
    deviation = float(np.std(y))
    return Scene(
        duration_s=dt * len(u),
        slowness_s=deviation / float(np.sqrt(np.mean((np.diff(y, axis=0) / dt) ** 2))),
        sizes=tuple(np.sqrt(np.mean(counted**2, axis=(0, 2))).tolist()),
        rates=tuple(rates.tolist()),
        highs=tuple(np.quantile(x, 0.95, axis=(0, 2)).tolist()),
        input=(float(np.sqrt(np.mean(u**2))), float(np.std(u))),
        output=(float(np.sqrt(np.mean((y - zero) ** 2))), deviation),
        zero=zero,
        period_s=dt,
    )


def size_that_shows(shown: Callable[[float], float]) -> float:
    """Return a size of an effect that shows about `SHOWS` times the noise; where a size shows far more, a smaller one.

    Some effects show little up to a size and beyond it make another device: a bulk modulus that turns negative. There
    the size lies just below.

    Args:
        shown: RMS change of the output by an effect of some size, over the noise.
    """
    size, tried = 0.1, dict[float, float]()
    for _ in range(3):
        tried[size] = shown(size)
        size = float(np.clip(size * np.clip(SHOWS / max(tried[size], 1e-9), 0.2, 5.0), 1e-4, 0.9))
    tried[size] = shown(size)
    while len(tried) < MOST_SIZES and not 0.5 * SHOWS < tried[size] <= MOST_SHOWN:
        above = min((one for one, by in tried.items() if by > MOST_SHOWN), default=None)
        if above is None:  # the largest size shows little
            break
        below = max((one for one, by in tried.items() if by <= MOST_SHOWN), default=0.1 * above)
        size = 0.5 * (below + above)
        tried[size] = shown(size)
    if tried[size] <= MOST_SHOWN:
        return size
    least = min(tried, key=lambda one: tried[one])  # every size shows more
    return max((one for one, by in tried.items() if by <= MOST_SHOWN), default=least)


def hidden(
    system: HiddenSystem, make: Make | None, seed: int, samples: int = SAMPLES
) -> tuple[FloatArray, FloatArray, float]:
    """Return levels and noisy readings (samples, records) of a system with an effect, and the effect's size."""
    random = np.random.default_rng([seed, 2])
    p = {
        name: value * (1.0 if name in system.known else random.uniform(0.9, 1.1))
        for name, value in system.parameters.items()
    }
    u = levels(system, seed, samples)
    y, x = simulate(system, u, p, PLAIN)
    noise = FLOOR_SHARE * float(np.std(y))
    size = 0.0
    if make is not None:
        scene = scene_of(system, u, y, x)

        def shown(size: float) -> float:
            change, _ = simulate(system, u[:, :1], p, make(size, scene, system))
            return float(np.sqrt(np.mean((change - y[:, :1]) ** 2))) / noise

        size = size_that_shows(shown)
        y, _ = simulate(system, u, p, make(size, scene, system))
    return u, y + noise * random.standard_normal(y.shape), size
