"""An identified VO2 model as `rtctl.border.simulation.Simulation`: current -> heat -> film and beam -> readings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rtctl.border.arrays import FloatArray
from rtctl.border.mechanisms import drift_of
from rtctl.border.simulation import FreeParameter, Prediction, Stimulus, with_parameter_values
from rtctl.border.work import count_work
from rtctl.models.vo2 import SURROGATE, Vo2Model
from rtctl.simulations.vo2.current import pieces_of
from rtctl.simulations.vo2.film import ReadOut, follow
from rtctl.simulations.vo2.heat import heat_balance, phases_of, temperatures
from rtctl.simulations.vo2.mechanism import Balance, Commanded, Pieces, Read, Values, Vo2Mechanism, Warm
from rtctl.simulations.vo2.mechanisms import MECHANISMS
from rtctl.simulations.vo2.nominal import corrected, middle, middle_reading
from rtctl.simulations.vo2.nonparametric import UNNAMED
from rtctl.simulations.vo2.relaxation import heat_pieces

STEPS_PER_TIME_CONSTANT = 8.0
MOST_SUBSTEPS = 64
STEPS_OF_AN_INSTANT = 10.0
"""Cost of heat and both loops at one instant, in steps of an oscillator's integrator."""
STEPS_OF_A_READING = 2.0
"""Cost of the readings at one instant, in the same steps."""


class Visited(NamedTuple):
    """Temperatures at the instants as surrogates [mA], and their times."""

    v: FloatArray
    relays: FloatArray
    """Temperatures for the relays."""
    peaks: FloatArray
    """Turning point of that since the instant before; its own value without one."""
    warm: Warm
    pieces: Pieces
    substeps: int
    steps_s: FloatArray
    between: bool
    """Whether readings are needed between samples."""
    balance: Balance


