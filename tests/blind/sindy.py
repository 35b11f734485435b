"""Baseline: discrepancy-SINDy by pysindy, from the displacement alone, as the diagnosis gets it.

The displacement is smoothed and differentiated twice, the nominal model's terms are fitted to the acceleration, and
what they leave is regressed on a library of the catalogue's forces by sequentially thresholded least squares. Drive
and library go through the same smoothing, or its delay and damping would look like effects. The threshold is the one
of lowest BIC, as many samples counted as there are smoothing windows. References: Kaheman et al. (2019), Learning
discrepancy models from experimental data; Brunton, Proctor & Kutz (2016), eq. 5.

What it lacks by construction: terms with a memory or a shape of their own (`stiffness.viscoelastic`,
`hysteresis.bouc_wen`, `mode.second`, the width of a dead zone), effects of the sensor (`sensor.saturation`,
`sensor.lag`, `sensor.hum`), of the hold between samples; a test of what is left, so no "none of these".
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.fit_record import FitRecord

FloatArray = NDArray[np.float64]
WINDOWS_A_PERIOD = 4.0
"""Smoothing windows in a period of the motion: takes noise off, leaves the third harmonic."""
ORDER = 3
THRESHOLDS = np.geomspace(0.003, 0.8, 25)
"""Of the rms of what the nominal terms leave, for library terms of rms 1."""


class Motion(NamedTuple):
    """Of one record, each (n,) and of order one but for `acceleration`."""

    x: FloatArray
    v: FloatArray
    acceleration: FloatArray
    t: FloatArray
    u: FloatArray
    smooth: Callable[[FloatArray], FloatArray]


class Term(NamedTuple):
    """A library function and the ids of the catalogue that it would be the force of."""

    name: str
    ids: tuple[str, ...]
    force: Callable[[Motion], FloatArray]


LIBRARY = (
    Term("x^2", ("stiffness.quadratic",), lambda m: m.x**2),
    Term("x^3", ("stiffness.cubic",), lambda m: m.x**3),
    Term("x^5", ("stiffness.quintic",), lambda m: m.x**5),
    Term("u x", ("stiffness.parametric",), lambda m: m.smooth(m.u) * m.x),
    Term("t x", ("stiffness.drift",), lambda m: m.t * m.x),
    Term("x^2 v", ("damping.nonlinear",), lambda m: m.x**2 * m.v),
    Term("|v| v", ("damping.quadratic",), lambda m: np.abs(m.v) * m.v),
    Term("sign v", ("friction.coulomb",), lambda m: np.sign(m.v)),
    Term("u^2", ("drive.harmonics",), lambda m: m.smooth(m.u**2)),
    Term("u^3", ("drive.saturation", "drive.harmonics"), lambda m: m.smooth(m.u**3)),
    Term("sign u", ("drive.deadband",), lambda m: m.smooth(np.sign(m.u))),
    Term("du/dt", ("drive.delay", "drive.lag"), lambda m: np.gradient(m.smooth(m.u))),
    Term("1", ("drive.offset", "sensor.offset"), lambda m: np.ones_like(m.x)),
)


def sindy(data: Problem, *, cubic: bool) -> dict[str, Any]:
    """`verdict` and `causes` as a judged line has them; `cubic`: the nominal model has a cubic stiffness."""
    samples_a_period = 2.0 * np.pi / data.scales.rate / data.records[0].period_s
    window = max(ORDER + 2, 2 * round(0.5 * samples_a_period / WINDOWS_A_PERIOD) + 1)
    sizes = (data.scales.displacement, data.scales.velocity, data.scales.drive or 1.0)
    motions = [motion(record, window, sizes) for record in data.records if record.samples > 4 * window]
    library = [term for term in LIBRARY if not (cubic and term.name == "x^3")]
    terms = selected(motions, library, window, cubic=cubic)
    causes: dict[str, dict[str, Any]] = {}
    for ids in sorted((term.ids for term in terms), key=len):
        if not set(ids) & set(causes):  # u^2 with u^3 is one distortion
            causes[ids[0]] = {"id": ids[0], "or": list(ids[1:])}
    return {
        "verdict": "explained" if causes else "adequate",
        "causes": list(causes.values()),
        "terms": [term.name for term in terms],
    }


def motion(record: FitRecord, window: int, sizes: tuple[float, float, float]) -> Motion:
    """Smoothed and differentiated; a converter's drive acts on average half a sample late."""
    from pysindy import FiniteDifference, SmoothedFiniteDifference

    displacement, velocity, drive = sizes
    t = record.period_s * np.arange(record.samples)
    u = record.stimulus.inputs["drive"] / drive
    if record.stimulus.holds["drive"] == "zero":
        u = 0.5 * (u + np.r_[u[0], u[:-1]])
    smoothing = {"window_length": window, "polyorder": ORDER}
    derive = SmoothedFiniteDifference(smoother_kws=smoothing, order=4)
    first = np.asarray(derive(record.measured["displacement"][:, None], t))[:, 0]
    x = np.asarray(derive.smoothed_x_)[:, 0]
    second = np.asarray(FiniteDifference(order=4)(first[:, None], t))[:, 0]
    rate = velocity / displacement
    inner = slice(max(record.first, window), record.samples - window)

    def smooth(series: FloatArray) -> FloatArray:
        return savgol_filter(series, window, ORDER)

    return Motion(
        x=x[inner] / displacement, v=first[inner] / velocity, acceleration=second[inner] / (rate * velocity),
        t=np.linspace(-1.0, 1.0, record.samples)[inner], u=u[inner], smooth=smooth,
    )  # fmt: skip


def selected(motions: list[Motion], library: list[Term], window: int, *, cubic: bool) -> list[Term]:
    """Terms of the sparse model of lowest BIC; none where the nominal terms alone have it."""
    target = np.concatenate([m.acceleration for m in motions])
    nominal = np.column_stack([
        np.concatenate(column) for column in zip(
            *((m.x, m.v, m.smooth(m.u), *((m.x**3,) if cubic else ())) for m in motions), strict=True
        )
    ])  # fmt: skip
    table = np.column_stack([np.concatenate([term.force(m) for m in motions]) for term in library])
    basis = np.linalg.qr(nominal)[0]
    left = target - basis @ (basis.T @ target)
    table = table - basis @ (basis.T @ table)
    table = table / np.maximum(np.sqrt(np.mean(table**2, axis=0)), 1e-12)
    left = left / np.sqrt(np.mean(left**2))
    samples, count = len(left), len(left) / window
    short = np.linalg.qr(
        np.column_stack((table, left)), mode="r"
    )  # of the same least-squares problems, a few rows
    table, left = short[:, :-1], short[:, -1]
    best, least = list[int](), 0.0
    for threshold in THRESHOLDS:
        used = _used(table, left, threshold)
        if not len(used):
            break
        rest = left - table[:, used] @ np.linalg.lstsq(table[:, used], left)[0]
        bic = count * float(np.log(rest @ rest / samples)) + len(used) * float(np.log(count))
        if bic < least:
            best, least = used.tolist(), bic
    return [library[k] for k in best]


def _used(table: FloatArray, left: FloatArray, threshold: float) -> NDArray[np.intp]:
    from pysindy import STLSQ

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Sparsity parameter is too big")  # that ends the search
        found = STLSQ(threshold=threshold, alpha=1e-9, max_iter=20).fit(table, left[:, None])
    return np.flatnonzero(np.asarray(found.coef_)[0])
