"""Parts of the user inside the loop: what they raise or return wrongly ends the run with a message that names them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rtctl.border.errors import DriverError, Fault, RtctlError
from rtctl.interfaces import ControlAction, Controller, Estimate, Estimator


class _Guarded:
    """An own part; attributes that are not wrapped are the part's."""

    def __init__(self, sort: str, name: str, part: Any) -> None:
        self._sort, self._name, self._part = sort, name, part

    def __getattr__(self, attribute: str) -> Any:
        return getattr(self._part, attribute)

    def _call(self, method: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return method(*arguments)
        except RtctlError:
            raise
        except Exception as error:
            raise DriverError(
                Fault.PART_FAILED,
                f'{self._sort} "{self._name}": {method.__name__} raised {type(error).__name__}: {error}',
            ) from error

    def _refuse(self, method: str, wanted: str, got: Any) -> DriverError:
        message = f'{self._sort} "{self._name}": {method} must return {wanted}, got {got!r}'
        return DriverError(Fault.PART_FAILED, message)


class GuardedEstimator(_Guarded):
    """`Estimator` around one of the user's."""

    def __init__(self, name: str, part: Estimator) -> None:
        super().__init__("estimator", name, part)
        self.surrogate = part.surrogate

    def start(self, levels: Sequence[float], sensed: Sequence[float]) -> Estimate:
        """See `Estimator.start`. Raises DriverError."""
        return self._checked("start", self._call(self._part.start, levels, sensed))

    def step(self, levels: Sequence[float], sensed: Sequence[float], elapsed_s: float) -> Estimate:
        """See `Estimator.step`. Raises DriverError."""
        return self._checked("step", self._call(self._part.step, levels, sensed, elapsed_s))

    def _checked(self, method: str, made: Any) -> Estimate:
        if isinstance(made, Estimate):
            return made
        raise self._refuse(method, "an Estimate(value, surrogate, confidence, status)", made)


class GuardedController(_Guarded):
    """`Controller` around one of the user's."""

    def __init__(self, name: str, part: Controller, commands: int) -> None:
        super().__init__("controller", name, part)
        self.terms = tuple(part.terms)
        self.preview_s = float(getattr(part, "preview_s", 0.0))
        self._commands = commands

    def start(self, levels: Sequence[float], setpoint: float, estimate: Estimate) -> None:
        """See `Controller.start`. Raises DriverError."""
        self._call(self._part.start, levels, setpoint, estimate)

    def step(self, setpoint: float, upcoming: float, estimate: Estimate, elapsed_s: float) -> ControlAction:
        """See `Controller.step`. Raises DriverError."""
        made = self._call(self._part.step, setpoint, upcoming, estimate, elapsed_s)
        if not isinstance(made, ControlAction):
            raise self._refuse("step", "a ControlAction(levels, terms)", made)
        if len(made.levels) != self._commands or len(made.terms) != len(self.terms):
            wanted = f"{self._commands} levels and {len(self.terms)} terms"
            raise self._refuse("step", wanted, made)
        return made

    def applied(self, levels: Sequence[float]) -> None:
        """See `Controller.applied`. Raises DriverError."""
        self._call(self._part.applied, levels)


def guarded_estimator(name: str, part: Estimator) -> Estimator:
    """Return `part`, whose errors become messages that name it."""
    return GuardedEstimator(name, part)


def guarded_controller(name: str, part: Controller, commands: int) -> Controller:
    """Return `part` for a device with so many commands, whose errors become messages that name it."""
    return GuardedController(name, part, commands)
