"""A model's differential equations for SciPy and python-control: `dynamics`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rtctl.api.inputs import PathText
from rtctl.api.model import Model, model_of
from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError, nearest
from rtctl.border.exported.dynamics import Channel, Dynamics

if TYPE_CHECKING:
    import control

Level = float | Callable[[float], float]
"""An input: a constant, or a function of the time [s]."""
STEPS = 10.0 ** -np.arange(3.0, 14.0)
"""Steps of a difference quotient that are tried, as shares of a number's size, or of 1 where it is smaller: how far a
device moves is not known, a micromachined one moves by 1e-9 of its unit."""
EPS = float(np.finfo(np.float64).eps)
ROUNDINGS = 4.0
"""Roundings of an argument by which the rounding of a law is seen."""


class Linearised(NamedTuple):
    """dx/dt = A dx + B du, dy = C dx + D du about a point, in the units of the model's signals and states."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModelDynamics:
    """A model as dx/dt = f(t, x, u), y = g(t, x, u)."""

    laws: Dynamics
    name: str

    @property
    def states(self) -> Mapping[str, str]:
        """Unit of each state by its name, in their order; "": a state of a mechanism, in units of its own."""
        return _units(self.laws.states)

    @property
    def inputs(self) -> Mapping[str, str]:
        """Unit of each input by its name."""
        return _units(self.laws.inputs)

    @property
    def outputs(self) -> Mapping[str, str]:
        """Unit of each output by its name."""
        return _units(self.laws.outputs)

    @property
    def initial(self) -> FloatArray:
        """States (states,) at the start of a record."""
        return self.laws.initial.copy()

    def right_hand_side(
        self, inputs: Mapping[str, Level] | None = None
    ) -> Callable[[float, Any], FloatArray]:
        """Return f(t, x) for `scipy.integrate.solve_ivp`, with `inputs` by name; one that is left out is 0.

        Raises:
            InputError: There is no such input.
        """
        levels = self._levels(inputs)

        def f(t: float, x: Any) -> FloatArray:
            return self.laws.rates(t, np.asarray(x, dtype=np.float64), _at(levels, t))

        return f

    def read(self, t: Any, x: Any, inputs: Mapping[str, Level] | None = None) -> dict[str, FloatArray]:
        """Return the outputs (n,) by name at times t (n,) and states x (states, n), as `solve_ivp` gives them.

        Raises:
            InputError: There is no such input.
        """
        levels, times = self._levels(inputs), np.atleast_1d(np.asarray(t, dtype=np.float64))
        columns = np.asarray(x, dtype=np.float64).reshape(len(self.laws.states), -1)
        found = np.array([
            self.laws.read(float(time), columns[:, k], _at(levels, float(time))) for k, time in enumerate(times)
        ])  # fmt: skip
        return {one.name: found[:, k] for k, one in enumerate(self.laws.outputs)}

    def rest(self, inputs: Mapping[str, float] | None = None) -> FloatArray:
        """Return the states (states,) that stay where they are under constant inputs, nearest to the start.

        Raises:
            InputError: There are none near, or there is no such input.
        """
        from scipy.optimize import root

        u = _at(self._levels(inputs), 0.0)

        def drift(x: FloatArray) -> FloatArray:
            return self.laws.rates(0.0, x, u)

        found = root(drift, self.laws.initial, tol=1e-12)
        if not found.success and not np.allclose(self.laws.rates(0.0, found.x, u), 0.0, atol=1e-9):
            raise InputError(f"{self.name}: no state of rest was found from the start: {found.message}")
        return np.asarray(found.x)

    def matrices(
        self, states: Any = None, inputs: Mapping[str, float] | None = None, time_s: float = 0.0
    ) -> Linearised:
        """Return the linear equations about a point, by central differences.

        Args:
            states: States (states,) of the point; None: where the model rests under `inputs`.
            inputs: Inputs there by name; one that is left out is 0.
            time_s: Time [s], where the model depends on it.

        Raises:
            InputError: The point is none of the model's, or there is no such input.
        """
        u = _at(self._levels(inputs), time_s)
        x = self.rest(inputs) if states is None else np.asarray(states, dtype=np.float64)
        if x.shape != (len(self.laws.states),) or not np.isfinite(x).all():
            raise InputError(
                f"{self.name}: states must be {len(self.laws.states)} finite numbers, got {states!r}"
            )
        rates, read = self.laws.rates, self.laws.read
        return Linearised(
            A=_slopes(lambda one: rates(time_s, one, u), x),
            B=_slopes(lambda one: rates(time_s, x, one), u),
            C=_slopes(lambda one: read(time_s, one, u), x),
            D=_slopes(lambda one: read(time_s, x, one), u),
        )

    def linearise(
        self, states: Any = None, inputs: Mapping[str, float] | None = None, time_s: float = 0.0
    ) -> control.StateSpace:
        """Return `matrices` as a `control.StateSpace` with the model's names."""
        import control

        made = self.matrices(states, inputs, time_s)
        return control.StateSpace(*made, **self._names())

    def nonlinear_system(self) -> control.NonlinearIOSystem:
        """Return the model as a `control.NonlinearIOSystem`, with its names."""
        import control

        def update(t: float, x: Any, u: Any, params: Any) -> FloatArray:
            return self.laws.rates(t, np.asarray(x, dtype=np.float64), np.atleast_1d(u))

        def output(t: float, x: Any, u: Any, params: Any) -> FloatArray:
            return self.laws.read(t, np.asarray(x, dtype=np.float64), np.atleast_1d(u))

        return control.NonlinearIOSystem(update, output, **self._names())

    def _names(self) -> dict[str, Any]:
        """Return the names as python-control takes them: a point in a name means a signal of a system there."""
        plain = {
            word: [one.name.replace(".", "_") for one in getattr(self.laws, word)]
            for word in ("inputs", "outputs", "states")
        }
        return {**plain, "name": self.name.replace(".", "_")}

    def _levels(self, inputs: Mapping[str, Level] | None) -> list[Level]:
        given, known = dict(inputs or {}), list(self.inputs)
        for name in given:
            if name not in known:
                raise InputError(f'{self.name}: the model has no input "{name}"{nearest(name, known)}')
        return [given.get(name, 0.0) for name in known]


