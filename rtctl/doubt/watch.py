"""The watch: rows of a run in, findings out, in bounded memory.

A window a second; its numbers against those of the past (`reference_windows`), summed up (`sequential`). The first
windows are the past; of them only the model's own errors can say whether the device was the model at all.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.doubt.belief import Belief, Rows
from rtctl.doubt.naming import Answer, answer_of
from rtctl.doubt.reference_windows import NEW, ReferenceWindows
from rtctl.doubt.sequential import CumulativeSum
from rtctl.doubt.standing import Standing
from rtctl.doubt.window import LEAST_MOTION, Window, window_of

WINDOW_S = 1.0
LEARNED = 8
"""Windows that are the past, after the first one, in which the device warms up."""
KEPT = 24
"""Windows of rows that are kept for naming."""
AFTER = 4
"""Windows after an alarm before it is named."""
FLOOR = 0.1
"""Of the model's error: what a number may differ by between two windows of the same motion, at least."""
FAST_FLOOR, FAST_MODEL = 0.3, 0.7
"""Of the logarithm of the noise: deviation on the same motion, and over all motions."""
FAR_OFF = 8.0
"""Errors of the model by which the first windows must differ before the device counts as another one."""
ESTIMATE_OFF = 0.15
"""Of the output's range: an estimate that is off by more from a model that agrees with the readings is wrong."""
AS_BEFORE = 2.0
"""Cost of no further change up to which what was named before is enough."""
AGREES = 6.0
"""Errors of the model within which current and readings agree with it."""
ALIKE = 0.95
"""|cos| of two directions beyond which small changes along them are not told apart."""


class Finding(NamedTuple):
    """Something that the watch has to say."""

    kind: str
    """learned | noise | sensor | device | instrument | estimator | differs | named"""
    sample: int
    """Sample after which it is said."""
    since: int
    """Sample at which it began, as far as that is known."""
    message: str
    causes: tuple[Answer, ...] = ()


