"""A model's estimator on the rows of a run, as one that takes over follows them, and what it knows of the film."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.hysteresis.film_memory import FilmMemory, Remembering
from rtctl.scenario.schema import Scenario
from rtctl.session.live.successors import Onset, past_of
from rtctl.wiring import build_estimator

MEMORIES, EVERY_S = 64, 0.5
"""Memories that are kept, and the time between two of them [s]."""


class Followed:
    """An estimator that follows a run, from the model that was right before on."""

    def __init__(self, scenario: Scenario, model: Any, before: Any, onset: Onset) -> None:
        """Prepare.

        Args:
            scenario: That of the run.
            model: The model.
            before: The model that was right until `onset.until`.
            onset: Since when `model` is right.
        """
        self._profile, self._delay = scenario.profile, scenario.reading_delay
        self._every = round(EVERY_S / scenario.scenario.period_s)
        self._period_s = scenario.scenario.period_s
        self._estimator = build_estimator(scenario, model)
        self._past = past_of(scenario, before, onset, self._estimator)
        self._sent: deque[tuple[float, ...]] = deque(maxlen=self._delay + 1)
        self._last = -1
        self._memories: deque[tuple[int, FilmMemory]] = deque(maxlen=MEMORIES)

    def follow(self, rows: Mapping[str, FloatArray]) -> FloatArray:
        """Follow further rows; return the estimate of each (n,) [the output's unit], NaN of a run's first one."""
        sensed = np.stack([rows[channel.name] for channel in self._profile.sensed], axis=1).tolist()
        levels = np.stack([rows[channel.name] for channel in self._profile.commands], axis=1).tolist()
        values = []
        for index, level, reading in zip(rows["index"].astype(int).tolist(), levels, sensed, strict=True):
            values.append(self._take(index, tuple(level), tuple(reading)))
        return np.array(values)

    def memory_before(self, sample: int) -> tuple[int, FilmMemory] | None:
        """See `Belief.memory_before`."""
        return next((one for one in reversed(self._memories) if one[0] <= sample), None)

    def _take(self, index: int, level: tuple[float, ...], reading: tuple[float, ...]) -> float:
        if not self._sent:
            self._sent.extend((self._delay + 1) * [level])
            self._last = index
            self._estimator.start(level, reading)
            if self._past is not None:
                self._past.start(level, reading)
            return float("nan")
        self._sent.append(level)
        believed, elapsed_s = self._sent[0], (index - self._last) * self._period_s
        if self._past is not None:
            self._past.take(index, believed, reading, elapsed_s)
        self._last = index
        value = self._estimator.step(believed, reading, elapsed_s).value
        if index % self._every == 0 and isinstance(self._estimator, Remembering):
            self._memories.append((index + 1, self._estimator.film_memory()))
        return value
