"""One sample of the cubature Kalman filter of `rtctl.estimators.cubature`, as kernels that are exported to C as well.

Reference: I. Arasaratnam, S. Haykin, IEEE Trans. Automatic Control 54 (2009) 1254, equations 22 to 41, and
section V for square roots.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import kernel
from rtctl.estimators.equations.gaussian import solve_triangular, spread_points, take_moments, triangularise
from rtctl.estimators.equations.step import step, whole_steps

OK, NOT_FINITE, DISAGREES = 0, 8, 16
"""Bits of `rtctl.interfaces.EstimateStatus`."""
FAR = 1e15
"""Innovation [noise] beyond which a reading counts as none; its square still is a number in single precision."""
ROOT_HALF = 0.7071067811865476


class FilterParams(NamedTuple):
    """Constants of a filter of n states."""

    outputs: int
    """Outputs of the model."""
    shown: int
    """Place of the controlled one among them."""
    parameters: FloatArray
    """(parameters,) [SI]."""
    low: FloatArray
    """Limits (n,) of the states [SI]."""
    high: FloatArray
    scale: FloatArray
    """Standard deviation (n,) of the states at the start [SI], the unit of their covariance's root."""
    added: FloatArray
    """Root of the spectral density (n,) of what the rates miss [scale/s^(1/2)]."""
    corrected: FloatArray
    """(n,): 1, or 0 for a state that events alone change, which readings do not correct."""
    sensed: FloatArray
    """Places (readings,) of the readings among the outputs."""
    noise: FloatArray
    """Standard deviation (readings,) of each [its unit]."""
    most: float
    """Square of the innovation, in units of its covariance, beyond which a reading disagrees with the equations."""
    step_s: float
    """Longest step of the integration [s]."""


def room_size(states: int, readings: int, outputs: int) -> int:
    """Return how many numbers a step needs room for."""
    n, m = states, readings
    moving = 3 * n * n + 5 * n
    reading = 4 * n * m + 2 * n + m * m + 4 * m + outputs + max(n * (4 * n + m), m * (2 * n + m))
    return 2 * n * n + max(moving, reading)


# 7 parameters because a compiled kernel takes its arrays one by one
@kernel
def predict(  # noqa: PLR0913
    rates: Any,
    x: FloatArray,
    root: FloatArray,
    u: FloatArray,
    elapsed_s: float,
    c: FilterParams,
    room: FloatArray,
) -> None:
    """Move mean `x` (n,) [SI] and `root` (n * n,) [scale] of the covariance through held inputs.

    Args:
        rates: The law of the model.
        x: Mean.
        root: Root of the covariance.
        u: Inputs (inputs,) [SI].
        elapsed_s: Time for which they are held [s].
        c: Constants.
        room: Room for numbers (`room_size`,).
    """
    n = x.size
    points, at = room[0 : 2 * n * n], 2 * n * n
    spread_points(x, root, c.scale, c.low, c.high, points)
    k, there = room[at : at + 4 * n], room[at + 4 * n : at + 5 * n]
    steps = whole_steps(elapsed_s, c.step_s)
    step_s = elapsed_s / steps
    for j in range(2 * n):
        place = points[j * n : (j + 1) * n]
        for _ in range(steps):
            step(rates, place, u, c.parameters, c.low, c.high, step_s, k, there, place)
    at = at + 5 * n
    take_moments(points, c.scale, c.added, elapsed_s, x, root, room[at : at + 3 * n * n])


# 8 parameters because a compiled kernel takes its arrays one by one
@kernel
def read_points(  # noqa: PLR0913
    outputs: Any, points: FloatArray, u: FloatArray, c: FilterParams, out: FloatArray, seen: FloatArray,
    mean: FloatArray, shown: FloatArray,
) -> float:  # fmt: skip
    """Take the outputs at points; return the mean of the controlled one.

    Args:
        outputs: The law of the model.
        points: States (2n * n,) [SI].
        u: Inputs (inputs,) [SI].
        c: Constants.
        out: Room for outputs (outputs,).
        seen: Filled with the readings less their mean (readings * 2n,), in units of noise / sqrt(2n).
        mean: Filled with that mean (readings,) [noise].
        shown: Filled with the controlled output less its mean (2n,), in units of 1 / sqrt(2n).
    """
    count, m = shown.size, mean.size
    n, value, share = count // 2, 0.0, 1.0 / math.sqrt(float(count))
    for k in range(m):
        mean[k] = 0.0
    for j in range(count):
        outputs(points[j * n : (j + 1) * n], u, c.parameters, out)
        shown[j] = out[c.shown]
        value += shown[j]
        for k in range(m):
            seen[k * count + j] = out[int(c.sensed[k])] / c.noise[k]
            mean[k] += seen[k * count + j]
    value = value / count
    for j in range(count):
        shown[j] = share * (shown[j] - value)
    for k in range(m):
        mean[k] = mean[k] / count
        for j in range(count):
            seen[k * count + j] = share * (seen[k * count + j] - mean[k])
    return value


