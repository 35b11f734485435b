"""What a scenario plays: levels of its excitations, how many exchanges they take, and what of it a run refuses."""

from __future__ import annotations

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.scenario.schema import Scenario

MOST_STEPS = 30_000_000


def command_sequences(scenario: Scenario) -> list[FloatArray]:
    """Return the levels of the first command [its unit] in each excitation, a value for each of its periods.

    Raises InputError.
    """
    limits = scenario.limits
    built = []
    for index, excitation in enumerate(scenario.excitation):
        period_s = scenario.at_period_of(index).scenario.period_s
        try:
            level = excitation.build(limits.low, limits.high, period_s)
        except ValueError as error:
            raise InputError(f"excitation {index}: {error}") from None
        if not (level.min() >= limits.low - 1e-9 and level.max() <= limits.high + 1e-9):
            unit = scenario.profile.commands[0].unit
            raise InputError(
                f"excitation {index} asks for {level.min():.4g} to {level.max():.4g} {unit}, "
                f"[limits] allow {limits.low:g} to {limits.high:g} {unit}"
            )
        built.append(level)
    return built


def check_one_period(scenario: Scenario) -> None:
    """Raise InputError where an excitation has a period of its own: a run plays all of them at one."""
    for index, excitation in enumerate(scenario.excitation):
        if excitation.period_s not in (None, scenario.scenario.period_s):
            raise InputError(
                f"excitation {index} has a period of its own, {excitation.period_s:g} s, and a run has one period "
                f"({scenario.scenario.period_s:g} s); rtctl acquire plays each record at its own"
            )


def check_length(steps: float) -> None:
    """Raise InputError for more steps than a run keeps in memory."""
    if steps > MOST_STEPS:
        raise InputError(
            f"scenario.duration and scenario.period ask for {steps:.3g} steps, a run keeps at most {MOST_STEPS:.0e} in "
            "memory; shorten the one or lengthen the other"
        )


def steps_of(scenario: Scenario) -> int:
    """Exchanges that a run takes, the settling before each part included. Raises InputError."""
    period_s = scenario.scenario.period_s
    if scenario.reference is not None:
        check_length((scenario.scenario.duration_s or 0.0) / period_s)
        return settling(scenario) + round((scenario.scenario.duration_s or 0.0) / period_s)
    return sum(
        settling(scenario.at_period_of(k)) + len(levels)
        for k, levels in enumerate(command_sequences(scenario))
    )


def settling(scenario: Scenario) -> int:
    """Exchanges before a part begins."""
    return round(scenario.clock.settle_s / scenario.scenario.period_s)
