"""Estimators that have resistance alone: the paper's composite, the gap-free one, a model straight from -ln R."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from rtctl.arithmetic.standard_error import combined
from rtctl.estimators.composite import SURROGATE_MARGIN, composite_step, reading_share
from rtctl.estimators.direct import READING_MARGIN, clipped_reading, reading_range
from rtctl.estimators.gap_free import LEAST_SLOPE, gap_free_composite_step
from rtctl.export.c.laws.parts import Fit, Part, Rest, preisach_sources, shortened
from rtctl.hysteresis.egpi import egpi_step
from rtctl.hysteresis.gpi_inverse import GpiInverse
from rtctl.hysteresis.preisach.model import preisach_step
from rtctl.models.vo2 import Vo2Model
from rtctl.translation.memory import Memory, by_precision

SINGLE_ULPS = 4.0
"""Tolerance of an iteration in single precision, in roundings of its range."""
EPS32 = float(np.finfo(np.float32).eps)
Estimated = tuple[float, float, float, int]


class Clip(NamedTuple):
    """Range of a value between two models."""

    low: float
    high: float


class Range(NamedTuple):
    """Range of -ln R at identification."""

    low: float
    """[ln ohm]."""
    high: float
    """[ln ohm]."""
    margin: float
    """How far beyond it a reading is taken as it is [ln ohm]."""


def composite(s: Any, c: Any, level: float, sensed: float, elapsed_s: float) -> Estimated:
    """Return deflection [um], surrogate [mA], standard error [um] and status bits, by the paper's composite."""
    value, surrogate, gain, status = composite_step(
        s.inverse, s.plays, sensed, c.clip.low, c.clip.high, c.gpi_inverse, c.egpi
    )
    if 0.0 < sensed < math.inf:
        s.last_ohm = sensed
    return value, surrogate, combined(c.fit.error, c.fit.reading * s.last_ohm * gain), status


def gap_free(s: Any, c: Any, level: float, sensed: float, elapsed_s: float) -> Estimated:
    """Return deflection [um], surrogate [mA], standard error [um] and status bits, by the gap-free composite."""
    value, surrogate, slope, status = gap_free_composite_step(
        s.inverse, s.plays, sensed, c.clip.low, c.clip.high, c.gap_free, c.egpi
    )
    return value, surrogate, combined(c.fit.error, c.fit.reading / max(slope, LEAST_SLOPE)), status


def direct_egpi(s: Any, c: Any, level: float, sensed: float, elapsed_s: float) -> Estimated:
    """Return deflection [um], no surrogate, standard error [um] and status bits, by an EGPI on -ln R."""
    u, status = clipped_reading(sensed, c.range.low, c.range.high, c.range.margin)
    value = egpi_step(s.plays, u, c.egpi)
    if math.isfinite(value):
        s.last = value
    return s.last, math.nan, c.fit.error, status


def direct_preisach(s: Any, c: Any, level: float, sensed: float, elapsed_s: float) -> Estimated:
    """Return deflection [um], no surrogate, standard error [um] and status bits, by a Preisach model on -ln R."""
    u, status = clipped_reading(sensed, c.range.low, c.range.high, c.range.margin)
    point = preisach_step(s.stack, u, c.preisach)
    if math.isfinite(point.y):
        s.last = point.y
    return s.last, math.nan, c.fit.error, status | point.status


