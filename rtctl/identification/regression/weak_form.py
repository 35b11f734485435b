"""Start values by regression on the weak form of the equation of motion: no noisy signal is ever differentiated.

The equation times a bump phi(t) = (1 - (t/T)^2)^p, integrated by parts until the derivatives are phi's:

    int phi'' z = damping int phi' z - stiffness int phi z - cubic int phi z^3 + gain int phi u + offset int phi

one row a position of the bump, linear in the coefficients. The half-width T passes the motion and averages the noise:
0.35 periods of the dominant frequency (25 ms at the beam's 14 Hz), and at least 6 samples, below which sums over
samples are no integrals any more. Noise in z biases z^3 by 3 sigma^2 z: Hermite polynomials take that off.

Reference: D. Messenger, D. Bortz, Weak SINDy, Multiscale Model. Simul. 19 (2021) 1474, eq. 2.4.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.regression.integrated_motion import (
    disturbed_samples,
    estimate_motion,
    without_slow_part,
)

ORDER = 8
HALF_WIDTH_PERIODS = 0.35
MIN_HALF_WIDTH_SAMPLES = 6
BUMPS_PER_HALF_WIDTH = 8
MOST_OF_AN_EDGE = 4
"""A quarter of a record at each end at most is left out as disturbed."""
RANK_TOLERANCE = 1e-7
_BLOCK = 4096  # bumps at a time: memory stays flat however long a record is


class Sampled(NamedTuple):
    """Signals of one record from which the terms are computed."""

    z: FloatArray
    v: FloatArray
    """Velocity by the weak derivative; used only for its sign or magnitude."""
    u: FloatArray
    noise: float
    """Standard deviation of the white part of z."""


class Term(NamedTuple):
    """A force per mass: a feature of the signals, differentiated `order` times in the equation."""

    feature: Callable[[Sampled], FloatArray]
    order: int = 0
    sign: float = -1.0
    """Sign on the side of the acceleration: -1 resists."""
    is_drive: bool = False


TERMS: Mapping[str, Term] = {
    "damping": Term(lambda s: s.z, order=1),
    "stiffness": Term(lambda s: s.z),
    "stiffness_cubic": Term(lambda s: s.z**3 - 3.0 * s.noise**2 * s.z),
    "drive_gain": Term(lambda s: s.u, sign=1.0, is_drive=True),
    "offset": Term(lambda s: np.ones_like(s.z), sign=1.0),
    "stiffness.quadratic.coefficient": Term(lambda s: s.z**2 - s.noise**2),
    "stiffness.cubic.coefficient": Term(lambda s: s.z**3 - 3.0 * s.noise**2 * s.z),
    "stiffness.quintic.coefficient": Term(
        lambda s: s.z**5 - 10.0 * s.noise**2 * s.z**3 + 15.0 * s.noise**4 * s.z
    ),
    "damping.nonlinear.coefficient": Term(lambda s: s.z**3 / 3.0 - s.noise**2 * s.z, order=1),
    "damping.quadratic.coefficient": Term(lambda s: np.abs(s.v) * s.v),
    "damping.asymmetric.coefficient": Term(lambda s: np.abs(s.v)),
    "friction.coulomb.level": Term(lambda s: np.sign(s.v)),
}
"""Terms by the name of the parameter that they estimate."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WeakFit:
    """Result of the regression, in the units of the data."""

    coefficients: Mapping[str, float]
    half_width_s: float
    residual_share: float
    """RMS residual relative to the acceleration's RMS."""
    condition: float
    """Condition number of the scaled regressors: large where the data cannot distinguish the terms."""


def choose_half_width(records: Sequence[FitRecord], rate: float) -> float:
    """Return the half-width [s] of the bump for motion of the dominant angular frequency `rate` [1/s]."""
    period_s = max(record.period_s for record in records)
    shortest = min(record.samples * record.period_s for record in records)
    wanted = max(HALF_WIDTH_PERIODS * 2.0 * np.pi / rate, MIN_HALF_WIDTH_SAMPLES * period_s)
    return float(min(wanted, 0.25 * shortest))


def regress(
    records: Iterable[FitRecord],
    terms: Sequence[str],
    half_width_s: float,
    known: Mapping[str, float] | None = None,
) -> WeakFit:
    """Regress the coefficients of `terms` over all records, which are read one at a time.

    Args:
        records: Records.
        terms: Names of terms in `TERMS`.
        half_width_s: Half-width of the bumps [s].
        known: Coefficients of further terms that are taken as given.
    """
    known = known or {}
    names = [*terms, *known]
    gram = np.zeros((1 + len(names), 1 + len(names)))
    for record in records:
        for rows, by_noise in _build_rows(record, names, half_width_s):
            gram += rows.T @ rows - by_noise
    return _solve(gram, list(terms), known, half_width_s)