@kernel
def root_of_readings(seen: FloatArray, m: int, wide: FloatArray, read_root: FloatArray) -> None:
    """Fill `read_root` (m * m,) with the root of the covariance of m readings and their noise.

    Args:
        seen: Readings less their mean (m * 2n,).
        m: Number of readings.
        wide: Room for numbers (m * (2n + m),).
        read_root: See above.
    """
    count = seen.size // m
    columns = count + m
    for k in range(m):
        for j in range(count):
            wide[k * columns + j] = seen[k * count + j]
        for q in range(m):
            wide[k * columns + count + q] = 1.0 if k == q else 0.0
    triangularise(wide[0 : m * columns], m, read_root)


@kernel
def weigh_states(root: FloatArray, n: int, seen: FloatArray, m: int, cross: FloatArray) -> None:
    """Fill `cross` (n * m,) with the covariance of states and readings; the states at the points are x +- L."""
    for i in range(n):
        for k in range(m):
            total = 0.0
            for j in range(n):
                total += root[i * n + j] * (seen[k * 2 * n + j] - seen[k * 2 * n + n + j])
            cross[i * m + k] = ROOT_HALF * total


# 8 parameters because a compiled kernel takes its arrays one by one
@kernel
def apply_gain(  # noqa: PLR0913
    x: FloatArray, root: FloatArray, gain: FloatArray, seen: FloatArray, off: FloatArray, grown: float, c: FilterParams,
    wide: FloatArray,
) -> None:  # fmt: skip
    """Correct the mean and the root of the covariance by the innovation.

    Where the covariance of the readings is taken larger by `grown`, P = (1 - 1/grown) P + (1/grown) P_corrected.

    Args:
        x: Mean (n,) [SI].
        root: Root of the covariance (n * n,) [scale].
        gain: (n * readings,) for `grown` 1.
        seen: Readings at points less their mean (readings * 2n,).
        off: Innovation (readings,) [noise].
        grown: See above.
        c: Constants.
        wide: Room for numbers (n * (4n + readings),).
    """
    n, m = x.size, off.size
    columns = 4 * n + m
    kept, taken = math.sqrt(1.0 - 1.0 / grown), math.sqrt(1.0 / grown)
    for i in range(n):
        total = 0.0
        for k in range(m):
            gain[i * m + k] = c.corrected[i] * gain[i * m + k]
            total += gain[i * m + k] * off[k]
            wide[i * columns + 4 * n + k] = taken * gain[i * m + k]
        x[i] = min(max(x[i] + c.scale[i] * (total / grown), c.low[i]), c.high[i])
        for j in range(2 * n):
            state = ROOT_HALF * root[i * n + j] if j < n else -ROOT_HALF * root[i * n + j - n]
            left = state
            for k in range(m):
                left -= gain[i * m + k] * seen[k * 2 * n + j]
            wide[i * columns + j] = kept * state
            wide[i * columns + 2 * n + j] = taken * left
    triangularise(wide[0 : n * columns], n, root)