def dynamics(model: Model | PathText, *, branch: str | None = None) -> ModelDynamics:
    """Return a model's differential equations, for `scipy.integrate.solve_ivp` and python-control.

    Args:
        model: A model or its file.
        branch: Of a VO2 model: "rising" (None) or "falling", the branch of its major loop.

    Raises:
        InputError: A part of the model is no differential equation (an event, a delay, a play); it is named.
    """
    from rtctl.export.of_models import build_dynamics

    content = model_of(model)
    source = str(content.source or "the model")
    if branch is not None and content.kind != "vo2":
        raise InputError(
            f"{source}: branch is of hysteretic models (vo2), this one is of kind {content.kind}"
        )
    name = content.source.stem if content.source else content.kind
    return ModelDynamics(laws=build_dynamics(content.content, source, content.kind, branch), name=name)


def _units(channels: tuple[Channel, ...]) -> dict[str, str]:
    return {one.name: one.unit for one in channels}


def _at(levels: list[Level], t: float) -> FloatArray:
    return np.array([one(t) if callable(one) else one for one in levels], dtype=np.float64)


def _slopes(law: Callable[[FloatArray], FloatArray], at: FloatArray) -> FloatArray:
    """Return the slopes (values, arguments) of a law at a place, by central differences.

    Each is that of the step with the least error: how far the quotient differs from that of the next smaller step (a
    curved law), and what rounding of the law's values does to it.
    """
    noise, columns = _rounding(law, at), []
    for k in range(len(at)):
        steps = STEPS * max(abs(float(at[k])), 1.0)
        found = np.array([_quotient(law, at, k, step) for step in steps])
        error = np.abs(np.diff(found, axis=0)) + noise / steps[:-1, None]
        best = np.argmin(np.where(np.isfinite(error), error, np.inf), axis=0)
        columns.append(np.take_along_axis(found, best[None], axis=0)[0])
    return np.stack(columns, axis=1) if columns else np.zeros((len(noise), 0))


def _quotient(law: Callable[[FloatArray], FloatArray], at: FloatArray, k: int, step: float) -> FloatArray:
    """Return the central difference quotient (values,) of a law along one argument."""
    below, above = at.copy(), at.copy()
    below[k] -= step
    above[k] += step
    slope: FloatArray = (law(above) - law(below)) / (above[k] - below[k])
    return slope


def _rounding(law: Callable[[FloatArray], FloatArray], at: FloatArray) -> FloatArray:
    """Return the rounding (values,) of a law at a place: what a few roundings of an argument change in it.

    Where large terms cancel, as at rest, it is that of the terms and not of their sum.
    """
    noise = EPS * np.abs(law(at))
    for k in range(len(at)):
        below, above = at.copy(), at.copy()
        below[k] *= 1.0 - ROUNDINGS * EPS
        above[k] *= 1.0 + ROUNDINGS * EPS
        noise = np.maximum(noise, np.abs(law(above) - law(below)))
    return noise
