"""The law of a scenario and a model, as `rtctl run` would build it. Says which part cannot be exported, and why."""

from __future__ import annotations

from typing import Any

from rtctl.border.errors import InputError
from rtctl.controllers.pid import PidController
from rtctl.export.c.laws.equations.pid import pid_law
from rtctl.export.c.laws.law import Law
from rtctl.export.c.laws.loop_memory import Parts
from rtctl.export.c.laws.resonator import resonator_law
from rtctl.export.c.laws.vo2 import vo2_law
from rtctl.models.resonator import ResonatorModel
from rtctl.models.vo2 import Vo2Model
from rtctl.scenario.command_sequence import settling
from rtctl.scenario.schema import Scenario
from rtctl.session.closed_loop import plan_control
from rtctl.wiring import build_guard, build_plausibility

EXTREMA = 64
"""Turning points that an exported Preisach memory keeps."""


def law_of(scenario: Scenario, model: Any, extrema: int = EXTREMA) -> Law:
    """Return the law of a scenario.

    Args:
        scenario: the checked scenario.
        model: the identified model.
        extrema: turning points that a Preisach memory keeps.

    Raises:
        InputError: a part cannot be exported, or model and scenario contradict each other.
    """
    if scenario.reference is None:
        raise InputError(
            "export c: the scenario has no [reference]: it plays a current in open loop, and there is no controller"
        )
    chain, _, _ = plan_control(scenario, model)
    parts = Parts(
        profile=scenario.profile,
        estimator=chain.estimator,
        controller=chain.controller,
        limits=chain.limits,
        plausibility=build_plausibility(scenario, scenario.profile),
        guard=build_guard(scenario, scenario.profile),
        period_s=scenario.scenario.period_s,
        settle_steps=settling(scenario),
        delay=scenario.reading_delay,
    )
    if scenario.references:
        raise InputError("export c: loops of several outputs ([references]) have no form in C")
    if isinstance(model, Vo2Model):
        return vo2_law(model, parts, extrema)
    if isinstance(model, ResonatorModel):
        return resonator_law(model, parts)
    if type(parts.controller) is PidController:
        return pid_law(model, parts)
    raise InputError(
        f'export c: the controller of this "{scenario.scenario.plant}" is a {type(parts.controller).__name__}; the '
        'loops of a "vo2" and of a "me", and a PID on a reading of the output, can be exported'
    )