# 6 parameters because a compiled kernel takes its arrays one by one
@kernel
def error_left(
    shown: FloatArray,
    seen: FloatArray,
    read_root: FloatArray,
    toward: FloatArray,
    weighed: FloatArray,
    grown: float,
) -> float:
    """Return the standard error of the controlled output after a correction.

    Args:
        shown: Output at points less its mean (2n,).
        seen: Readings at points less their mean (readings * 2n,).
        read_root: Root of the covariance of the readings (readings * readings,).
        toward: Room for the covariance of output and readings (readings,).
        weighed: Room for the gain of the output (readings,).
        grown: Factor by which the covariance of the readings is taken larger.
    """
    count, m = shown.size, toward.size
    before, after = 0.0, 0.0
    for k in range(m):
        toward[k] = 0.0
        for j in range(count):
            toward[k] += shown[j] * seen[k * count + j]
    solve_triangular(read_root, m, toward, weighed)
    for k in range(m):
        after += weighed[k] * weighed[k]
    for j in range(count):
        left = shown[j]
        for k in range(m):
            left -= weighed[k] * seen[k * count + j]
        before += shown[j] * shown[j]
        after += left * left
    return math.sqrt((1.0 - 1.0 / grown) * before + after / grown)


# 7 parameters because a compiled kernel takes its arrays one by one
@kernel
def correct(  # noqa: PLR0913
    outputs: Any,
    x: FloatArray,
    root: FloatArray,
    u: FloatArray,
    z: FloatArray,
    c: FilterParams,
    room: FloatArray,
) -> tuple[float, float, float, int]:
    """Correct mean `x` (n,) [SI] and `root` (n * n,) [scale] of the covariance by readings.

    A reading that the equations make less probable than `c.most` counts as if its noise put it at that limit.

    Args:
        outputs: The law of the model.
        x: Mean.
        root: Root of the covariance.
        u: Inputs (inputs,) [SI].
        z: Readings (readings,), each in its unit.
        c: Constants.
        room: Room for numbers (`room_size`,).

    Returns:
        The controlled output, the innovation of the first reading, the standard error of the output, status bits.
    """
    n, m, count = x.size, z.size, 2 * x.size
    points, at = room[0 : count * n], count * n
    seen, shown = room[at : at + count * m], room[at + count * m : at + count * m + count]
    at = at + count * m + count
    cross, gain = room[at : at + n * m], room[at + n * m : at + 2 * n * m]
    at = at + 2 * n * m
    mean, off = room[at : at + m], room[at + m : at + 2 * m]
    weighed, toward = room[at + 2 * m : at + 3 * m], room[at + 3 * m : at + 4 * m]
    at = at + 4 * m
    read_root, out = room[at : at + m * m], room[at + m * m : at + m * m + c.outputs]
    wide = room[at + m * m + c.outputs : room.size]

    spread_points(x, root, c.scale, c.low, c.high, points)
    value = read_points(outputs, points, u, c, out, seen, mean, shown)
    root_of_readings(seen, m, wide, read_root)
    is_read = True
    for k in range(m):
        off[k] = z[k] / c.noise[k] - mean[k]
        if not abs(off[k]) < FAR:
            is_read = False
    surprise = math.nan
    if is_read:
        solve_triangular(read_root, m, off, weighed)
        surprise = 0.0
        for k in range(m):
            surprise += off[k] * weighed[k]
    if not surprise < math.inf:
        total = 0.0
        for j in range(count):
            total += shown[j] * shown[j]
        return value, math.nan, math.sqrt(total), NOT_FINITE
    grown = max(1.0, surprise / c.most)

    weigh_states(root, n, seen, m, cross)
    for i in range(n):
        solve_triangular(read_root, m, cross[i * m : (i + 1) * m], gain[i * m : (i + 1) * m])
    apply_gain(x, root, gain, seen, off, grown, c, wide)
    error = error_left(shown, seen, read_root, toward, weighed, grown)
    outputs(x, u, c.parameters, out)
    return out[c.shown], off[0] * c.noise[0], error, DISAGREES if surprise > c.most else OK


# 9 parameters because a compiled kernel takes its arrays one by one
@kernel
def filter_step(  # noqa: PLR0913
    rates: Any, outputs: Any, x: FloatArray, root: FloatArray, u: FloatArray, z: FloatArray, elapsed_s: float,
    c: FilterParams, room: FloatArray,
) -> tuple[float, float, float, int]:  # fmt: skip
    """Take a sample: `u` was applied for `elapsed_s` [s], `z` measured at the end of that; 0 s: nothing moves.

    See `predict` and `correct` for the arguments and what is returned.
    """
    if elapsed_s > 0.0:
        predict(rates, x, root, u, elapsed_s, c, room)
    value, innovation, error, status = correct(outputs, x, root, u, z, c, room)
    return value, innovation, error, status