def weak_gram(
    record: FitRecord, names: Sequence[str], half_width_s: float, forces: FloatArray
) -> tuple[FloatArray, float]:
    """Return the Gram matrix of the acceleration, terms and further forces of a record, integrated over bumps.

    Args:
        record: Record.
        names: Names of terms (t) in `TERMS`.
        half_width_s: Half-width of the bumps [s].
        forces: Forces per mass (k, n), each as its mean from a sample to the next.

    Returns:
        (1 + t + k, 1 + t + k), without what noise adds to terms; what it adds to the acceleration's square.
    """
    count = 1 + len(names) + len(forces)
    gram, noise = np.zeros((count, count)), 0.0
    for rows, by_noise in _build_rows(record, names, half_width_s, forces):
        gram += rows.T @ rows
        gram[: len(by_noise), : len(by_noise)] -= by_noise
        noise += float(by_noise[0, 0])
    return gram, noise


def _solve(gram: FloatArray, terms: list[str], known: Mapping[str, float], half_width_s: float) -> WeakFit:
    """Solve the least squares from the Gram matrix of (acceleration, terms, known terms), columns scaled."""
    taken = np.concatenate(([1.0], np.zeros(len(terms)), [-value for value in known.values()]))
    inner = gram[1 : 1 + len(terms), 1 : 1 + len(terms)]
    right = (gram @ taken)[1 : 1 + len(terms)]
    target = float(taken @ gram @ taken)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(inner), 1e-300))
    eigenvalues, vectors = np.linalg.eigh(inner * scale[:, None] * scale)
    top = float(eigenvalues.max(initial=0.0))
    kept = eigenvalues > RANK_TOLERANCE**2 * top
    found = scale * (vectors[:, kept] @ ((vectors[:, kept].T @ (scale * right)) / eigenvalues[kept]))
    left = max(target - float(right @ found), 0.0)
    return WeakFit(
        coefficients=dict(zip(terms, found.tolist(), strict=True)),
        half_width_s=half_width_s,
        residual_share=float(np.sqrt(left / target)) if target > 0.0 else 0.0,
        condition=float(np.sqrt(top / max(float(eigenvalues.min(initial=top)), 1e-300))),
    )


