"""Fitted parameters with their 95 % intervals."""

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


def estimates_of(examined: TestedHypothesis, mechanism: str) -> dict[str, Estimate]:
    """Of the parameters of one mechanism ("": the nominal ones), by name, with 95 % intervals."""
    hypothesis = examined.hypothesis
    sensitivity = hypothesis.sensitivity
    errors = examined.projected.standard_errors * sensitivity.scale
    found = {}
    for position, k in enumerate(sensitivity.free):
        parameter: FreeParameter = hypothesis.simulation.parameters[k]
        if parameter.mechanism == mechanism:
            spread = NORMAL_95 * float(errors[position])
            found[parameter.declared.name] = Estimate(
                parameter.value, parameter.value - spread, parameter.value + spread, parameter.unit
            )
    apart = set(sensitivity.record_parameters.tolist())
    forms = {name for one in hypothesis.simulation.mechanisms if one.id == mechanism for name in one.forms}
    acting = {
        one.declared.name: one.value for one in hypothesis.simulation.parameters if one.mechanism == mechanism
    }
    for k, parameter in enumerate(hypothesis.simulation.parameters):
        if k in apart and parameter.mechanism == mechanism:
            spread = NORMAL_95 * _own_error(examined)
            value = parameter.value
            found[parameter.declared.name] = Estimate(value, value - spread, value + spread, parameter.unit)
        elif mechanism and parameter.mechanism == mechanism and parameter.name in hypothesis.still:
            value = parameter.value
            form = parameter.declared.of_form or parameter.declared.name
            if form in forms and acting[form] == 0.0:  # another form of it acts
                continue
            found[parameter.declared.name] = Estimate(value, value, value, parameter.unit)
    return found


def _own_error(examined: TestedHypothesis) -> float:
    """Standard error of an amplitude in the first record: as of a tone in white noise of as much power."""
    samples = examined.projected.samples / max(len(examined.hypothesis.starts), 1)
    return float(np.sqrt(2.0 * examined.noise[0].mean_square / samples))