class Watch:
    """Feed it rows, in order."""

    def __init__(self, belief: Belief, period_s: float) -> None:
        self._belief = belief
        self._size = max(round(WINDOW_S / period_s), 20)
        self._period_s = period_s
        self._waiting: list[Rows] = []
        self._held = 0
        self._kept: deque[Rows] = deque(maxlen=KEPT)
        self.windows = 0
        self.blind = 0
        """Windows that moved too little to tell how the device answers."""
        self.compared = 0
        """Windows that were compared with those before."""
        n = len(belief.directions)
        self._errors = np.concatenate([np.full(n, belief.reading_error), np.full(n, belief.output_error)])
        self._past: list[Window] = []
        self._reference: ReferenceWindows | None = None
        self._sums = CumulativeSum(2 * n + 1)
        self._to_name = 0
        self._onset = 0
        self._off = 0
        self._said: set[str] = set()
        self._standing, self._stuck = Standing(belief.reading_error), False
        self._before = (belief.reading_error**2, belief.output_error**2)
        """Mean square residuals of reading and output while nothing had changed yet."""
        self._changed = False
        self._first: ReferenceWindows | None = None
        self.gram: FloatArray = np.zeros((n, n))
        self.output_gram: FloatArray = np.zeros((n, n))
        self.z: FloatArray = np.zeros(2 * n + 1)
        self.state = "learning"

    def restart(self, level: float) -> None:
        """Begin again from a cold device, as after a re-arming: at rest at an applied level [the command's unit]."""
        self._belief.start(level)
        self._waiting, self._held = [], 0
        self._kept.clear()
        self._to_name = 0
        self.windows = 0

    def feed(self, rows: Rows) -> Iterator[Finding]:
        """Take rows; yield what there is to say."""
        self._waiting.append(rows)
        self._held += len(rows.samples)
        while self._held >= self._size:
            whole = joined(self._waiting)
            window, rest = cut(whole, self._size)
            self._waiting, self._held = [rest], len(rest.samples)
            yield from self._window(window)

    def isolability(self) -> dict[str, dict[str, object]]:
        """Return |cos| of the answers to each pair of directions, by the reading alone and with the reference."""
        names = [one.id for one in self._belief.directions]
        scale = (self._belief.reading_error / self._belief.output_error) ** 2
        ways = {"reading": self.gram}
        if self.output_gram.any():
            ways["reading and reference"] = self.gram + scale * self.output_gram
        told: dict[str, dict[str, object]] = {}
        for way, gram in ways.items():
            size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
            cosines = np.abs(gram / np.outer(size, size))
            alike = [
                (names[j], names[k]) for j in range(len(names)) for k in range(j) if cosines[j, k] > ALIKE
            ]
            told[way] = {"directions": names, "cosines": np.round(cosines, 3).tolist(), "alike": alike}
        return told

    def _window(self, rows: Rows) -> Iterator[Finding]:
        seen = self._belief.predict(rows)
        self._kept.append(rows)
        self.windows += 1
        if self.windows == 1:
            return  # it holds the way from the cold device
        if self._standing.add(rows.sensed, seen.reading):
            yield from self._stands(rows)
            return
        if self._stuck:  # it moves again: what it read meanwhile explains no change
            self._stuck = False
            self._kept.clear()
            self._kept.append(rows)
        window = window_of(rows, seen)
        self.gram += window.gram
        self.output_gram += window.output_gram
        self.blind += window.moved < LEAST_MOTION
        yield from self._check_estimate(window)
        if self._to_name:
            self._to_name -= 1
            if not self._to_name:
                yield self._named(window.last, AFTER)
                self._learn_anew()
            return
        if self._reference is None:
            yield from self._learn(window)
            return
        yield from self._compare(window)

    def _stands(self, rows: Rows) -> Iterator[Finding]:
        """Say that the reading stands still, and name nothing else from it."""
        self._to_name = 0
        if not self._stuck:
            self._stuck = True
            yield Finding(
                "sensor",
                int(rows.samples[-1]),
                int(rows.samples[0]),
                "the reading stands still while the device must have moved",
            )

    def _numbers(self, window: Window) -> FloatArray:
        least = FLOOR * self._belief.reading_error
        return np.concatenate([window.along, window.output_along, [math.log(max(window.fast, least))]])

    def _learn(self, window: Window) -> Iterator[Finding]:
        self._past.append(window)
        far = np.abs(self._numbers(window)[:-1]) / self._errors
        if np.nanmax(far, initial=0.0) > FAR_OFF and "differs" not in self._said:
            self._said.add("differs")
            j = int(np.nanargmax(far)) % len(self._belief.directions)
            yield Finding(
                "differs", window.last, window.first,
                f"the device is not the model from the start: its readings are {np.nanmax(far):.0f} errors of the "
                f"model away, most like {self._belief.directions[j].id}",
            )  # fmt: skip
        if len(self._past) == LEARNED:
            self._begin()
            yield Finding(
                "learned",
                window.last,
                window.first,
                f"{LEARNED} windows are learned: later ones are compared with them",
            )

    def _begin(self) -> None:
        numbers = np.array([self._numbers(one) for one in self._past])
        motions = np.array([one.motion for one in self._past])
        rms = math.sqrt(np.mean([one.rms**2 for one in self._past]))
        outputs = [one.output_rms for one in self._past if one.output_rms == one.output_rms]
        off = math.sqrt(np.mean(np.square(outputs))) if outputs else math.nan
        n = len(self._belief.directions)
        model = np.concatenate([
            np.full(n, max(rms, self._belief.reading_error) ** 2),
            np.full(n, max(off if off == off else 0.0, self._belief.output_error) ** 2), [FAST_MODEL**2],
        ])  # fmt: skip
        floor = np.concatenate([(FLOOR * self._errors) ** 2, [FAST_FLOOR**2]])
        reference = ReferenceWindows(floor, model)
        for k, (motion, values) in enumerate(zip(motions, numbers, strict=True)):
            if k and np.max(np.abs(motions[:k] - motion), axis=1).min() < NEW:
                near = int(np.argmin(np.max(np.abs(motions[:k] - motion), axis=1)))
                reference.floor = np.fmax(reference.floor, 0.5 * (values - numbers[near]) ** 2)
            reference.add(motion, values, np.zeros_like(values))
        if self._first is not None:
            # what a drift adds to the windows of today is no reason to trust them less
            reference.floor, reference.model = self._first.floor, self._first.model
        self._first = self._first or reference
        self._reference = reference
        if not self._changed:
            self._before = (
                max(rms, 0.3 * self._belief.reading_error) ** 2,
                off * off if off == off else math.nan,
            )
        self._sums.restart()
        self.state = "watching"

    def _compare(self, window: Window) -> Iterator[Finding]:
        reference = self._reference
        assert reference is not None
        self.compared += 1
        numbers = self._numbers(window)
        found = reference.compare(window.motion, numbers)
        self.z = found.z
        if self._sums.add(found.z):
            n = len(self._belief.directions)
            sums = self._sums.sums
            kind = _kind(found.z, n) if np.max(sums[: 2 * n], initial=0.0) >= 0.5 * sums[-1] else "noise"
            back = max(self._sums.windows_since, 1)
            self._onset = back
            since = window.last + 1 - back * self._size
            self.state = "alarmed"
            if kind == "noise":
                yield Finding(
                    kind,
                    window.last,
                    since,
                    "the noise of the readings has grown; the device answers as before",
                )
                self._learn_anew()
                return
            self._to_name = AFTER
            yield Finding(kind, window.last, since, WORDS[kind])
        elif found.distance > NEW and np.nanmax(np.abs(found.z)) < 2.0:
            reference.add(window.motion, numbers, found.variance)

    def finish(self) -> Iterator[Finding]:
        """End the watch: name what alarmed just before."""
        if self._to_name and self._kept:
            yield self._named(int(self._kept[-1].samples[-1]), AFTER - self._to_name)
            self._to_name = 0

    def _named(self, last: int, after: int) -> Finding:
        """Name a change from the rows that are kept, the last `after` windows of which came after the alarm."""
        rows = joined(self._kept)
        onset = max(len(rows.samples) - (self._onset + after) * self._size, 0)
        found = self._belief.explain(rows, onset, self._before)
        answers = answer_of(found)
        if self._changed and found[0].cost < AS_BEFORE:
            return Finding(
                "named", last, int(rows.samples[onset]), "what was named before explains it: it goes on"
            )
        if answers:
            best = next(one for one in found if one.id == answers[0].id)
            self._belief.take(best, int(rows.samples[onset]))
        said = " or ".join(f"{one.statement} ({100.0 * one.probability:.0f} %)" for one in answers[:2])
        return Finding("named", last, int(rows.samples[onset]), said or "no known cause explains it", answers)

    def _learn_anew(self) -> None:
        self._past, self._reference = [], None
        self._changed = True
        self._said.add("differs")
        self.state = "learning"

    def _check_estimate(self, window: Window) -> Iterator[Finding]:
        belief = self._belief
        agrees = window.rms < AGREES * math.sqrt(self._before[0])
        if window.estimate_off > ESTIMATE_OFF * belief.output_width and agrees and not self._changed:
            if "estimator" not in self._said:
                self._said.add("estimator")
                yield Finding(
                    "estimator", window.last, window.first,
                    f"the estimate is {window.estimate_off:.3g} {belief.output_unit} off where current and readings "
                    "agree with the model: the estimator is wrong, not the device; start it again",
                )  # fmt: skip
        else:
            self._said.discard("estimator")


WORDS = {
    "sensor": "the readings have changed, the reference has not: the sensor",
    "device": "the device no longer answers as its model",
    "instrument": "the reference has changed, the readings have not: the beam or its instrument",
}


def _kind(z: FloatArray, n: int) -> str:
    """Return what differs, by the numbers of reading and reference."""
    reading, reference = np.nanmax(np.abs(z[:n])), np.nanmax(np.abs(z[n : 2 * n]), initial=0.0)
    if not np.isfinite(z[n : 2 * n]).any():
        return "device"
    if reading >= 3.0 > reference:
        return "sensor"
    return "instrument" if reference >= 3.0 > reading else "device"


def joined(parts: list[Rows] | deque[Rows]) -> Rows:
    """Return rows one after the other."""
    return Rows(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def cut(rows: Rows, count: int) -> tuple[Rows, Rows]:
    """Return the first `count` rows, and the rest."""
    return Rows(*(one[:count] for one in rows)), Rows(*(one[count:] for one in rows))
