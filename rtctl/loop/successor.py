"""A step that takes over from another one while the loop runs: it follows the run first, then decides, without a bump.

Until it takes over, its estimator sees the readings and commands of the run, and its controller is told after each
sample what was really commanded: its integral term makes up the difference (tracking mode), so the first command of its
own continues the one before. A replay builds the same successor from the same rows.
Reference: K. J. Astrom, T. Hagglund, Advanced PID Control, section 3.6 (bumpless transfer).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Protocol, runtime_checkable

from rtctl.border.arrays import FloatArray
from rtctl.hysteresis.film_memory import Drifting, FilmMemory, Inheriting, Remembering
from rtctl.interfaces import Estimator
from rtctl.loop.step import Levels, Step, upcoming_setpoints


class PastRows(NamedTuple):
    """Rows of a run, as the loop recorded them."""

    samples: FloatArray
    """Number of each sample (n,)."""
    setpoint: FloatArray
    """Setpoint of each sample (n,) [controlled unit]."""
    sensed: FloatArray
    """Readings (n, channels) [their units]."""
    commanded: FloatArray
    """Levels that were commanded last before each reading (n, commands) [their units]."""


@runtime_checkable
class Predecessor(Estimator, Inheriting, Remembering, Protocol):
    """An estimator that can follow until a device changed."""


class Past:
    """The model that was right until the device changed: what relays remember was made by the device as it was.

    Its estimator follows until then, and hands its memory on to the heir.
    """

    # 6 parameters because a past is told by its model, its time and its memory
    def __init__(
        self,
        number: int,
        until: int,
        estimator: Predecessor,
        heir: Drifting,
        *,
        memory: FilmMemory | None,
        at: int,
    ) -> None:
        """Prepare; `memory`: what the film had been through before sample `at`, None: a run is followed from its start.

        Args:
            number: Of the model.
            until: Sample from which on the device is another one.
            estimator: Of that model.
            heir: The estimator of the other model, which follows beside it.
            memory: See above.
            at: See above.
        """
        self.number, self.until, self.at = number, until, at
        self.knows = memory is not None
        self._estimator, self._heir, self._memory, self._is_over = estimator, heir, memory, False

    def start(self, levels: Levels, sensed: Levels) -> None:
        """Start at rest at the applied levels [their units] with readings [their units]."""
        self._estimator.start(levels, sensed)

    def take(self, index: int, believed: Levels, sensed: Levels, elapsed_s: float) -> None:
        """Take a sample, before the heir does; see `Estimator.step`."""
        if self._is_over:
            return
        if index >= self.until:
            self._heir.inherit(self._estimator.film_memory())
            self._heir.drift_from_now()
            self._is_over = True
            return
        if self._memory is not None and index >= self.at:
            self._estimator.inherit(self._memory)
            self._memory = None
        self._estimator.step(believed, sensed, elapsed_s)


def hand_on(before: Step, heir: Step) -> None:
    """Let a step take over what the film has been through from the one that decided so far, where both can."""
    if not isinstance(before.estimator, Remembering):
        return
    memory = before.estimator.film_memory()
    for part in (heir.estimator, getattr(heir.controller, "feedforward", None)):
        if isinstance(part, Inheriting):
            part.inherit(memory)


class Successor:
    """A step on its way to take over."""

    def __init__(self, number: int, step: Step, setpoints: FloatArray, period_s: float, delay: int) -> None:
        """Prepare a step for a plan.

        Args:
            number: of the model that it is made of; 0: the run's first one.
            step: estimator, controller and limits.
            setpoints: the plan (n,) [controlled unit].
            period_s: sample period [s].
            delay: age of the command in force when a reading was taken, in commands.
        """
        self.number, self.step, self._period_s = number, step, period_s
        self.upcoming = upcoming_setpoints(setpoints, period_s, step.preview_s)
        """The setpoint that each sample's command aims at (n,) [controlled unit]."""
        self.past: Past | None = None
        """The model that is followed until the device changed; None: the step's own is right from the start."""
        self.since = -1
        """The sample from which on it has followed."""
        self.newer: Callable[[], PastRows | None] = lambda: None
        """Returns rows that were recorded after the last ones that it has followed; None: there are none."""
        self._plan, self._delay = setpoints, delay
        self._sent: deque[Levels] = deque(maxlen=delay + 1)
        self._previous = -1
        self._waiting: tuple[int, float, Levels] | None = None

    def start(self, since: int, levels: Levels, sensed: Levels) -> None:
        """Start before sample `since`, at rest at the applied levels [their units] with readings [their units]."""
        self.since, self._previous, self._waiting = since, since - 1, None
        self._sent.extend((self._delay + 1) * [levels])
        self.step.start(levels, float(self._plan[since]), sensed, self._period_s)
        if self.past is not None:
            self.past.start(levels, sensed)

    def follow(self, rows: PastRows) -> None:
        """Follow rows in their order; the last one waits until it is known what was commanded after it."""
        sensed, commanded = rows.sensed.tolist(), rows.commanded.tolist()
        for k, (index, setpoint) in enumerate(
            zip(rows.samples.tolist(), rows.setpoint.tolist(), strict=True)
        ):
            levels = tuple(commanded[k])
            self._complete(levels)
            self._sent.append(levels)
            self._waiting = int(index), setpoint, tuple(sensed[k])

    def take_over(self, levels: Levels) -> int:
        """Follow what is left, with the levels that are in force now; return the sample that was the last one."""
        while (rows := self.newer()) is not None:
            self.follow(rows)
        self._complete(levels)
        return self._previous

    def knows_all(self, first: int) -> bool:
        """Return whether it has followed all of the run, which began before sample `first`, or was told what was."""
        return self.since <= first or (
            self.past is not None and self.past.knows and self.since <= self.past.at
        )

    def _complete(self, levels: Levels) -> None:
        """Take the row that waits, after which `levels` were commanded."""
        if self._waiting is None:
            return
        index, setpoint, sensed = self._waiting
        aimed = float(self.upcoming[index]) if setpoint == self._plan[index] else setpoint
        elapsed_s = (index - self._previous) * self._period_s
        if self.past is not None:
            self.past.take(index, self._sent[0], sensed, elapsed_s)
        self.step.follow(setpoint, aimed, self._sent[0], levels, sensed, elapsed_s)
        self._previous, self._waiting = index, None
