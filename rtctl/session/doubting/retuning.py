"""The policy `retune` of a doubted run: rehearse, take over on trial, keep or roll back.

    named cause -> model with it -> rehearsal on the rows of the window -> margins -> it takes over -> trial -> verdict

With the reference instrument nothing is tried before the measured tracking error has grown; each cause that was told is
rehearsed by the loop's own estimator, and that error decides after the trial. Without one a cause is taken only if it
stands alone, and what stands for the instrument is the new model's own free run, which no reading corrects. Only one
trial is under way at a time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.border.arrays import BoolArray, FloatArray
from rtctl.border.errors import InputError, RunError
from rtctl.doubt.belief import MemoryBefore
from rtctl.doubt.naming import Answer
from rtctl.doubt.watch import Finding
from rtctl.loop.events import read_events
from rtctl.registry import plant_kind
from rtctl.scenario.schema import Scenario
from rtctl.session.doubting.followed import Followed
from rtctl.session.doubting.recorded import RowReader
from rtctl.session.live.successors import Onset, model_name, write_onset
from rtctl.session.run_folder import EVENTS

KEPT_S = 24.0
"""Rows that are kept for rehearsal and verdict [s]."""
UNCERTAIN_S = 1.0
"""How late after its onset a change may really have begun [s]: a window of the watch."""
SETTLE_S = 8.0
"""Time that an estimator of the model before follows, with the film's memory, until the change [s]."""
FORGOTTEN_S = 2.0
"""Time that an estimator, started in the middle of a run, needs until it is judged [s]."""
TRANSIENT_S, TRIAL_S = 1.0, 8.0
"""Time after a take-over that is not judged, and that is [s]: as long as the watch's past."""
PATIENCE_S = 60.0
"""Time in which a model that was asked for takes over, at most [s]."""
MODEL_EVENT = "model"
SIZES, REFINEMENTS = (0.7, 1.4), 8
"""Of a cause's size, what is tried in a rehearsal against the reference, and how often."""
CLEARLY = 0.9
"""Of the error with the size told, what a refined one may leave: a drift of seconds senses alike at many rates."""
ALONE = 0.8
"""Probability from which a cause stands alone, where no reference decides between several."""
GROWN = 1.2
"""Times by which the measured error has to have grown: below it a trial costs more than a new model can win."""
LEAST_S = 2.0
"""Time before a change by whose error the one since is judged [s], and the newest one that is [s]."""


class Told(NamedTuple):
    """A cause that was taken for true, and since which sample."""

    cause: Answer
    since: int


class Waiting(NamedTuple):
    """A finding that has not made the loop worse yet."""

    finding: Finding
    before: float
    """Measured error before the change [the output's unit]."""


class Trial(NamedTuple):
    """A model that has taken over, on trial."""

    number: int
    asked: int
    """Last sample that was known when it was asked for."""
    begins: int | None
    """First sample that is judged; None: it has not taken over yet, which takes a live loop seconds."""
    before: float
    """Measured error before it took over [the output's unit]."""
    causes: tuple[Told, ...]
    onset: Onset
    output: Callable[[Mapping[str, FloatArray]], FloatArray]
    """What stands for the output in rows (n,) [its unit]."""


