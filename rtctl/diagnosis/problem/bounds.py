"""Bounds of the unknowns of a fit."""

from __future__ import annotations

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Scales
from rtctl.identification.simulation_error.sensitivity import Sensitivity

MOST_SCALES = 5.0
"""A mechanism that acts so many times as much as all the rest is none that is to be found."""
FAR_OFF = 100.0
"""Times what matters as much as all the rest: beyond, no nominal value is looked for, unless the fit begins there."""
FURTHER = 2.0
"""Times where it begins: a beam far below its resonance has a stiffness of many scales."""


def bounds(sensitivity: Sensitivity, scales: Scales) -> tuple[FloatArray, FloatArray]:
    """Of the scaled unknowns; shapes stay where they are a shape: a yield displacement of 0 is dry friction.

    Nominal values may move far, but not to where a motion would need steps without number.
    """
    low, high = sensitivity.bounds
    start = sensitivity.current_values[sensitivity.free] / sensitivity.scale
    for k, index in enumerate(sensitivity.free):
        declared = sensitivity.simulation.parameters[index].declared
        parameter = sensitivity.simulation.parameters[index]
        if parameter.mechanism and not declared.is_shape:
            most = MOST_SCALES * declared.reach
            low[k], high[k] = max(low[k], -most), min(high[k], most)
        if not parameter.mechanism:
            most = max(FAR_OFF, FURTHER * abs(float(start[k])))
            low[k], high[k] = max(low[k], -most), min(high[k], most)
        if declared.is_shape:
            open_ended = not declared.default or declared.searched
            scale = declared.scale(scales) if open_ended else declared.default
            size = abs(float(scale)) / sensitivity.scale[k]
            signed = declared.low < 0.0
            low[k] = max(low[k], (-declared.shape_range[1] if signed else declared.shape_range[0]) * size)
            high[k] = min(high[k], declared.shape_range[1] * size)
    return low, high
