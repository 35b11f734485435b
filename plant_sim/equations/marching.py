"""A record's integration: steps are planned along the motion, refined until they resolve it, and kept."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from plant_sim.equations.compiled.adaptive import ERROR_ORDER
from plant_sim.equations.compiled.kernels import march, march_adaptively
from plant_sim.equations.integration.steps import (
    IMPLICIT_COST,
    Plan,
    check_work,
    places_of,
    plan,
    rates_at,
    slopes,
)
from plant_sim.equations.system import System
from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus
from rtctl.border.work import count_work

MOST_PLANS = 5
BAND_LIMITED_SUBSTEPS = 4
"""Least steps between two samples of an input that swings between them."""
SAME_PLAN = 0.05
"""Relative change of the parameters below which a record's plan holds on."""
SAME_COARSE_PLAN = 0.25
"""The same where the steps are asked for: their number follows the rates, and a fit's need not be exact."""
MOST_OF_A_FIT = 16.0
"""Work of a fit's run, over that of the first one of its record, beyond which the parameters are no candidates: a term
that grows with the state it drives needs steps without number."""
WORTH_LIMITING = 256.0
"""Steps between two samples up to which a fit's run is never refused."""
MOST_KEPT = 32
"""Plans of a record that are kept, of as many places in the space of the parameters."""
CONVERGED = 1e-6
"""Change of the states, relative to their swing, below which twice as many implicit steps do nothing."""
MOST_DOUBLINGS = 8
TOLERANCE, TOLERANCE_OF_FIT = 1e-9, 1e-7
"""Error of a step whose length follows the motion, as a share of the largest value that a state had."""
WORTH_ADAPTING, ADAPTIVE_GAIN = 8, 2
"""Implicit steps between two samples, or as much work, from which on steps that follow the motion are tried, and how
many times less work they must be."""
MOST_ADAPTIVE, MOST_ADAPTIVE_OF_SAMPLE = 200_000, 200
"""Steps of a lane that follow its motion, at most, in a record and for each of its samples: the larger counts."""
ONSET = 0.1
"""Share of the largest change from which on it is there: later it may only have grown."""
DISTINCT_LANES = 4
"""Lanes at most whose slopes are looked at, where lanes are not neighbours."""
MOST_BETWEEN = 8
"""Instants at most between two samples at which a motion is told."""
Nodes = Callable[[int], FloatArray]
"""Function of the steps between two samples that returns the inputs (3, steps, inputs) [SI]."""
Kept = list[tuple[FloatArray, Plan]]
"""Parameters (parameters,) and the plan there, the latest first."""
_plans: weakref.WeakKeyDictionary[Stimulus, dict[tuple[System, float | None], Kept]] = (
    weakref.WeakKeyDictionary()
)


class Motion(NamedTuple):
    """The states of a record, and the steps that led to them."""

    x: FloatArray
    """States (instants, states, lanes) [SI]."""
    substeps: int
    """Steps between two samples."""
    between: int = 1
    """Instants in a sample period."""


