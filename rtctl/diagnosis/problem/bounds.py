"""Bounds of the unknowns of a fit, and values clipped to the bounds of a simulation."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import NormalDist

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import Parameter
from rtctl.border.simulation import Simulation
from rtctl.diagnosis.problem.problem import Problem
from rtctl.identification.fit_record import FitRecord, response_of
from rtctl.identification.integrated_motion import integrate_motion
from rtctl.identification.simulation_error.sensitivity import Sensitivity

MIDDLE = 0.5
"""Quantile of a motion that is its middle."""


def parameter_bounds(problem: Problem, sensitivity: Sensitivity) -> tuple[FloatArray, FloatArray]:
    """Return the lower and upper bounds (p,) of the scaled unknowns of a fit.

    Amplitudes of mechanisms and nominal parameters are bounded by multiples of their scales, so that no fit ends at a
    motion that needs steps without number. Shapes stay within their declared range: a hysteresis with a yield
    displacement of 0 would be dry friction.
    """
    thresholds = problem.thresholds.problem
    low, high = sensitivity.bounds
    start = sensitivity.current_values[sensitivity.free] / sensitivity.scale
    for k, index in enumerate(sensitivity.free):
        parameter = sensitivity.simulation.parameters[index]
        declared = parameter.declared
        if parameter.mechanism and not declared.is_shape:
            most = thresholds.most_scales * declared.reach
            low[k], high[k] = max(low[k], -most), min(high[k], most)
        if not parameter.mechanism:
            most = max(thresholds.nominal_range, thresholds.start_range * abs(float(start[k])))
            low[k], high[k] = max(low[k], -most), min(high[k], most)
        if declared.quantiles:
            least, most = _place_bounds(declared, problem, _form_of(sensitivity, parameter.mechanism))
            low[k], high[k] = least / sensitivity.scale[k], most / sensitivity.scale[k]
        elif declared.is_shape:
            least, most = _shape_bounds(declared, problem, sensitivity.scale[k])
            low[k], high[k] = max(low[k], least), min(high[k], most)
        if declared.least_periods:
            lowest = lowest_frequency(declared, problem) / sensitivity.scale[k]
            low[k] = max(low[k], min(lowest, high[k]))
    return low, high


def exceeds_record_bounds(problem: Problem, sensitivity: Sensitivity, per_record: FloatArray) -> bool:
    """Return whether an amplitude that each record has of its own is beyond the bound of those that all share.

    The amplitudes of a hum can grow without limit where another cause cancels them; no device has such a hum.

    Args:
        problem: Records that were fitted.
        sensitivity: That of the fit.
        per_record: Values (records, parameters) of the record parameters, in their order, in units.
    """
    own = [sensitivity.simulation.parameters[k].declared for k in sensitivity.record_parameters]
    most = [
        problem.thresholds.problem.most_scales * one.reach * abs(one.scale(problem.scales)) for one in own
    ]
    return bool((np.abs(per_record) > np.where([one.is_shape for one in own], np.inf, most)).any())


def places_of_motion(declared: Parameter, problem: Problem, form: str) -> list[float]:
    """Return the quantiles of the measured displacement that a place of the motion declares for `form`, in its unit.

    Where only a velocity or an acceleration was measured, they are those of its integral about zero; where neither was,
    those of a normal distribution.
    """
    return _quantiles(declared, problem, _levels_of(declared, form))


def _place_bounds(declared: Parameter, problem: Problem, form: str) -> tuple[float, float]:
    """Return the range of a place of the motion, in its unit: to the end of the motion where a search begins near it.

    A stop that a motion only just reaches is touched in few samples; one of two may be near the middle of the motion,
    as that of a joint with little play.
    """
    levels, margin = _levels_of(declared, form), problem.thresholds.problem.end_of_motion
    ends = (
        0.0 if min(levels) < margin else min(*levels, MIDDLE),
        1.0 if max(levels) > 1.0 - margin else max(*levels, MIDDLE),
    )
    least, most = _quantiles(declared, problem, ends)
    measured = any("displacement" in record.measured for record in problem.records)
    beyond = 1.0 if measured else problem.thresholds.problem.beyond_integrated
    return least * (beyond if ends[0] == 0.0 else 1.0), most * (beyond if ends[1] == 1.0 else 1.0)


def _levels_of(declared: Parameter, form: str) -> Sequence[float]:
    chosen = declared.quantiles.get(form) or declared.quantiles.get("")
    return chosen or [one for own in declared.quantiles.values() for one in own]


def _quantiles(declared: Parameter, problem: Problem, levels: Sequence[float]) -> list[float]:
    read = [_displacement(record, problem.scales.rate) for record in problem.records]
    read = [values for values in read if len(values)]
    if not read:
        size, far = abs(float(declared.scale(problem.scales))), problem.thresholds.problem.farthest_quantile
        return [size * NormalDist().inv_cdf(min(max(level, far), 1.0 - far)) for level in levels]
    found: list[float] = np.quantile(np.concatenate(read), levels).tolist()
    return found


def _displacement(record: FitRecord, rate: float) -> FloatArray:
    """Return the displacement that was measured and is scored, or that another reading shows; of a sweep none."""
    if "displacement" in record.measured:
        return record.measured["displacement"][record.first :]
    if "frequency" in record.stimulus.inputs or not record.measured:
        return np.empty(0)
    return integrate_motion(record, response_of([record]), rate)


def lowest_frequency(declared: Parameter, problem: Problem) -> float:
    """Return the frequency [Hz] of which the shortest record holds the periods that a shape declares, at least."""
    return declared.least_periods / min((one.samples - one.first) * one.period_s for one in problem.records)


def _form_of(sensitivity: Sensitivity, identity: str) -> str:
    """Return the form of a mechanism whose amplitude is fitted; "" if there is none, or if several are."""
    mechanism = next(one for one in sensitivity.simulation.mechanisms if one.id == identity)
    fitted = [sensitivity.simulation.parameters[k] for k in sensitivity.free]
    forms = {mechanism.form_of(one.declared.name) for one in fitted if one.mechanism == identity}
    forms.discard("")
    return forms.pop() if len(forms) == 1 else ""


def _shape_bounds(declared: Parameter, problem: Problem, unit: float) -> tuple[float, float]:
    """Return the range of a shape over `unit`, by multiples of its default, or of its scale where that is open."""
    open_ended = not declared.default or declared.searched
    scale = declared.scale(problem.scales) if open_ended else declared.default or 0.0
    size = abs(float(scale)) / unit
    least = 0.0 if declared.smooth else declared.shape_range[0]
    lowest = -declared.shape_range[1] if declared.low < 0.0 else least
    return lowest * size, declared.shape_range[1] * size


def clip_to_bounds(simulation: Simulation, values: FloatArray) -> Simulation:
    """Return `simulation` at the parameter values (parameters,), each clipped to its bounds."""
    low = np.array([parameter.low for parameter in simulation.parameters])
    high = np.array([parameter.high for parameter in simulation.parameters])
    return simulation.with_values(np.clip(values, low, high))