class LoopPath(NamedTuple):
    """A record as the input of the identified loops."""

    v: FloatArray
    """Surrogate (m,) [mA], one extremum or instant after the other."""
    sampled: NDArray[np.intp]
    """Indices (n,) of the samples in it."""
    reading: FloatArray
    """Reading -ln R (n,) of the loops alone."""
    deflection: FloatArray
    """Deflection (n,) [um] of the loops alone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vo2Simulation:
    """Nominal parameters first, then each mechanism's, in their order in the file. Units: mA, ohm, um."""

    model: Vo2Model
    parameters: tuple[FreeParameter, ...]
    mechanisms: tuple[Vo2Mechanism, ...]
    kind: str = "vo2"
    outputs: tuple[str, ...] = ("resistance", "deflection")
    state: tuple[str, ...] = ()

    def starting(self, stimulus: Stimulus, values: FloatArray) -> FloatArray:
        """Return no state: a record starts at rest at a temperature of its stimulus; see `Simulation.starting`."""
        return np.empty(0)

    def predict(
        self,
        stimulus: Stimulus,
        values: FloatArray,
        initial: FloatArray | None = None,
        steps_per_period: float | None = None,
        refine: int = 1,
    ) -> Prediction:
        """Simulate from the branch that a full cooling leaves, at rest in the first current.

        Where the stimulus has an initial `surrogate` [mA], it starts at the temperature of that current instead.
        See `Simulation.predict`; `steps_per_period` refers to the heating's time constant.
        """
        values = np.atleast_2d(np.asarray(values, dtype=np.float64))
        shape = (len(values), stimulus.samples)
        resistance, deflection = np.empty(shape), np.empty(shape)
        steps = steps_per_period or STEPS_PER_TIME_CONSTANT
        with np.errstate(over="ignore", invalid="ignore"):  # what runs away is told below
            for lanes in self._sharing_a_temperature(values, stimulus.period_s, steps, refine):
                late_s = self._reads_at(values[lanes[0]])
                histories = {
                    one: self._history(stimulus, values[lanes[0]], steps, refine, one) for one in set(late_s)
                }
                for lane in lanes:
                    read = {one: self._readings(history, values[lane]) for one, history in histories.items()}
                    resistance[lane], deflection[lane] = read[late_s[0]][0], read[late_s[1]][1]
        bad = ~(np.isfinite(resistance) & np.isfinite(deflection))
        diverged = np.where(bad.any(axis=1), bad.argmax(axis=1), -1).astype(np.int64)
        return Prediction({"resistance": resistance, "deflection": deflection}, diverged)

    def with_values(self, values: FloatArray) -> Vo2Simulation:
        """Return the same model with `values` (parameters,) as its own."""
        return replace(self, parameters=with_parameter_values(self.parameters, values))

    def extended(self, mechanisms: tuple[str, ...]) -> Vo2Simulation:
        """Return the same model with these mechanisms at neutral; shapes at their defaults or scales."""
        added = tuple((MECHANISMS | UNNAMED)[name] for name in mechanisms)
        more = [one for mechanism in added for one in neutral_parameters(mechanism)]
        return replace(self, parameters=(*self.parameters, *more), mechanisms=(*self.mechanisms, *added))

    def instants(self, values: FloatArray, period_s: float) -> tuple[int, bool]:
        """Return the substeps of a sample period for `values` (parameters,), and whether readings are taken at each."""
        return self._grid(values, period_s, STEPS_PER_TIME_CONSTANT, 1)

    def acting(self) -> tuple[Vo2Mechanism, ...]:
        """Return the mechanisms that the model's own values have away from neutral."""
        return tuple(self._active(np.array([one.value for one in self.parameters])))

    def _sharing_a_temperature(
        self, values: FloatArray, period_s: float, steps: float, refine: int
    ) -> list[list[int]]:
        """Group lanes whose film has the same temperatures at the same instants."""
        acting = {mechanism.id for mechanism in self.mechanisms if mechanism.acts_on_temperature} | {""}
        columns = [
            k
            for k, one in enumerate(self.parameters)
            if one.mechanism in acting and not one.name.startswith(("resistance_", "deflection_"))
        ]
        groups: dict[tuple[float, ...], list[int]] = {}
        for lane, own in enumerate(values):
            key = (*own[columns].tolist(), *self._grid(own, period_s, steps, refine))
            groups.setdefault(key, []).append(lane)
        return list(groups.values())

    def _grid(self, values: FloatArray, period_s: float, steps: float, refine: int) -> tuple[int, bool]:
        """Return the substeps of a piece, and whether readings are needed at each."""
        active = self._active(values)
        balance = self._balance(active, values)
        finest = [one.resolves * balance.time_constant_s for one in active if one.resolves is not None]
        if balance.is_plain and not finest:
            return 1, False
        longest_s = min([balance.time_constant_s / steps, *finest])
        wanted = refine * math.ceil(min(period_s / longest_s, MOST_SUBSTEPS))
        return wanted, bool(finest)

    def _reads_at(self, values: FloatArray) -> tuple[float, float]:
        """Return by how much [s] resistance and deflection are read after their rows' instants."""
        both = [
            one.reads_at(self._of(one, values)) for one in self._active(values) if one.reads_at is not None
        ]
        return sum(one[0] for one in both), sum(one[1] for one in both)

    def _history(
        self, stimulus: Stimulus, values: FloatArray, steps: float, refine: int, late_s: float
    ) -> Read:
        """Return the output of film and beam, at instants that are late by `late_s`, as far as a group shares it."""
        return self._along(self._visited(stimulus, values, steps, refine, late_s), stimulus.period_s)

    def _along(self, seen: Visited, period_s: float) -> Read:
        """Follow the loops along temperatures."""
        every = 1 if seen.between else len(seen.steps_s)
        before = _just_before(seen.pieces, seen.substeps)
        model = self.model
        film: ReadOut = follow(seen.relays, seen.peaks, every, model.resistance_preisach.params)
        beam: ReadOut = follow(seen.relays, seen.peaks, every, model.deflection_preisach.params)
        warm = seen.warm
        temperature = late = temperatures(np.ascontiguousarray(warm.power[::every]), seen.balance)
        if warm.lagging is not warm.power:
            late = temperatures(np.ascontiguousarray(warm.lagging[::every]), seen.balance)
        return Read(
            reading=film.y, deflection=beam.y, resistance_relays=film.relays, deflection_relays=beam.relays,
            resistance=film.y, surrogate=seen.v[::every], current=before[::every],
            current_after=_just_after(before, seen.pieces, seen.substeps)[::every],
            time_s=warm.time_s[::every],
            steps_s=seen.steps_s if seen.between else np.array([period_s]), span=model.current,
            temperature=temperature, relays_temperature=late, phases=phases_of(model, seen.balance),
        )  # fmt: skip

    def _visited(
        self, stimulus: Stimulus, values: FloatArray, steps: float, refine: int, late_s: float
    ) -> Visited:
        """Return the temperatures at all instants, which are late by `late_s`."""
        active = self._active(values)
        substeps, between = self._grid(values, stimulus.period_s, steps, refine)
        pieces = self._pieces(stimulus, active, values, late_s)
        steps_s = np.repeat(pieces.durations_s / substeps, substeps)
        start = stimulus.initial.get(SURROGATE[0], math.nan) ** 2
        warm = self._warm(pieces, substeps, steps_s, active, values, start)
        v = np.sqrt(np.maximum(warm.power, 0.0))
        count_work(STEPS_OF_AN_INSTANT * len(v))
        seen = peaks = v
        if warm.lagging is not warm.power:
            seen, peaks = np.sqrt(np.maximum(warm.lagging, 0.0)), np.sqrt(np.maximum(warm.peaks, 0.0))
        for mechanism in active:
            if mechanism.loops is not None:
                seen, peaks = mechanism.loops(seen, peaks, self._of(mechanism, values))
        balance = self._balance(active, values)
        return Visited(v, seen, peaks, warm, pieces, substeps, steps_s, between, balance)

    def loop_path(
        self,
        stimulus: Stimulus,
        values: FloatArray,
        steps_per_period: float | None = None,
        output: str = "deflection",
    ) -> LoopPath:
        """Return the path of the relays over a record for `values` (parameters,), and the loops' output there.

        The samples in it are those of `output`, which may be read at another instant than the other one.
        """
        steps = steps_per_period or STEPS_PER_TIME_CONSTANT
        late_s = self._reads_at(values)[self.outputs.index(output)]
        seen = self._visited(stimulus, values, steps, 1, late_s)
        history = self._along(seen, stimulus.period_s)
        v = np.column_stack((seen.peaks, seen.relays)).reshape(-1)
        every = len(seen.steps_s)
        readings = slice(None, None, every if seen.between else 1)
        return LoopPath(
            v=v, sampled=1 + 2 * np.arange(0, len(seen.v), every),
            reading=history.reading[readings], deflection=history.deflection[readings],
        )  # fmt: skip

    def _pieces(
        self, stimulus: Stimulus, active: Sequence[Vo2Mechanism], values: FloatArray, late_s: float
    ) -> Pieces:
        commanded = Commanded(
            np.ascontiguousarray(stimulus.inputs["current"], dtype=np.float64),
            stimulus.period_s,
            stimulus.holds.get("current", "linear"),
            delay_s=-self.model.timing_skew_rows * stimulus.period_s - late_s,
            onward=stimulus.onward.get("current", np.empty(0)),
        )
        for mechanism in active:
            if mechanism.command is not None:
                commanded = mechanism.command(commanded, self._of(mechanism, values))
        pieces = pieces_of(commanded)
        for mechanism in active:
            if mechanism.pieces is not None:
                pieces = mechanism.pieces(pieces, self._of(mechanism, values))
        nodes = corrected(pieces.nodes, "current", middle(self.model.current), self._nominal(values))
        return pieces._replace(nodes=nodes)

    def _warm(
        self,
        pieces: Pieces,
        substeps: int,
        steps_s: FloatArray,
        active: Sequence[Vo2Mechanism],
        values: FloatArray,
        start: float,
    ) -> Warm:
        balance = self._balance(active, values)
        if balance.is_plain:
            power = heat_pieces(pieces.nodes, pieces.durations_s, substeps, balance.time_constant_s, start)
        else:
            power, lagging, peaks = heat_balance(pieces, substeps, balance, self.model, start)
        within = np.concatenate(([0.0], np.cumsum(steps_s)[:-1]))
        periods = (len(power) - 1) // len(steps_s)
        starts = float(pieces.durations_s.sum()) * np.arange(periods + 1)
        time_s = np.asarray((starts[:, None] + within).reshape(-1)[: len(power)], np.float64)
        if balance.is_plain:
            lagging = peaks = power = power + balance.drift * drift_of(time_s, balance.settling_s)
        warm = Warm(power, lagging, peaks, time_s)
        for mechanism in active:
            if mechanism.warm is not None:
                warm = mechanism.warm(warm, self._of(mechanism, values))
        return warm

    def _readings(self, history: Read, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return resistance and deflection (samples,) of one lane."""
        active, nominal = self._active(values), self._nominal(values)
        count_work(STEPS_OF_A_READING * len(history.reading))
        read = history
        for mechanism in active:
            if mechanism.film is not None:
                read = mechanism.film(read, self._of(mechanism, values))
        reading = corrected(
            read.reading, "resistance", middle_reading(self.model.resistance), nominal, sign=-1.0
        )
        deflection = corrected(read.deflection, "deflection", middle(self.model.deflection), nominal)
        with np.errstate(over="ignore", invalid="ignore"):
            read = read._replace(resistance=np.exp(-reading), deflection=deflection)
            for mechanism in active:
                if mechanism.instrument is not None:
                    read = mechanism.instrument(read, self._of(mechanism, values))
        every = len(read.steps_s)
        return read.resistance[::every], read.deflection[::every]

    def _balance(self, active: Sequence[Vo2Mechanism], values: FloatArray) -> Balance:
        balance = Balance(self._nominal(values)["time_constant"])
        for mechanism in active:
            if mechanism.balance is not None:
                balance = mechanism.balance(balance, self._of(mechanism, values))
        return balance

    def _active(self, values: FloatArray) -> list[Vo2Mechanism]:
        """Return the mechanisms away from neutral in order of action: neutral ones must not change a bit."""
        moved = {
            one.mechanism
            for one, value in zip(self.parameters, values.tolist(), strict=True)
            if one.declared.neutral is not None and value != one.declared.neutral
        }
        return sorted((one for one in self.mechanisms if one.id in moved), key=lambda one: one.stage)

    def _nominal(self, values: FloatArray) -> Values:
        pairs = zip(self.parameters, values.tolist(), strict=True)
        return {one.name: value for one, value in pairs if not one.mechanism}

    def _of(self, mechanism: Vo2Mechanism, values: FloatArray) -> Mapping[str, float]:
        pairs = zip(self.parameters, values.tolist(), strict=True)
        return {one.declared.name: value for one, value in pairs if one.mechanism == mechanism.id}


def neutral_parameters(mechanism: Vo2Mechanism) -> list[FreeParameter]:
    """Return the parameters of a mechanism without effect."""
    found = []
    for declared in mechanism.parameters:
        value = declared.neutral
        if value is None:
            value = 1.0 if declared.default is None else declared.default
        found.append(
            FreeParameter(
                f"{mechanism.id}.{declared.name}", declared.unit, value, declared.searched_low, declared.high, False,
                declared, mechanism.id,
            )
        )  # fmt: skip
    return found


def _just_after(before: FloatArray, pieces: Pieces, substeps: int) -> FloatArray:
    """Return the current just after each instant (instants,) [mA] from that just before; the last one repeats it."""
    found = before.copy()
    found[:-1:substeps] = pieces.nodes[:, 0]
    return found


def _just_before(pieces: Pieces, substeps: int) -> FloatArray:
    """Return the current just before each instant (instants,) [mA]."""
    ends = np.empty(len(pieces.nodes) * substeps + 1)
    ends[0] = pieces.nodes[0, 0]
    x = np.arange(1, substeps + 1) / substeps
    start, to_middle, to_end = (
        pieces.nodes[:, :1],
        pieces.nodes[:, 1:2] - pieces.nodes[:, :1],
        pieces.nodes[:, 2:] - pieces.nodes[:, :1],
    )
    ends[1:] = (start + x * (4.0 * to_middle - to_end + x * (2.0 * to_end - 4.0 * to_middle))).reshape(-1)
    return ends