class Marching(NamedTuple):
    """A system, and a record's inputs, start and parameters."""

    system: System
    stimulus: Stimulus
    nodes: Nodes
    start: FloatArray
    """States (states, lanes) [SI] at the first sample."""
    p: FloatArray
    """Parameters (parameters, lanes) [SI]."""
    sizes: FloatArray
    """Changes (parameters,) [SI] that no plan notices, besides `SAME_PLAN` of a value."""
    steps_per_period: float | None = None
    uniform: bool = False
    """Whether all steps between two samples are as long, as an exported model takes them."""

    def move(self, refine: int, *, between: bool, least: int = 1) -> Motion:
        """Return the motion at the samples, or `between` them too.

        Args:
            refine: Factor of the steps.
            between: Whether instants between the samples are told.
            least: Number of instants in a sample period, least, where they are.

        Raises:
            ValueError: No sensible step resolves the model.
        """
        x, how = self._at_samples(refine)
        if not between or how.substeps == least == 1:
            return Motion(x, how.substeps)
        instants = next((k for k in range(MOST_BETWEEN, least - 1, -1) if how.substeps % k == 0), least)
        how = how._replace(substeps=instants * -(-how.substeps // instants))
        return Motion(self._run(how, instants), how.substeps, instants)

    def resolve(self) -> Plan:
        """Return the steps that resolve the motion. Raises ValueError where no sensible step does."""
        return self._at_samples(1)[1]

    def _at_samples(self, refine: int) -> tuple[FloatArray, Plan]:
        plans = _plans.setdefault(self.stimulus, {})
        kept = plans.setdefault((self.system, self.steps_per_period), [])
        for place, how in kept:
            if not self._is_near(place):
                continue
            how = _refined(how, refine)
            x = self._run(how)
            if how.tolerance or not how.implicit or np.isfinite(x).all():
                return x, how
            break  # from this start it has a jump where those before had none
        self._check_start()
        how = self._cheaper(self._first_plan())
        self._check_fit(how, kept)
        x = self._run(how)
        for _ in range(0 if how.tolerance else MOST_PLANS):
            wanted = self._plan_along(x)
            if wanted.implicit and wanted.substeps <= how.substeps and how.implicit:
                break
            if wanted.implicit == how.implicit and wanted.substeps <= how.substeps and np.isfinite(x).all():
                break
            how = self._cheaper(wanted)
            self._check_fit(how, kept)
            x = self._run(how)
            if how.tolerance:
                break
        if how.implicit and not how.tolerance:
            how, x = self._converged(how, x, kept)
        kept.insert(0, (self.p[:, 0].copy(), how))
        del kept[MOST_KEPT:]
        if refine > 1:
            how = _refined(how, refine)
            x = self._run(how)
        return x, how

    def _cheaper(self, how: Plan) -> Plan:
        """Return a plan of steps that follow the motion where these are far fewer, else the plan as it is."""
        implicit_steps = _steps_worth(how) / IMPLICIT_COST
        if self.uniform or self.system.events or implicit_steps < WORTH_ADAPTING:
            return how
        holds = {self.stimulus.holds.get(one.name) for one in self.system.inputs}
        substeps = BAND_LIMITED_SUBSTEPS if "band-limited" in holds else 1
        adaptive = Plan(
            substeps,
            implicit=True,
            tolerance=TOLERANCE if self.steps_per_period is None else TOLERANCE_OF_FIT,
        )
        try:
            self._adapted(adaptive, lanes=1, most=int(implicit_steps * self.stimulus.samples / ADAPTIVE_GAIN))
        except ValueError:
            return how
        return adaptive

    def _adapted(
        self, how: Plan, lanes: int | None = None, most: int | None = None, between: int = 1
    ) -> FloatArray:
        """Return the states of the first `lanes` (None: all) by steps that follow the motion. Raises ValueError."""
        finer, period_s = how._replace(substeps=how.substeps // between), self.stimulus.period_s / between
        start, p = np.ascontiguousarray(self.start[:, :lanes]), np.ascontiguousarray(self.p[:, :lanes])
        usual = max(MOST_ADAPTIVE, MOST_ADAPTIVE_OF_SAMPLE * self.stimulus.samples)
        most = usual if most is None else min(most, usual)
        x, steps = march_adaptively(self.system, start, self.nodes(how.substeps), period_s, finer, p, most)
        count_work(0.5 * len(start) * IMPLICIT_COST * steps)
        return x

    def _check_fit(self, how: Plan, kept: Kept) -> None:
        """Raise ValueError where a fit's run takes far more work than the first run of its record."""
        if self.steps_per_period is None or not kept or how.tolerance:
            return
        most = max(WORTH_LIMITING, MOST_OF_A_FIT * min(_steps_worth(one) for _, one in kept))
        if _steps_worth(how) > most:
            raise ValueError(
                f"a fit's parameters ask for {how.substeps} steps between two samples, at most {most:.0f} are taken"
            )

    def _check_start(self) -> None:
        """Raise ValueError where a rate is not finite at the first sample."""
        u = self.nodes(1)[0, :1]
        rates = rates_at(self.system, places_of(self.start[:, :1].T, u, 1.0), self.p[:, 0])[0]
        for one, rate in zip(self.system.states, rates.tolist(), strict=True):
            if not np.isfinite(rate):
                raise ValueError(
                    f"the rate of the state {one.name} is {rate:g} at the start of the record; correct its equation, "
                    "the initial state or the parameters"
                )

    def _first_plan(self) -> Plan:
        """Return a plan from the start alone, the inputs being what they are over the record."""
        u, start, period_s = self.nodes(1)[0], self.start, self.stimulus.period_s
        places = places_of(np.repeat(start[:, :1].T, len(u), axis=0), u, period_s)
        rates = rates_at(self.system, places, self.p[:, 0])
        largest = np.abs(np.nan_to_num(rates, posinf=0.0, neginf=0.0)).max(axis=0)
        swing = np.maximum(np.abs(start[:, 0]), 4.0 * period_s * largest)
        swing = np.maximum(swing, 1e-12 * max(float(swing.max()), 1e-12))
        return self._planned(slopes(self.system, places, self.p[:, 0], swing))

    def _plan_along(self, x: FloatArray) -> Plan:
        """Return a plan from motions (samples, states, lanes): of the first lane, and of others that differ."""
        inputs = self.nodes(1)[0]
        found = []
        for lane in self._distinct():
            places = places_of(x[:-1, :, lane], inputs, self.stimulus.period_s)
            swing = np.maximum(np.ptp(places.x, axis=0), 1e-3 * np.abs(places.x).max(axis=0))
            swing = np.maximum(swing, 1e-12 * max(float(swing.max()), 1e-12))
            found.append(slopes(self.system, places, self.p[:, lane], swing))
        return self._planned(np.concatenate(found))

    def _planned(self, jacobians: FloatArray) -> Plan:
        how = plan(jacobians, self.stimulus.period_s, self.steps_per_period)
        holds = {self.stimulus.holds.get(one.name) for one in self.system.inputs}
        if "band-limited" in holds:
            how = how._replace(substeps=max(how.substeps, BAND_LIMITED_SUBSTEPS))
        return how

    def _run(self, how: Plan, between: int = 1) -> FloatArray:
        if how.tolerance:
            return self._adapted(how, between=between)
        check_work(how.substeps, self.stimulus.samples)
        states, lanes = self.start.shape
        cost = 0.5 * states * _steps_worth(how)
        count_work(lanes * self.stimulus.samples * (1.0 + cost))
        finer = how._replace(substeps=how.substeps // between)
        period_s = self.stimulus.period_s / between
        return march(self.system, self.start, self.nodes(how.substeps), period_s, finer, self.p)

    def _converged(self, how: Plan, x: FloatArray, kept: Kept) -> tuple[Plan, FloatArray]:
        """Return the implicit steps from which on twice as many change nothing, and the states with them.

        Raises:
            ValueError: There are no such steps.
        """
        for _ in range(MOST_DOUBLINGS):
            finer = self._cheaper(how._replace(substeps=2 * how.substeps))
            self._check_fit(finer, kept)
            y = self._run(finer)
            if finer.tolerance:
                return finer, y
            swing = np.maximum(np.ptp(y[:, :, 0], axis=0), 1e-6 * np.abs(y[:, :, 0]).max(axis=0))
            change = np.abs(y[:, :, 0] - x[:, :, 0])
            if not np.isfinite(y[:, :, 0]).all() or (change.max(axis=0) <= CONVERGED * swing).all():
                return how, x
            how, x = finer, y
        raise ValueError(self._about_unresolved(how, change / np.maximum(swing, 1e-300)))

    def _about_unresolved(self, how: Plan, change: FloatArray) -> str:
        """Return which state halved steps change most, and when first; `change` (samples, states) by its swing."""
        worst = int(np.argmax(change.max(axis=0)))
        at = int(np.argmax(change[:, worst] > ONSET * change[:, worst].max()))
        state = self.system.states[worst]
        return (
            f"the model is stiff, and {how.substeps} implicit steps between two samples do not resolve the state "
            f"{state.name}: half as many change it by {100.0 * float(change.max()):.2g} % of its swing, from "
            f"{at * self.stimulus.period_s:.6g} s on. Something in its rate jumps there or is far faster than the "
            "samples, such as a sign or a square root whose argument passes through 0: smooth it (sqrt(abs(d) + eps)), "
            "or leave it out"
        )

    def _is_near(self, place: FloatArray) -> bool:
        """Return whether the parameters of all lanes are those of a `place` (parameters,), nearly."""
        share = SAME_PLAN if self.steps_per_period is None else SAME_COARSE_PLAN
        most = np.maximum(share * np.abs(place), self.sizes)
        return bool((np.abs(self.p - place[:, None]) <= most[:, None]).all())

    def _distinct(self) -> list[int]:
        """Return the first lane, and some others whose parameters differ from its own."""
        if self._is_near(self.p[:, 0]):
            return [0]
        far = np.argsort(-np.abs(self.p - self.p[:, :1]).sum(axis=0), kind="stable")
        return [0, *(int(lane) for lane in far[: DISTINCT_LANES - 1] if lane != 0)]


def _steps_worth(how: Plan) -> float:
    """Return the work of a plan in Runge-Kutta's steps."""
    return how.substeps * (IMPLICIT_COST if how.implicit else 1.0)


def _refined(how: Plan, refine: int) -> Plan:
    """Return a plan of `refine` times as many steps, or of as much finer ones where they follow the motion."""
    if how.tolerance:
        return how._replace(tolerance=how.tolerance / refine**ERROR_ORDER)
    return how._replace(substeps=refine * how.substeps)