def _build_rows(
    record: FitRecord, names: Sequence[str], half_width_s: float, forces: FloatArray | None = None
) -> Iterable[tuple[FloatArray, FloatArray]]:
    """Yield blocks (bumps, 1 + terms): the acceleration and each term in the equation, integrated over bumps.

    With each comes what noise adds to its Gram matrix: the same samples are in all columns. Mean `forces` (k, n) from
    each sample to the next are further columns, of which that is not known.
    """
    h = record.period_s
    m = max(2, round(half_width_s / h))
    if record.samples < 2 * m + 1:
        return
    signals = _sample_signals(record, m)
    columns = [_Column(signals.z, sample_bump(m, h, 2), np.ones_like(signals.z))]
    for term in (TERMS[name] for name in names):
        by_hold = _sample_held_bump(m, h, record.stimulus.holds.get("drive", "linear"))
        kernel = by_hold if term.is_drive else sample_bump(m, h, term.order) * (-1.0) ** term.order
        columns.append(
            _Column(term.feature(signals), term.sign * kernel, _differentiate_feature(term, signals))
        )
    held = _sample_held_bump(m, h, "zero")
    hop = max(1, m // BUMPS_PER_HALF_WIDTH)
    edge = 0
    if forces is not None:
        edge = min(disturbed_samples(record), (record.samples - 2 * m) // MOST_OF_AN_EDGE)
        if "displacement" not in record.measured:
            forces = np.array([without_slow_part(record, force) for force in forces]).reshape(forces.shape)
    positions = np.arange(edge, record.samples - 2 * m - edge, hop)
    for begin in range(0, len(positions), _BLOCK):
        where = positions[begin : begin + _BLOCK]
        rows = np.stack([_integrate_windows(one.feature, one.kernel, where, hop) for one in columns], axis=1)
        if forces is not None:
            further = [_integrate_windows(force, held, where, hop) for force in forces]
            rows = np.column_stack((rows, *further))
        sparse = where[::BUMPS_PER_HALF_WIDTH]  # an expectation varies slowly: fewer bumps tell it
        by_noise = _compute_noise_gram(columns, signals.noise, sparse, hop * BUMPS_PER_HALF_WIDTH)
        yield rows, by_noise * (len(where) / len(sparse))


class _Column(NamedTuple):
    feature: FloatArray
    kernel: FloatArray
    slope: FloatArray
    """Derivative of the feature by the displacement reading."""


def _differentiate_feature(term: Term, signals: Sampled) -> FloatArray:
    """Return d feature / dz by a central difference of the function (not of the data)."""
    step = 1e-4 * float(np.abs(signals.z).max()) or 1.0
    above = term.feature(signals._replace(z=signals.z + step))
    below = term.feature(signals._replace(z=signals.z - step))
    slope: FloatArray = (above - below) / (2.0 * step)
    return slope


def _compute_noise_gram(
    columns: Sequence[_Column], noise: float, positions: NDArray[np.intp], hop: int
) -> FloatArray:
    """Return the expected Gram matrix (columns, columns) of white noise of this standard deviation in z."""
    found = np.zeros((len(columns), len(columns)))
    for i, one in enumerate(columns):
        for j, other in enumerate(columns[: i + 1]):
            both = one.slope * other.slope
            if both.any():
                found[i, j] = found[j, i] = _integrate_windows(
                    both, one.kernel * other.kernel, positions, hop
                ).sum()
    return noise**2 * found


def _integrate_windows(
    signal: FloatArray, kernel: FloatArray, positions: NDArray[np.intp], hop: int
) -> FloatArray:
    """Return the sum of the signal times the kernel from each position on, `hop` apart."""
    windows = np.lib.stride_tricks.sliding_window_view(signal, len(kernel))
    found: FloatArray = windows[positions[0] : positions[-1] + 1 : hop] @ kernel
    return found


def sample_motion(record: FitRecord, half_width_s: float) -> tuple[FloatArray, FloatArray]:
    """Return displacement and velocity (n,) at the samples, a measured displacement smoothed as its velocity is.

    Differences of the raw reading over a sample period are mostly noise at high sample rates.
    """
    m = max(2, round(half_width_s / record.period_s))
    signals = _sample_signals(record, m)
    if "displacement" not in record.measured:
        return signals.z, signals.v
    return _smooth(signals.z, m, record.period_s, 0), _smooth(signals.z, m, record.period_s, 1)


def _smooth(z: FloatArray, m: int, period_s: float, derivative: int) -> FloatArray:
    """Return a derivative (n,) of a reading, averaged over a bump of half the half-width of `m` samples."""
    narrow = max(2, m // 2)
    kernel = sample_bump(narrow, period_s, derivative) / np.sum(sample_bump(narrow, period_s, 0))
    smooth: FloatArray = np.convolve(np.pad(z, narrow, mode="edge"), kernel, mode="valid")
    return smooth  # convolution turns -phi' round


def _sample_signals(record: FitRecord, m: int) -> Sampled:
    z = estimate_motion(record, "displacement")
    u = record.stimulus.inputs.get("drive", np.zeros_like(z))
    if "displacement" not in record.measured:
        v, u = estimate_motion(record, "velocity"), without_slow_part(record, u)
    elif "velocity" in record.measured:
        v = record.measured["velocity"]
    else:
        v = _smooth(z, m, record.period_s, 1)
    return Sampled(z, v, u, estimate_white_noise(z))


def estimate_white_noise(z: FloatArray) -> float:
    """Estimate the standard deviation of the white part of `z` from the upper fifth of its spectrum."""
    power = np.abs(np.fft.rfft((z - z.mean()) * np.hanning(len(z)))) ** 2
    top = power[-max(1, len(power) // 5) :]
    mean = float(np.median(top)) / np.log(2.0)  # of a chi^2 with two degrees of freedom
    return float(np.sqrt(mean / (0.375 * len(z))))  # 0.375: the Hann window's mean square


def _differentiate_bump(derivative: int) -> FloatArray:
    """Return the coefficients of the bump's derivative by x = t/T."""
    return np.asarray(polynomial.polyder(polynomial.polypow([1.0, 0.0, -1.0], ORDER), derivative), np.float64)


def sample_bump(m: int, h: float, derivative: int) -> FloatArray:
    """Return samples (2 m + 1,) of a derivative by time, times the sample period, so that a sum is the integral."""
    x = np.arange(-m, m + 1) / m
    return np.asarray(
        polynomial.polyval(x, _differentiate_bump(derivative)) * h / (m * h) ** derivative, np.float64
    )


def _sample_held_bump(m: int, h: float, hold: str) -> FloatArray:
    """Return weights of the drive's samples: the bump averaged over what each sample holds."""
    if hold == "band-limited":
        return sample_bump(m, h, 0)
    legendre, double = np.polynomial.legendre.leggauss(6)
    nodes, weights = 0.5 * (legendre + 1.0), 0.5 * double
    x = (np.arange(-m, m + 1)[:, None] + nodes) / m
    within = polynomial.polyval(np.clip(x, -1.0, 1.0), _differentiate_bump(0))
    if hold == "zero":  # a sample acts from its own instant to the next
        held: FloatArray = h * (within @ weights)
        return held
    falling, rising = within @ (weights * (1.0 - nodes)), within @ (weights * nodes)
    result: FloatArray = h * (falling + np.concatenate(([0.0], rising[:-1])))
    return result
