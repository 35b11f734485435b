"""Estimates of the fitted parameters with their 95 % intervals, by the noise of the residual."""

from __future__ import annotations

import numpy as np

from rtctl.border.simulation import FreeParameter
from rtctl.border.statistics import NORMAL_95
from rtctl.diagnosis.problem.estimate import Estimate
from rtctl.diagnosis.residual.residual_tests import TestedHypothesis


def estimates_by_mechanism(tested: TestedHypothesis) -> dict[str, dict[str, Estimate]]:
    """Return the estimates of all parameters by mechanism ("": the nominal model) and name."""
    mechanisms = ("", *(mechanism.id for mechanism in tested.hypothesis.simulation.mechanisms))
    return {mechanism: estimates_of(tested, mechanism) for mechanism in mechanisms}


def estimates_of(tested: TestedHypothesis, mechanism: str) -> dict[str, Estimate]:
    """Return the estimates of the parameters of one mechanism ("": the nominal model), by name.

    A parameter that was not fitted has an interval of width zero; those of another form than acts are left out.
    """
    hypothesis = tested.hypothesis
    sensitivity = hypothesis.sensitivity
    errors = tested.projected.standard_errors * sensitivity.scale
    estimates = {}
    for position, k in enumerate(sensitivity.free):
        parameter: FreeParameter = hypothesis.simulation.parameters[k]
        if parameter.mechanism == mechanism:
            spread = NORMAL_95 * float(errors[position])
            estimates[parameter.declared.name] = _estimate(parameter, spread)
    of_record = set(sensitivity.record_parameters.tolist())
    for k, parameter in enumerate(hypothesis.simulation.parameters):
        if parameter.mechanism != mechanism:
            continue
        if k in of_record:
            spread = NORMAL_95 * _amplitude_error(tested)
            estimates[parameter.declared.name] = _estimate(parameter, spread)
        elif mechanism and parameter.name in hypothesis.fixed_parameters and _acts(tested, parameter):
            estimates[parameter.declared.name] = _estimate(parameter, 0.0)
    return estimates


def _estimate(parameter: FreeParameter, spread: float) -> Estimate:
    value = parameter.value
    return Estimate(value, value - spread, value + spread, parameter.unit)


def _acts(tested: TestedHypothesis, parameter: FreeParameter) -> bool:
    """Return whether the form of its mechanism to which a parameter belongs acts."""
    simulation = tested.hypothesis.simulation
    forms = {name for one in simulation.mechanisms if one.id == parameter.mechanism for name in one.forms}
    amplitudes = {
        one.declared.name: one.value for one in simulation.parameters if one.mechanism == parameter.mechanism
    }
    form = parameter.declared.of_form or parameter.declared.name
    return not (form in forms and amplitudes[form] == 0.0)


def _amplitude_error(tested: TestedHypothesis) -> float:
    """Return the standard error of an amplitude in one record, as of a tone in white noise of the same power."""
    samples = tested.projected.samples / max(len(tested.hypothesis.starts), 1)
    return float(np.sqrt(2.0 * tested.noise[0].mean_square / samples))
