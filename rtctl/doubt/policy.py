"""What is done about a finding. No policy lets the loop do more: limits and guards stay those of the run's start.

    warn     nothing: the event and its message
    derate   the controller's gains once to half, through the run's control socket, whose rules judge them
    stop     the run ends at its safe levels, through the same socket
    retune   a model with the cause that was named takes over, on trial (`rtctl.session.doubting.retuning`)

Halving kp and ki together leaves their zero where it is and lowers the open loop at all frequencies: of a stable loop
around a first-order device with dead time every margin grows. Findings about noise, about the reference instrument
(which the loop does not use) and about what was learned change nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from enum import StrEnum

from rtctl.border.errors import InputError, RunError
from rtctl.doubt.watch import Finding

ACTED_ON = frozenset({"device", "sensor", "estimator"})
GAINS = ("controller.kp", "controller.ki")
LESS = 0.5


class Policy(StrEnum):
    """What to do."""

    WARN = "warn"
    DERATE = "derate"
    STOP = "stop"
    RETUNE = "retune"


class OnceActing:
    """A policy that acts once: `warn`, `derate` or `stop`."""

    def __init__(
        self,
        policy: Policy,
        parameters: Callable[[], Mapping[str, float]],
        change: Callable[[str, float], object],
        stop: Callable[[], None],
    ) -> None:
        """Prepare a policy.

        Args:
            policy: which.
            parameters: returns the controller's parameters by name.
            change: changes one.
            stop: ends the run at its safe levels.
        """
        self._policy, self._parameters, self._change, self._stop = policy, parameters, change, stop
        self._is_done = False

    def act(self, finding: Finding) -> str:
        """Return what is done about a finding, in words; "": nothing."""
        if self._policy is Policy.WARN or self._is_done or finding.kind not in ACTED_ON:
            return ""
        try:
            stops = self._policy is Policy.STOP
            said = _stopped(self._stop) if stops else _derated(self._parameters(), self._change)
        except (InputError, RunError) as error:
            # the run has just ended, or refuses: it is said, the watch goes on
            return f"{self._policy}: not done: {error}"
        self._is_done = True
        return said

    def see(self, table: object) -> Iterator[Finding]:
        """Take the newest rows; nothing comes of them."""
        yield from ()


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
