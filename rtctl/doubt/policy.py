"""What is done about a finding. Each policy only takes away what the loop may do; none adds anything.

    warn     nothing: the event and its message
    derate   the controller's gains once to half, through the run's control socket, whose rules judge them
    stop     the run ends at its safe levels, through the same socket

Halving kp and ki together leaves their zero where it is and lowers the open loop at all frequencies: of a stable loop
around a first-order device with dead time every margin grows. Findings about noise, about the reference instrument
(which the loop does not use) and about what was learned change nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import StrEnum

from rtctl.border.errors import InputError, RunError
from rtctl.doubt.watch import Finding

Act = Callable[[Finding], str]
ACTED_ON = frozenset({"device", "sensor", "estimator"})
GAINS = ("controller.kp", "controller.ki")
LESS = 0.5


class Policy(StrEnum):
    """What to do."""

    WARN = "warn"
    DERATE = "derate"
    STOP = "stop"


def acting(
    policy: Policy,
    parameters: Callable[[], Mapping[str, float]],
    change: Callable[[str, float], object],
    stop: Callable[[], None],
) -> Act:
    """Return what a policy does about a finding; it does so once.

    Args:
        policy: which.
        parameters: returns the controller's parameters by name.
        change: changes one.
        stop: ends the run at its safe levels.
    """
    done: list[str] = []

    def act(finding: Finding) -> str:
        if policy is Policy.WARN or done or finding.kind not in ACTED_ON:
            return ""
        try:
            done.append(_stopped(stop) if policy is Policy.STOP else _derated(parameters(), change))
        except (InputError, RunError) as error:
            # the run has just ended, or refuses: it is said, the watch goes on
            return f"{policy}: not done: {error}"
        return done[-1]

    return act


def _stopped(stop: Callable[[], None]) -> str:
    stop()
    return "stop: the run was asked to end at its safe levels"


def _derated(parameters: Mapping[str, float], change: Callable[[str, float], object]) -> str:
    gains = [name for name in GAINS if name in parameters]
    if not gains:
        return "derate: not done: the controller has no gains that can be changed"
    for name in gains:
        change(name, LESS * parameters[name])
    return "derate: " + ", ".join(
        f"{name} {parameters[name]:.3g} -> {LESS * parameters[name]:.3g}" for name in gains
    )