class Retuning:
    """Acts on findings and looks at the rows of a run under way."""

    def __init__(
        self,
        folder: Path,
        scenario: Scenario,
        model: Any,
        change_model: Callable[[int], str],
        memory_before: MemoryBefore,
        *,
        use_reference: bool,
    ) -> None:
        """Remember a run. Raises InputError for a kind of plant that cannot be tuned anew.

        Args:
            folder: where it records.
            scenario: the checked scenario.
            model: its first model.
            change_model: lets a model of the folder take over, by its number; returns how it was tuned.
            memory_before: see `Belief.memory_before`.
            use_reference: whether the reference instrument is used.
        """
        self._kind = plant_kind(scenario.scenario.plant)
        if self._kind.retuned is None:
            raise InputError(
                f'a "{self._kind.name}" run cannot be tuned anew while it lasts; use derate or stop'
            )
        self._folder, self._scenario, self._model = folder, scenario, model
        self._change, self._use = change_model, use_reference
        self._period_s = scenario.scenario.period_s
        self._memory_before = memory_before
        self._rows: deque[Mapping[str, FloatArray]] = deque()
        self._trial: Trial | None = None
        self._waiting: Waiting | None = None
        self._kept: tuple[Told, ...] = ()
        self._in_force = self._number = 0
        self._followed: Followed | None = None
        """The estimator of the model in force; None: that is the run's first one."""

    def see(self, table: Mapping[str, FloatArray]) -> Iterator[Finding]:
        """Take rows of the recording; yield the verdict on a trial that is over."""
        self._rows.append({name: np.array(column) for name, column in table.items()})
        if self._followed is not None:
            self._followed.follow(self._rows[-1])
        newest = float(table["index"][-1])
        while newest - self._rows[0]["index"][-1] > KEPT_S / self._period_s:
            self._rows.popleft()
        trial = self._trial
        if trial is not None and trial.begins is None:
            self._trial = trial = trial._replace(begins=self._begin_of(trial, newest))
        if trial is not None and trial.begins is None and newest > trial.asked + PATIENCE_S / self._period_s:
            self._trial = None
            said = f"{model_name(trial.number)} has not taken over in {PATIENCE_S:g} s"
            yield Finding("rolled_back", int(newest), trial.asked, said)
        elif (
            trial is not None
            and trial.begins is not None
            and newest >= trial.begins + TRIAL_S / self._period_s
        ):
            self._trial = None
            yield self._judged(trial, trial.begins, int(newest))
        waiting = self._waiting
        if waiting is not None and self._trial is None:
            now = self._error_now(self._joined())
            if GROWN * waiting.before <= now < np.inf:
                self._waiting = None
                unit = self._scenario.profile.reference.unit
                said = f"the mean tracking error has grown since, {waiting.before:.3g} -> {now:.3g} {unit}: "
                yield waiting.finding._replace(sample=int(newest), message=said + waiting.finding.message)

    def act(self, finding: Finding) -> str:
        """Return what is done about a finding, in words; only causes that were named are acted on."""
        if finding.kind != "named" or not finding.causes or self._trial is not None:
            return ""
        self._waiting = None
        try:
            rows = self._joined()
            before = self._error_before(rows, finding.since)
            now = self._error_now(rows)
            if now < GROWN * before:
                self._waiting = Waiting(finding, before)
                raise InputError(
                    f"the mean tracking error has hardly grown, {before:.3g} -> {now:.3g} "
                    f"{self._scenario.profile.reference.unit}: a trial could cost more than it wins"
                )
            return self._try(finding, rows)
        except (InputError, RunError) as error:
            return f"retune: not done: {error}"

    def _error_before(self, rows: Mapping[str, FloatArray], since: int) -> float:
        """Return the measured tracking error before a change; 0 where the rows do not tell: any is more."""
        index, reference = rows["index"], rows[self._reference]
        begin = index[0] + FORGOTTEN_S / self._period_s
        judged = (index >= begin) & (index < since) & np.isfinite(reference)
        if not self._measures(rows) or since - begin < LEAST_S / self._period_s or not judged.any():
            return 0.0
        return _mean_error(rows, reference, judged)

    def _error_now(self, rows: Mapping[str, FloatArray]) -> float:
        """Return the measured tracking error of the newest rows; infinite where nothing measures it."""
        index, reference = rows["index"], rows[self._reference]
        newest = (index > index[-1] - LEAST_S / self._period_s) & np.isfinite(reference)
        if not self._use or not newest.any():
            return np.inf
        return _mean_error(rows, reference, newest)

    def _try(self, finding: Finding, rows: Mapping[str, FloatArray]) -> str:
        since = rows["index"] >= finding.since
        causes, model, said = self._rehearsed(
            [Told(one, finding.since) for one in finding.causes], rows, since
        )
        output = self._output_of(model)
        recent = rows["index"] >= max(float(finding.since), rows["index"][-1] - TRIAL_S / self._period_s)
        before = _mean_error(rows, output(rows), recent)
        self._number += 1
        path = self._folder / model_name(self._number)
        assert self._kind.model is not None
        self._kind.part(self._kind.model.write)(path, model)
        onset = self._onset(finding.since)
        write_onset(self._folder, self._number, onset)
        tuned = self._change(self._number)
        self._trial = Trial(self._number, int(rows["index"][-1]), None, before, causes, onset, output)
        return f"retune: {path.name} takes over on trial: {said}; {tuned}"

    def _rehearsed(
        self, told: Sequence[Told], rows: Mapping[str, FloatArray], since: BoolArray
    ) -> tuple[tuple[Told, ...], Any, str]:
        """Return the causes with the best one, its model, and how it was found. Raises InputError where none is."""
        if not self._use or not np.isfinite(rows[self._reference][since]).any():
            best = told[0]
            if best.cause.probability < ALONE:
                both = " and ".join(one.cause.id for one in told[:2])
                raise InputError(
                    f"{both} explain the readings alike and ask for different loops; only the reference instrument "
                    "could tell"
                )
            causes = (*self._kept, best)
            return (
                causes,
                self._made(causes),
                f"it removes {100.0 * best.cause.removes:.0f} % of the readings' error",
            )
        begin = float(rows["index"][np.argmax(since)])
        today = self._sensing_error(self._made(self._kept), rows, begin)
        found: list[tuple[float, tuple[Told, ...], Any]] = []
        refused = ""
        for one in told:
            causes = (*self._kept, one)
            try:
                model = self._made(causes)
                found.append((self._sensing_error(model, rows, begin), causes, model))
            except InputError as error:
                refused = str(error)
        if not found:
            raise InputError(refused)
        _, causes, _ = min(found, key=lambda one: one[0])
        least, causes, model = self._refined(causes, rows, begin)
        unit = self._scenario.profile.reference.unit
        name = causes[-1].cause.id
        said = f"in the rehearsal {name} brings the estimate's error from {today:.3g} to {least:.3g} {unit}"
        if not least < today:
            raise InputError(f"{said}, which is no gain")
        return causes, model, said

    def _refined(
        self, causes: tuple[Told, ...], rows: Mapping[str, FloatArray], begin: float
    ) -> tuple[float, tuple[Told, ...], Any]:
        """Return the rehearsal's error, causes and model with the size of the last cause that senses best."""
        from scipy.optimize import minimize_scalar

        *kept, (cause, since) = causes

        def with_size(times: float) -> tuple[Told, ...]:
            return (*kept, Told(cause._replace(size=times * cause.size), since))

        def error_with(times: float) -> float:
            try:
                return self._sensing_error(self._made(with_size(times)), rows, begin)
            except InputError:
                return np.inf

        found = minimize_scalar(error_with, bounds=SIZES, method="bounded", options={"maxiter": REFINEMENTS})
        best = with_size(float(found.x) if found.fun < CLEARLY * error_with(1.0) else 1.0)
        model = self._made(best)
        return self._sensing_error(model, rows, begin), best, model

    def _begin_of(self, trial: Trial, newest: float) -> int | None:
        """Return the first sample of a trial that is judged, by the run's events; None: it has not taken over yet."""
        for event in read_events(self._folder / EVENTS):
            is_its = event.kind == MODEL_EVENT and event.values["number"] == trial.number
            if is_its and trial.asked < event.step <= newest:
                return event.step + round(TRANSIENT_S / self._period_s)
        return None

    def _judged(self, trial: Trial, begins: int, sample: int) -> Finding:
        rows = self._joined()
        after = _mean_error(rows, trial.output(rows), rows["index"] >= begins)
        unit = self._scenario.profile.reference.unit
        measured = f"mean tracking error {trial.before:.3g} -> {after:.3g} {unit}"
        if not self._measures(rows):
            measured += " by the new model's free run"
        kept = after < trial.before
        if not kept and self._measures(rows):  # what drifts has gone on: going back would be worse still
            back = self._sensing_error(self._made(self._kept), rows, begins)
            kept = back > after
            measured += f"; the model before would sense {back:.3g} {unit} off by now"
        if kept:
            followed = Followed(self._scenario, self._made(trial.causes), self._made(self._kept), trial.onset)
            followed.follow(rows)
            self._followed, self._kept, self._in_force = followed, trial.causes, trial.number
            return Finding("retuned", sample, begins, f"{model_name(trial.number)} is kept: {measured}")
        try:
            self._change(self._in_force)
            done = f"{model_name(self._in_force)} takes over again"
        except (InputError, RunError) as error:
            done = f"could not be rolled back: {error}"
        said = f"{model_name(trial.number)} is not kept: {measured}; {done}"
        return Finding("rolled_back", sample, begins, said)

    @property
    def _reference(self) -> str:
        return self._scenario.profile.reference.name

    def _measures(self, rows: Mapping[str, FloatArray]) -> bool:
        return self._use and bool(np.isfinite(rows[self._reference]).any())

    def _onset(self, since: int) -> Onset:
        """Return since when another model is right than that in force, and what the film had been through before.

        The free run of the run's first model tells that until the first change, then the estimator of the one in force.
        """
        settled = since - round(SETTLE_S / self._period_s)
        known = (
            self._memory_before(settled) if self._followed is None else self._followed.memory_before(settled)
        )
        at, memory = (-1, None) if known is None else known
        return Onset(self._in_force, since, memory, at)

    def _made(self, causes: Sequence[Told]) -> Any:
        """Return the model with causes, at the moment since which the newest one acts."""
        newest = max((one.since for one in causes), default=0)
        ages_s = [(newest - one.since) * self._period_s for one in causes]
        return self._kind.part(self._kind.retuned)(self._model, [one.cause for one in causes], ages_s)

    def _joined(self) -> dict[str, FloatArray]:
        return {name: np.concatenate([one[name] for one in self._rows]) for name in self._rows[0]}

    def _output_of(self, model: Any) -> Callable[[Mapping[str, FloatArray]], FloatArray]:
        """Return what gives the output of rows: the reference, or a model in free run on their commands."""

        def read(rows: Mapping[str, FloatArray]) -> FloatArray:
            if self._measures(rows):
                return rows[self._reference]
            belief = self._kind.part(self._kind.belief)(model)
            reader = RowReader(self._scenario, use_reference=False)
            level = float(rows[self._scenario.profile.commands[0].name][0])
            reader.start(level, int(rows["index"][0]))
            belief.start(level)
            found: FloatArray = belief.predict(reader.rows(rows)).output
            found[: round(FORGOTTEN_S / self._period_s)] = np.nan
            return found

        return read

    def _sensing_error(self, model: Any, rows: Mapping[str, FloatArray], since: float) -> float:
        """Return a model's mean error of the estimate against the reference since a change [the output's unit].

        The estimator follows all rows, as one that takes over does: what a film has been through decides where it is.
        """
        onset = self._onset(round(since))
        values = Followed(self._scenario, model, self._made(self._kept), onset).follow(rows)
        first, last = rows["index"][0], rows["index"][-1]
        sure = since + min(UNCERTAIN_S / self._period_s, (last - since) / 3.0)
        judged = rows["index"] >= max(sure, first + FORGOTTEN_S / self._period_s)
        return float(np.nanmean(np.abs(values - rows[self._reference])[judged]))


def _mean_error(rows: Mapping[str, FloatArray], output: FloatArray, judged: BoolArray) -> float:
    return float(np.nanmean(np.abs(rows["setpoint"] - output)[judged]))