def composite_part(model: Vo2Model, rest: Rest) -> Part:
    """Return the paper's composite of a model, from a full cooling at a level."""
    inverse = GpiInverse.of(model.resistance_gpi)
    size = inverse.params.y_limit + abs(inverse.params.c)
    deadband = by_precision(inverse.params.deadband, max(inverse.params.deadband, 16.0 * EPS32 * size))
    return Part(
        name="composite",
        function=composite,
        constants={
            "fit": Fit(model.quality["composite"].rms, reading_share(model)),
            "clip": _clip(model),
            "gpi_inverse": inverse.params._replace(deadband=deadband),
            "egpi": model.composite_egpi.params,
        },
        memory=(
            Memory(
                "inverse",
                inverse.initial_state(rest.level),
                "plays z of the inverse [kohm], last v [mA], branch",
            ),
            Memory("plays", model.composite_egpi.initial_state(rest.level), "plays w of the EGPI"),
            Memory("last_ohm", model.resistance.high, "the last resistance that was read [ohm]"),
        ),
        sources={
            "fit.error": "model.quality.composite.rms",
            "gpi_inverse": "inverse of model.hysteresis.resistance_gpi: equations (9) and (11)",
            "egpi": "model.hysteresis.composite_egpi",
        },
    )


def gap_free_part(model: Vo2Model, rest: Rest) -> Part:
    """Return the gap-free composite of a model, from a full cooling at a level."""
    params = model.resistance_gap_free.params
    span = params.v_high - params.v_low
    rise = params.y_tolerance / 4e-12
    tolerant = params._replace(
        v_tolerance=by_precision(params.v_tolerance, SINGLE_ULPS * EPS32 * max(span, abs(params.v_high))),
        y_tolerance=by_precision(params.y_tolerance, SINGLE_ULPS * EPS32 * max(rise, abs(params.egpi.c3))),
    )
    return Part(
        name="gap_free",
        function=gap_free,
        constants={
            "fit": Fit(
                model.quality["gap_free_composite"].rms,
                model.reading_error * model.deflection.width / model.current.width,
            ),
            "clip": _clip(model),
            "gap_free": tolerant,
            "egpi": model.gap_free_egpi.params,
        },
        memory=(
            Memory(
                "inverse",
                model.resistance_gap_free.initial_state(rest.level),
                "plays w, then the last v [mA]",
            ),
            Memory("plays", model.gap_free_egpi.initial_state(rest.level), "plays w of the EGPI"),
        ),
        sources={
            "fit.error": "model.quality.gap_free_composite.rms",
            "gap_free": "model.hysteresis.resistance_gap_free",
            "egpi": "model.hysteresis.gap_free_egpi",
        },
    )


def direct_egpi_part(model: Vo2Model, rest: Rest) -> Part:
    """Return the EGPI on -ln R of a model, from a full cooling."""
    return Part(
        name="egpi",
        function=direct_egpi,
        constants={
            "fit": Fit(model.quality["direct_egpi"].rms, 0.0),
            "range": _range(model),
            "egpi": model.direct_egpi.params,
        },
        memory=(
            Memory("plays", model.direct_egpi.initial_state(reading_range(model).low), "plays w of the EGPI"),
            Memory("last", 0.0, "the last estimate [um]"),
        ),
        sources={"fit.error": "model.quality.direct_egpi.rms", "egpi": "model.hysteresis.direct_egpi"},
    )


def direct_preisach_part(model: Vo2Model, rest: Rest) -> Part:
    """Return the Preisach model on -ln R of a model, from a full cooling."""
    start = model.direct_preisach.initial_state(reading_range(model).low)
    return Part(
        name="preisach",
        function=direct_preisach,
        constants={
            "fit": Fit(model.quality["direct_preisach"].rms, 0.0),
            "range": _range(model),
            "preisach": model.direct_preisach.params,
        },
        memory=(
            Memory("stack", shortened(start, rest.extrema), "extrema: k, s_0 ... [ln ohm], H_0 ... [um]"),
            Memory("last", 0.0, "the last estimate [um]"),
        ),
        sources={
            "fit.error": "model.quality.direct_preisach.rms",
            **preisach_sources("preisach", "direct_preisach"),
        },
    )


def _clip(model: Vo2Model) -> Clip:
    margin = SURROGATE_MARGIN * model.current.width
    return Clip(model.current.low - margin, model.current.high + margin)


def _range(model: Vo2Model) -> Range:
    found = reading_range(model)
    return Range(found.low, found.high, READING_MARGIN * found.width)
